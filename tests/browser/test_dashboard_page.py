"""The page of a run as a browser shows it: what it says, its buttons and keys, at four widths."""

import os
import time
from pathlib import Path

import pytest
from live_events import CLASSES, Story, read_events, run
from test_pages import AXE, BEYOND, RULES, WIDTHS, assert_none

from ajgdata.live.dashboard import dashboard
from ajgdata.live.steps import Control
from ajgdata.store.files import write_if_changed
from tools.screenshots import IMAGES, small

pytestmark = pytest.mark.browser

ROOT = Path(__file__).resolve().parents[2]
#: A run of `ajgdata sort` with the virtual gripper.
LOG = ROOT / "docs/examples/sorting.jsonl"
#: Set it to write the pictures of it into docs/images.
WRITE = "AJGDATA_SCREENSHOTS"
#: Width and height in CSS pixels, and how many of the picture's one of them takes.
SHOTS = {"dashboard": (1300, 760, 1.0), "dashboard-phone": (360, 760, 1.0)}
COLOURS = 64
TEXTS = """
return Object.fromEntries([...document.querySelectorAll('[id]')]
  .filter(e => e.checkVisibility()).map(e => [e.id, e.textContent.replace(/\\s+/g, ' ').trim()]))
"""
BARS = """
return [...document.querySelectorAll('#bars li')].map(row => {
  const track = row.querySelector('.track').getBoundingClientRect();
  const fill = row.querySelector('i').getBoundingClientRect();
  return {name: row.dataset.class, told: row.querySelector('.percent').textContent,
          share: fill.width / track.width, best: row.classList.contains('best'),
          enough: row.classList.contains('enough')}})
"""
THRESHOLD = """
const track = document.querySelector('#bars .track');
const line = getComputedStyle(track, '::after');
return parseFloat(line.left) / track.clientWidth
"""
DRAWN = "return document.querySelector('main').innerText"


class Shown:
    """A run on a page: `tell` waits until it is shown."""

    def __init__(self, browser, served, control):
        self.browser = browser
        self.served = served
        self.control = control
        self.n = -1

    def open(self, *, watching=False):
        self.browser.open(self.served.watching if watching else self.served.address)
        self.wait("return document.body.dataset.mode !== ''")
        return self

    def tell(self, events):
        for event in events:
            self.served.feed.tell(event)
            self.n = event["n"]
        self.wait(f"return Number(document.body.dataset.n) === {self.n}")
        return self

    def wait(self, script, seconds=10.0):
        end = time.monotonic() + seconds
        while not (value := self.browser.run(script)):
            assert time.monotonic() < end, f"never came true: {script}"
            time.sleep(0.01)
        return value

    def texts(self):
        return self.browser.run(TEXTS)

    def key(self, key):
        from selenium.webdriver.common.action_chains import ActionChains

        ActionChains(self.browser.driver).send_keys(key).perform()

    def focused(self):
        return self.browser.run(
            "return document.activeElement.id || document.activeElement.tagName"
        )


@pytest.fixture
def control():
    return Control()


@pytest.fixture
def shown(browser, control):
    browser.scripts(on=True)
    browser.medium()
    browser.window(1300)
    browser.complaints()
    browser.traffic()

    with dashboard(control) as served:
        yield Shown(browser, served, control).open()
        browser.driver.get("about:blank")


def grasp(probability, verdict="known", **decision):
    story = Story().start().say("grasp", number=1, object="").hear(probability, verdict=verdict)
    if decision:
        story.say("decision", reason="", **decision)
    return story.events


SURE = {"marker": 0.1, "padlock": 0.05, "screw": 0.75, "strawberry": 0.1}
DOUBT = {"marker": 0.45, "padlock": 0.3, "screw": 0.15, "strawberry": 0.1}


