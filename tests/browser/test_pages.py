"""Every page of a report as a browser shows it: at four widths, dark and light, printed, offline.

A test goes through all pages and lists what is wrong, and where.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from io import BytesIO

import pytest

from tools.browser import served

pytestmark = pytest.mark.browser

WIDTHS = (360, 800, 1300, 1920)
#: What a page is held to: WCAG 2 A and AA, and what else axe holds to be good practice.
RULES = {
    "type": "tag",
    "values": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"],
}
CONTRAST = {"type": "rule", "values": ["color-contrast"]}
MAX_INDEX_BYTES = 1_000_000
MAX_SCREENS = 3
SCREEN_HEIGHT = 900
MAX_FIRST_FIGURE_PX = 700

#: As a press on a summary does, or on the button of a menu.
UNFOLD = """
for (const one of document.querySelectorAll('details')) one.open = true
for (const one of document.querySelectorAll('nav input[type=checkbox]')) one.checked = true
"""
#: Elements that end beyond the right edge, unless something that they are in scrolls.
BEYOND = """
const scrolls = e => e && e !== document.body &&
  (['auto', 'scroll', 'hidden', 'clip'].includes(getComputedStyle(e).overflowX) ||
   scrolls(e.parentElement));
return [...document.body.querySelectorAll('*')]
  .filter(e => e.getBoundingClientRect().right > innerWidth + 1 && !scrolls(e.parentElement))
  .slice(-1).map(e => e.outerHTML.slice(0, 120))
"""
#: Images that have a place and no width in it, once all have come.
UNSEEN = """
const all = [...document.images];
return Promise.all(all.map(e => { e.loading = 'eager'; return e.decode().catch(() => 0) }))
  .then(() => all.filter(e => e.getClientRects().length && e.getBoundingClientRect().width < 50)
    .map(e => e.outerHTML.slice(0, 120)))
"""
AXE = """
const done = arguments[arguments.length - 1];
axe.run({runOnly: arguments[0], resultTypes: ['violations']})
  .then(found => done(found.violations.map(one => one.id + ': ' + one.nodes[0].html.slice(0, 160) +
    ' ' + one.nodes[0].any.map(why => why.message).join(' ').slice(0, 160))))
"""
BROKEN = """
return [...document.images].filter(one => one.complete && !one.naturalWidth)
  .map(one => one.src.slice(0, 100))
"""
#: Headings within the first screen, which printing must not lose.
SAID = """
return [...document.querySelectorAll('main h1, main h2, main h3, header h1')]
  .filter(e => e.checkVisibility() && e.getBoundingClientRect().bottom <= arguments[0])
  .map(e => e.innerText)
"""


@pytest.fixture(autouse=True)
def plain(browser):
    """A window as it is at first."""
    browser.scripts(on=True)
    browser.medium()
    browser.window(1300)
    browser.complaints()
    browser.traffic()


def opened(browser, site) -> Iterator[str]:
    """Open each page of a site; its name."""
    for page in site.pages:
        browser.open(page.as_uri())
        yield site.name(page)


@pytest.mark.parametrize("width", WIDTHS)
def test_no_page_is_wider_than_the_window(browser, site, width):
    browser.window(width)
    wrong = {}
    for name in opened(browser, site):
        for state in ("folded", "unfolded"):
            wide = browser.run("return document.documentElement.scrollWidth")
            if wide > width:
                wrong[f"{name}, {state}"] = [f"{wide} px", *browser.run(BEYOND)]
            browser.run(UNFOLD)
    assert_none(wrong)


@pytest.mark.parametrize("width", WIDTHS)
def test_every_figure_is_seen(browser, site, width):
    """An image that is not folded away has the width of a picture, not of a line."""
    browser.window(width)
    assert_none({name: browser.run(UNSEEN) for name in opened(browser, site)})


def test_the_first_page_is_small_and_short(browser, site):
    assert site.index.stat().st_size <= MAX_INDEX_BYTES
    heights = {}
    for width in WIDTHS[1:]:
        browser.window(width, SCREEN_HEIGHT)
        browser.open(site.index.as_uri())
        heights[width] = browser.run("return document.documentElement.scrollHeight")
    limit = MAX_SCREENS * SCREEN_HEIGHT
    assert {width: high for width, high in heights.items() if high > limit} == {}


FIRST_FIGURE = """
const shown = [...document.querySelectorAll('main img, main .forest, header img')]
  .filter(e => e.checkVisibility());
return shown.length ? shown[0].getBoundingClientRect().top + scrollY : 0
"""
HIDDEN_VERDICTS = """
return [...document.querySelectorAll('td.verdict')].filter(
  e => e.checkVisibility() && e.getBoundingClientRect().right > innerWidth).length
