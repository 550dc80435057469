"""The page of `ajgdata browse` as a browser shows it: keys, filters, four widths, hostile names."""

import shutil
import time
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest
import yaml
from measured import RATE_HZ
from recorded import make_features
from test_pages import AXE, BEYOND, CONTRAST, RULES, assert_none

from ajgdata.browse.site import browsing
from ajgdata.browse.view import View
from ajgdata.paths import Paths
from ajgdata.store.audio import write_pcm24
from ajgdata.store.metrics import write_predictions
from ajgdata.store.sessions import write_session
from ajgdata.store.tables import write_measurements
from ajgdata.types import Recording, Session
from ajgdata.types.table import table_of

pytestmark = pytest.mark.browser

NAME = "tones"
# Keys of WebDriver.
ENTER = "\ue007"
ESCAPE = "\ue00c"
END = "\ue010"
HOSTILE = "<img src=x onerror=alert(1)>"
CLASSES = ("low", HOSTILE)
COUNT = 30
SCROLLED = 2_000
ROWS = """
return [...document.querySelectorAll('#table tbody tr[data-number]')]
  .map(row => [...row.cells].slice(0, 3).map(cell => cell.textContent.trim()))
"""
FIRST = "return document.querySelector('#table tr[data-number]').cells[0].textContent"
SELECTED = "return document.querySelector('#table tr.selected')?.cells[0].textContent"
FILLED = """
return [...document.querySelectorAll('#table tr[data-number]')]
  .every(row => row.cells[0].textContent.trim())
"""
DRAWN = """
const canvas = document.getElementById(arguments[0]);
const bytes = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
return new Set(new Uint32Array(bytes.buffer)).size
"""