def test_probabilities_and_threshold_stand_on_the_page(shown):
    shown.tell(grasp(SURE, action="place", value="screw", bin="B"))
    bars = shown.browser.run(BARS)
    assert [bar["name"] for bar in bars] == CLASSES
    assert [bar["told"] for bar in bars] == ["10 %", "5 %", "✓ 75 %", "10 %"]
    # Half a pixel of a track of some 500.
    assert [bar["share"] for bar in bars] == pytest.approx(list(SURE.values()), abs=2e-3)
    assert shown.browser.run(THRESHOLD) == pytest.approx(0.6, abs=2e-3)
    assert [(bar["best"], bar["enough"]) for bar in bars] == [
        (False, False),
        (False, False),
        (True, True),
        (False, False),
    ]
    texts = shown.texts()
    assert (texts["verdict-title"], texts["more"]) == ("screw", "75 % sure → bin B")
    assert texts["title"] == "ycb/sorting" and texts["source"] == "simulated"


def test_an_object_is_not_called_known_if_most_novel_objects_are_missed(shown):
    shown.tell(grasp(SURE, verdict="no sign", action="place", value="screw", bin="B"))
    texts = shown.texts()
    assert (texts["verdict-title"], texts["more"]) == (
        "screw",
        "75 % sure · no sign of a novel object (the detection rate of this check is not measured)"
        " → bin B",
    )
    assert shown.browser.run(BARS)[2]["enough"]


def test_grasps_bins_and_truth_are_counted(shown):
    events = run()
    shown.tell(events)
    state = shown.served.feed.state
    tiles = "return [...document.querySelectorAll('#grasps div')].map(b => b.ariaLabel)"
    labels = shown.browser.run(tiles)
    assert len(labels) == 12
    assert labels[0] == "Grasp 1: padlock 90 %, right"
    assert labels[2] == "Grasp 3: strawberry 90 %, sorted, truth unknown"
    assert labels[4] == "Grasp 5: screw 90 %, wrong, it was padlock"
    assert labels[11] == "Grasp 12: marker 90 %, in the gripper"
    bins = """return [...document.querySelectorAll('#bins li')].map(
      row => [row.dataset.bin, row.lastChild.innerText])"""
    assert dict(shown.browser.run(bins)) == {k: str(v) for k, v in state.bins.items()}
    texts = shown.texts()
    assert texts["mistakes"] == "2"
    assert (texts["row"], texts["longest"], texts["sorts"]) == ("1", "4", "11")


def test_the_button_stops_the_run(shown, control):
    from selenium.webdriver.common.by import By

    shown.tell(run())
    stop = shown.browser.driver.find_element(By.ID, "halt")
    stop.click()
    shown.wait("return document.body.dataset.mode === 'stopped'")
    assert control.stopped
    assert not stop.is_enabled()


def test_escape_stops_the_run(shown, control):
    from selenium.webdriver.common.keys import Keys

    shown.tell(run())
    assert "Esc" in shown.texts()["halt"]
    shown.key(Keys.TAB)
    assert shown.focused() == "halt"
    outline = "return getComputedStyle(document.activeElement).outlineStyle"
    assert shown.browser.run(outline) == "solid"
    shown.key(Keys.ESCAPE)
    shown.wait("return document.body.dataset.mode === 'stopped'")
    assert control.stopped


def test_without_the_token_one_watches(shown, control):
    shown.open(watching=True)
    shown.tell(run())
    texts = shown.texts()
    assert texts["notice"].startswith("Watching only")
    enabled = "return [...document.querySelectorAll('.controls button')].filter(b => !b.disabled)"
    assert shown.browser.run(enabled) == []
    from selenium.webdriver.common.keys import Keys

    shown.key(Keys.ESCAPE)
    shown.tell([{**run()[-1], "n": 1000, "event": "step", "step": "lift"}])
    assert not control.stopped


def test_a_lost_connection_is_said_and_comes_back(browser, control):
    browser.window(1300)
    with dashboard(control) as served:
        port = int(served.watching.rsplit(":", 1)[1].strip("/"))
        page = Shown(browser, served, control).open().tell(run())
    page.wait("return document.body.dataset.connection === 'lost'")
    texts = page.texts()
    assert texts["connection"] == "connection lost" and "Ctrl-C" in texts["notice"]
    with dashboard(control, port=port) as again:
        page.served = again
        for event in run():
            again.feed.tell(event)
        page.wait("return document.body.dataset.connection === 'live'", seconds=20)
        assert "notice" not in page.texts()
        again.feed.tell({**run()[-1], "event": "stopped", "reason": "done", "held": ""})
    page.wait("return document.body.dataset.connection === 'ended'")
    assert page.texts()["connection"] == "the run has ended"
    browser.driver.get("about:blank")
    browser.complaints()