"""


@pytest.mark.parametrize("width", WIDTHS)
def test_the_first_figure_and_the_verdicts_are_within_the_first_screen(browser, site, width):
    browser.window(width)
    wrong = {}
    for name in opened(browser, site):
        top = browser.run(FIRST_FIGURE)
        hidden = browser.run(HIDDEN_VERDICTS)
        problems = [f"first figure at {top:.0f} px"] * (top > MAX_FIRST_FIGURE_PX)
        problems += [f"{hidden} verdicts outside"] * (hidden > 0 and width >= 1300)
        wrong[name] = problems
    assert_none(wrong)


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("width", [360, 1300])
def test_axe_finds_nothing(browser, site, axe, width, dark):
    browser.window(width)
    browser.medium(dark=dark)
    wrong = {}
    for name in opened(browser, site):
        browser.run(UNFOLD)
        browser.run(axe)
        rules = CONTRAST if dark else RULES  # only colours change in the dark
        wrong[name] = browser.driver.execute_async_script(AXE, rules)
    assert_none(wrong)


@pytest.mark.parametrize("way", ["file", "http"])
def test_nothing_is_asked_of_elsewhere_and_all_that_is_asked_comes(browser, site, way):
    """From a folder and from a web server; and the console has nothing to say."""
    with served(site.folder) as address:
        home = f"{site.folder.as_uri()}/" if way == "file" else address
        allowed = "file:" if way == "file" else address
        wrong = {}
        for page in site.pages:
            browser.open(home + site.name(page))
            browser.run("for (const one of document.images) one.loading = 'eager'")
            broken = browser.run(BROKEN)
            requests, failed = browser.traffic()
            foreign = [url for url in requests if not url.startswith((allowed, "about:"))]
            messages = [*foreign, *failed, *broken, *browser.complaints()]
            wrong[site.name(page)] = [text for text in messages if "favicon.ico" not in text]
    assert_none(wrong)


def test_every_link_leads_somewhere(browser, site):
    assert_none(site.astray())


def test_in_print_the_first_page_says_what_came_out(browser, site):
    from pypdf import PdfReader

    browser.window(1300, SCREEN_HEIGHT)
    browser.open(site.index.as_uri())
    said = browser.run(SAID, SCREEN_HEIGHT)
    assert len(said) >= 2
    first = letters(PdfReader(BytesIO(browser.pdf())).pages[0].extract_text())
    assert_none(f"not on the first sheet: {text}" for text in said if letters(text) not in first)


def assert_none(wrong: Mapping[str, Iterable[object]] | Iterable[object]) -> None:
    """Fail with all that is wrong, one line each, and the pages on which it is."""
    where: dict[str, list[str]] = {}
    for page, messages in (wrong if isinstance(wrong, Mapping) else {"": wrong}).items():
        for message in messages:
            where.setdefault(str(message), []).append(page)
    text = "\n".join(f"{message}\n    {', '.join(pages)}" for message, pages in where.items())
    if text:
        pytest.fail(f"\n{text}", pytrace=False)


def letters(text: str) -> str:
    """Letters and digits alone: a PDF has no spaces, and a heading may be drawn in capitals."""
    return re.sub(r"\W", "", text).casefold()


#: The listed predictions of a task of classes: true and predicted class of each visible row.
LISTED = """
const task = document.querySelector('.matrix').closest('details');
const rows = [...task.querySelectorAll('.filtered tbody tr')].filter(row => !row.hidden);
return rows.map(row => [row.cells[1].innerText, row.cells[2].innerText.replace(' ✓', '')])
"""
SHOW_PAIR_OF_FIRST = """
const task = document.querySelector('.matrix').closest('details');
const pair = task.querySelector('.filtered tbody tr').dataset.pair;
task.querySelector(`.matrix a[href='#${pair}']`).click()
"""
SHOW_ALL = """
const task = document.querySelector('.matrix').closest('details');
task.querySelector('.filter button').click()
"""
FILTER = """
const task = document.querySelector('.matrix').closest('details');
const input = task.querySelector('.filter input');
input.value = arguments[0];
input.dispatchEvent(new Event('input'))
"""
SORT_BY_TRUE_CLASS = """
const task = document.querySelector('.matrix').closest('details');
task.querySelectorAll('.filtered .sort')[1].click()
"""


def test_a_number_of_the_matrix_shows_its_recordings_and_filters_and_columns_work(
    browser, measured
):
    page = next(
        page for page in measured.pages if 'class="matrix"' in page.read_text(encoding="utf-8")
    )
    browser.open(page.as_uri())
    browser.run(UNFOLD)
    complete = browser.run(LISTED)
    browser.run(SHOW_PAIR_OF_FIRST)
    shown = browser.run(LISTED)
    assert shown and all(row == complete[0] for row in shown)
    browser.run(SHOW_ALL)
    assert browser.run(LISTED) == complete
    browser.run(FILTER, "no such recording")
    assert browser.run(LISTED) == []
    browser.run(SHOW_ALL)
    for is_descending in (False, True):
        browser.run(SORT_BY_TRUE_CLASS)
        values = [row[0] for row in browser.run(LISTED)]
        assert values == sorted(values, reverse=is_descending)
    assert browser.complaints() == []