def declare(paths, count=COUNT):
    """Record tones of two classes, the second of which has a hostile name."""
    paths.dataset(NAME).parent.mkdir(parents=True)
    declaration = {
        "name": NAME,
        "title": f"Tones {HOSTILE}",
        "audio": {"sample_rate_hz": RATE_HZ},
        "features": {"window": 256, "hop": 128},
        "targets": {"pitch": {"kind": "classification"}},
        "tasks": {"pitch": {"target": "pitch", "models": ["knn"]}},
    }
    paths.dataset(NAME).write_text(yaml.safe_dump(declaration), encoding="utf-8")
    folder = paths.session(NAME, "s1")
    time_s = np.arange(RATE_HZ // 4) / RATE_HZ
    generator = np.random.default_rng(0)
    recordings = []
    for number in range(count):
        pitch = CLASSES[number % 2]
        tone = np.sin(2 * np.pi * (400 + 3000 * (number % 2) + 10 * number) * time_s)
        file = f"audio/{number:05}.wav"
        if number < COUNT:
            write_pcm24(folder / file, 0.3 * tone + generator.normal(0, 0.01, len(tone)), RATE_HZ)
        recordings.append(
            Recording(
                recording_id=f"r{number:05}",
                file=file,
                labels={"pitch": pitch},
                grasp_id=f"g{number}",
                object=HOSTILE,
            )
        )
    write_session(folder, Session(session_id="s1", source="import", notes=HOSTILE), recordings)


def predict(paths):
    """Write predictions: r00002 is wrong with a probability of 90 %, r00004 with 60 %."""
    wrong = {2: 0.9, 4: 0.6}
    rows = [
        {
            "recording": f"s1/r{number:05}",
            "split": "grouped",
            "test_set": NAME,
            "target_values": "training",
            "fold": 0,
            "y_true": CLASSES[number % 2],
            "y_pred": CLASSES[(number % 2) ^ (number in wrong)],
            "probability": wrong.get(number, 0.8),
        }
        for number in range(COUNT)
    ]
    table = table_of("predictions", "Predictions", rows, **{key: key for key in rows[0]})
    about = {"dataset": NAME, "task": "pitch", "model": "knn"}
    path = paths.experiment(NAME, "pitch", "cross_validation", "plain")
    write_measurements(path, [(about, [table])])
    write_predictions(paths.predictions, [{**about, **row} for row in rows])


class Page:
    """An open page."""

    def __init__(self, browser):
        self.browser = browser

    def open(self, address):
        self.browser.open(address)
        self.wait("return document.body.dataset.ready === 'yes'")
        return self

    def wait(self, script, *arguments):
        end = time.monotonic() + 20
        while not (value := self.browser.run(script, *arguments)):
            assert time.monotonic() < end, f"never came true: {script}"
            time.sleep(0.02)
        return value

    def keys(self, *keys):
        from selenium.webdriver.common.action_chains import ActionChains

        for key in keys:
            ActionChains(self.browser.driver).send_keys(key).perform()

    def rows(self):
        """The first cells of all rows in the page, when they have come."""
        self.wait(FILLED)
        return self.browser.run(ROWS)

    def text(self, name):
        return self.browser.run("return document.getElementById(arguments[0]).textContent", name)

    def shows(self, recording):
        """Wait until a recording is shown."""
        self.wait("return document.getElementById('name').textContent === arguments[0]", recording)
        self.wait(f"{SELECTED} === arguments[0]", recording.partition("/")[2])

    def counts(self, text):
        self.wait("return document.getElementById('count').textContent === arguments[0]", text)

    def state(self):
        query = urlsplit(self.browser.driver.current_url).query
        return {key: values[0] for key, values in parse_qs(query).items()}


def at(page, query):
    """The address of a page with a state."""
    home, _, token = page.address.partition("#")
    return f"{home}?{query}#{token}"


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    paths = Paths(tmp_path_factory.mktemp("browse"))
    declare(paths)
    make_features(paths, NAME)
    predict(paths)
    return paths


@pytest.fixture
def page(browser, project):
    browser.scripts(on=True)
    browser.medium()
    browser.window(1300)
    browser.complaints()
    browser.traffic()
    with browsing(View(project, NAME)) as address:
        page = Page(browser)
        page.address = address
        yield page.open(address)
        browser.driver.get("about:blank")


def test_the_page_shows_recordings_and_the_first_one(page):
    page.shows("s1/r00000")
    assert page.text("title") == f"Tones {HOSTILE}"
    assert page.rows()[2] == ["r00002", "low", HOSTILE]
    assert page.text("count") == f"{COUNT} recordings"
    for name in ("waveform", "spectrogram", "spectrum", "difference", "scatter"):
        assert page.browser.run(DRAWN, name) > 3, name
    assert "mean of low (others)" in page.text("lines")
    assert f"mean of {HOSTILE}, the nearest other class" in page.text("lines")


def test_hostile_names_are_texts(page):
    page.keys("j", "?")
    assert page.browser.run("return document.querySelectorAll('img').length") == 0
    assert HOSTILE in page.text("notes") and HOSTILE in page.text("labels")


def test_keys_select_and_filter(page):
    page.keys("j", "j")
    page.shows("s1/r00002")
    assert page.text("summary").startswith(f"label low, predicted ✗ {HOSTILE} (90 %)")
    page.keys("k")
    page.shows("s1/r00001")
    page.keys("w")
    page.counts(f"2 of {COUNT} recordings")
    page.keys("j")
    page.shows("s1/r00002")
    page.keys("/", "confidence<0.7", ENTER)
    page.counts(f"1 of {COUNT} recordings")  # the key selects the filter, so it is replaced
    assert page.state()["filter"] == "confidence<0.7"


def test_the_address_is_the_state(page):
    address = at(page, "filter=wrong%3Dyes&sort=-confidence&recording=s1/r00004")
    page.open(address)
    page.shows("s1/r00004")
    assert [row[0] for row in page.rows()] == ["r00002", "r00004"]
    page.browser.run("document.querySelector('[data-column=confidence]').click()")
    page.wait(f"{FIRST} === 'r00004'")
    assert page.state() == {"filter": "wrong=yes", "sort": "confidence", "recording": "s1/r00004"}


def test_a_wrong_filter_is_one_line_and_the_table_stays(page):
    page.keys("/", "labl=low")
    page.wait("return !document.getElementById('problem').hidden")
    assert page.text("problem").startswith("there is no column 'labl'; use one of ")
    assert len(page.rows()) == COUNT
    assert page.browser.run("return document.getElementById('filter').ariaInvalid") == "true"


def test_space_plays_and_pauses(page):
    page.keys(" ")
    page.wait("return document.getElementById('audio').currentTime > 0")
    assert page.browser.run("return document.getElementById('audio').error") is None
    page.wait("return document.getElementById('audio').ended")


def test_a_box_of_the_map_filters(page):
    from selenium.webdriver.common.action_chains import ActionChains

    canvas = page.browser.driver.find_element("id", "scatter")
    half = canvas.size["width"] // 2
    actions = ActionChains(page.browser.driver)
    actions.move_to_element_with_offset(canvas, 1 - half, 1 - canvas.size["height"] // 2)
    actions.click_and_hold().move_by_offset(half, canvas.size["height"] - 4).release().perform()
    # The classes are on both sides of the middle.
    page.counts(f"{COUNT // 2} of {COUNT} recordings")
    assert {row[1] for row in page.rows()} in ({"low"}, {HOSTILE})


def test_only_visible_rows_are_in_the_page(browser, tmp_path):
    paths = Paths(tmp_path)
    declare(paths, SCROLLED)
    with browsing(View(paths, NAME)) as address:
        page = Page(browser).open(address)
        assert page.text("count") == f"{SCROLLED:,} recordings"
        assert len(page.rows()) < 100
        page.keys(END)
        page.shows(f"s1/r{SCROLLED - 1:05}")
        assert page.rows()[-1][0] == f"r{SCROLLED - 1:05}"
        assert "no such file" in page.text("no-sound")
        browser.driver.get("about:blank")


@pytest.fixture
def own_project(project, tmp_path):
    """A copy of the project that a test may change."""
    copy = tmp_path / "copy"
    shutil.copytree(project.root, copy)
    return Paths(copy)


def test_keys_decide_and_a_second_page_sees_it(browser, own_project):
    with browsing(View(own_project, NAME), filter="wrong=yes") as address:
        page = Page(browser).open(address)
        page.shows("s1/r00002")
        page.keys("l", HOSTILE, "\ue004", "misread", ENTER)
        page.wait("return document.getElementById('count').textContent.startsWith('1 of')")
        page.shows("s1/r00004")  # the corrected recording is right now, so the next one is selected
        saved = "document.getElementById('decided').textContent"
        page.wait(f"return {saved}.startsWith('saved: r00002, label by ')")
        page.keys("r", "door slammed", ENTER)
        page.wait(f"return {saved}.startsWith('saved: r00004, reject by ')")
        page.keys("n", "heard <twice>", ENTER)
        page.wait("return document.getElementById('history').children.length === 3")
        assert "heard <twice>" in page.text("history")
        # Another page of the same data set decides; this page shows it instead of overwriting it.
        View(own_project, NAME).change("s1/r00004", "undo")
        page.keys("u")
        page.wait("return !document.getElementById('problem').hidden")
        assert page.text("problem").startswith("The decision was not saved: ")
        page.wait("return document.getElementById('history').textContent.includes('undo')")
        page.keys("u")
        page.wait("return !document.getElementById('summary').textContent.includes('quality')")
        assert page.state()["recording"] == "s1/r00004"
        browser.driver.get("about:blank")
    view = View(own_project, NAME)
    columns = view.columns("", "")
    assert [columns[name].cell(2) for name in ("label", "decision")] == [HOSTILE, "label"]
    assert [columns[name].cell(4) for name in ("quality", "decision", "notes")] == ["ok", "", ""]


def decisions(paths):
    """The decisions of all recordings that have one, by name."""
    columns = View(paths, NAME).columns("", "")
    names = columns["recording"].texts
    pairs = zip(names, columns["decision"].texts, strict=True)
    return {name: decision for name, decision in pairs if decision}


# Answers about a recording come late.
SLOW = """
const original = window.fetch;
window.fetch = async (...given) => {
  if (String(given[0]).startsWith("recording")) await new Promise(done => setTimeout(done, 600));
  return original(...given);
};
"""
DISABLED = "return document.querySelector('[data-action=ok]').disabled"


def test_a_key_decides_only_about_the_shown_recording(browser, own_project):
    with browsing(View(own_project, NAME)) as address:
        page = Page(browser).open(address)
        page.shows("s1/r00000")
        page.browser.run(SLOW)
        page.keys("j", "o")
        assert page.browser.run(DISABLED)
        page.shows("s1/r00001")
        assert decisions(own_project) == {}
        page.wait(f"{DISABLED} === false")
        page.keys("o")
        page.wait("return document.getElementById('decided').textContent")
        assert decisions(own_project) == {"s1/r00001": "ok"}
        browser.driver.get("about:blank")


def test_a_review_continues_at_the_place_of_the_decided_recording(browser, own_project):
    with browsing(View(own_project, NAME), sort="-suspicion") as address:
        page = Page(browser).open(address)
        page.shows("s1/r00002")
        following = [f"s1/{row[0]}" for row in page.rows()[1:4]]
        page.keys("o")
        page.shows(following[0])
        page.wait("return document.getElementById('decided').textContent")
        page.keys("j", "k")
        page.shows(following[0])
        page.wait(f"{DISABLED} === false")
        page.keys("r", "noise", ENTER)
        page.shows(following[1])
        assert decisions(own_project) == {"s1/r00002": "ok", following[0]: "reject"}
        browser.driver.get("about:blank")


def test_escape_leaves_the_form_and_changes_nothing(page):
    page.keys("r")
    page.wait("return document.activeElement.id === 'reason'")
    page.keys("x", ESCAPE)
    assert page.browser.run("return document.activeElement.id") == "scroll"
    page.keys("j")
    page.shows("s1/r00001")
    assert page.text("history") == ""


def test_without_the_token_nothing_can_be_decided(page):
    page.open(page.address.partition("#")[0])
    page.keys("o")
    assert page.text("decided") == ""
    assert page.text("read-only").startswith("To decide, open the complete address")


def test_the_most_suspicious_recordings_are_first(page):
    page.keys("s")
    page.wait(f"{FIRST} === 'r00002'")
    page.shows("s1/r00002")
    assert "suspicious" in page.text("reasons")
    assert page.state()["sort"] == "-suspicion"


@pytest.mark.parametrize("width", [360, 800, 1300])
def test_the_page_is_not_wider_than_the_window(page, width):
    page.browser.window(width)
    page.open(page.address)
    wide = page.browser.run("return document.documentElement.scrollWidth")
    assert wide <= width, page.browser.run(BEYOND)
    page.keys("j")
    page.shows("s1/r00001")


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("width", [800, 1300])
def test_axe_finds_nothing(page, axe, width, dark):
    page.browser.window(width)
    page.browser.medium(dark=dark)
    page.open(at(page, "filter=wrong%3Dyes"))
    page.browser.run(axe)
    assert_none(page.browser.driver.execute_async_script(AXE, CONTRAST if dark else RULES))


def test_nothing_is_requested_from_elsewhere(page):
    page.keys("j", " ", "?")
    time.sleep(0.3)
    requested, failed = page.browser.traffic()
    home = page.address.partition("#")[0]
    foreign = [url for url in requested if not url.startswith((home, "about:"))]
    assert foreign == []
    assert [text for text in failed if "ABORTED" not in text] == []
    assert page.browser.complaints() == []