def test_names_are_text_wherever_they_stand(shown):
    evil = "<img src=x onerror=document.title='evil'>"
    classes = [evil, "screw"]
    story = Story().start(dataset=evil, classes=classes, bins={evil: evil, "screw": "B"})
    story.say("grasp", number=1, object=evil)
    probability = {evil: 0.9, "screw": 0.1}
    story.hear(probability)
    story.say("decision", action="place", value=evil, bin=evil, reason=evil)
    story.say("placed", value=evil, bin=evil, object=evil).say("problem", text=evil)
    story.say("drift", text=evil)
    story.say("stopped", reason=evil, held=evil, sorts=1, seconds=1.0)
    shown.tell(story.events)
    assert shown.browser.run("return document.images.length") == 0
    assert shown.browser.run("return document.title") != "evil"
    assert evil in shown.browser.run(DRAWN)


def test_nothing_is_asked_of_elsewhere_and_the_console_is_silent(shown):
    shown.tell(run())
    shown.open()
    addresses, failed = shown.browser.traffic()
    assert any(address.endswith("/events") for address in addresses)
    foreign = [a for a in addresses if not a.startswith((shown.served.watching, "about:"))]
    assert (foreign, failed, shown.browser.complaints()) == ([], [], [])
    blocked = """
    const done = arguments[0];
    fetch('http://127.0.0.1:9/').then(() => done('sent'), () => done('refused'))
    """
    assert shown.browser.driver.execute_async_script(blocked) == "refused"
    complaints = " ".join(shown.browser.complaints())
    assert "Content Security Policy" in complaints and "connect-src" in complaints


@pytest.mark.parametrize("many", [False, True], ids=["four", "forty"])
@pytest.mark.parametrize("width", [min(WIDTHS), max(WIDTHS)])
def test_the_page_is_never_wider_than_the_window(shown, width, many):
    events = run()
    if many:
        classes = [f"class_number_{i:02d}_with_a_long_name" for i in range(40)]
        story = Story().start(classes=classes, bins=dict.fromkeys(classes, "A" * 60))
        for number, name in enumerate(classes, start=1):
            story.say("grasp", number=number, object=name).hear(dict.fromkeys(classes, 0.025))
            story.say("placed", value=name, bin="A" * 60, object=classes[-number])
        events = story.say("problem", text="x" * 300).events
    shown.browser.window(width)
    shown.tell(events)
    wide = shown.browser.run("return document.documentElement.scrollWidth")
    assert (wide, shown.browser.run(BEYOND)) == (width, [])


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("width", [360, 1300])
def test_axe_finds_nothing(shown, axe, width, dark):
    shown.browser.window(width)
    shown.browser.medium(dark=dark)
    wrong = {}
    stopped = Story().start().say("problem", text="a cable").say("drift", text="colder")
    stopped.say("stopped", reason="done", held="screw", sorts=0, seconds=1.0)
    states = {
        "running": run(),
        "in doubt": grasp(DOUBT),
        "unknown": grasp(SURE, verdict="unknown"),
        "stopped": stopped.events,
    }
    for name, events in states.items():
        shown.tell(events)
        shown.browser.run(axe)
        wrong[name] = shown.browser.driver.execute_async_script(AXE, RULES)
    assert_none(wrong)


@pytest.mark.parametrize("name", SHOTS)
def test_pictures_of_a_run_for_the_docs(shown, name):
    """Of a sort near its end, when it is decided: the same bytes each time."""
    events = read_events(LOG)
    decided = [n for n, event in enumerate(events) if event["event"] == "decision"]
    width, height, scale = SHOTS[name]
    shown.browser.window(width, height, scale=scale)
    shown.open()
    shown.tell(events[: decided[-5] + 1])
    shown.browser.driver.execute_async_script(
        "requestAnimationFrame(() => setTimeout(arguments[0]))"
    )
    picture = small(shown.browser.picture(), COLOURS)
    texts = shown.texts()
    assert texts["source"] == "simulated" and texts["mark"] == "✓"
    if WRITE in os.environ:
        write_if_changed(IMAGES / f"{name}.png", picture)
