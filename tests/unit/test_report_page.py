"""The page: self-contained, escaped, honest about sources, and the same each time."""

import dataclasses
import itertools
import posixpath
import re
from pathlib import PurePosixPath

import pytest
from html_page import Page
from jinja2 import UndefinedError
from report_samples import PAPER, SCRIPT, sample_report

from ajgdata.report.comparison import Cost, PaperComparison, mark_of
from ajgdata.report.format import DASH, Score
from ajgdata.report.navigation import Link, navigation
from ajgdata.report.page import illustrations, render_pages
from ajgdata.report.render import picture, setting
from ajgdata.report.report_data import Report
from ajgdata.report.skill import skill_figure

NAV = navigation([Link("experiments/size.html", "How large?", "Paper's")], ["accuracy"], [])


def render(report: Report, *more) -> dict[str, str]:
    figures = {one.name: picture(one, "figures") for one in illustrations(report)}
    return render_pages(report, figures, NAV, *more)


@pytest.fixture(scope="module")
def pages():
    return render(sample_report())


@pytest.fixture(scope="module")
def html(pages):
    return "".join(pages.values())


@pytest.fixture(scope="module")
def results(pages):
    return Page(pages["results.html"])


def test_labels_are_escaped(html):
    assert SCRIPT not in html and "<b>granite" not in html
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in html
    assert SCRIPT in " ".join(Page(html).words)


def test_each_experiment_has_a_page_and_all_pages_have_the_navigation(pages):
    fixed = {f"{name}.html" for name in ("index", "paper", "results", "datasets", "run")}
    assert set(pages) == fixed | {"experiments/size.html", "experiments/stones.html"}
    for name, html in pages.items():
        root = "../" * name.count("/")
        links = [a["href"] for a in Page(html).all("a")]
        assert [f"{root}{link.link}" for group in NAV for link in group.links] == links[1:8]
        here = [a["href"] for a in Page(html).all("a") if "aria-current" in a]
        assert here == ([f"{root}{name}"] if name != "experiments/stones.html" else [])
    size = Page(pages["experiments/size.html"])
    assert "How large is it?" in size.words and "snakemake report_size" in size.words
    assert Page(pages["experiments/stones.html"]).all("img") == []


def test_nothing_is_fetched(html):
    page = Page(html)
    for tag, attributes in page.tags:
        assert tag not in {"script", "link", "iframe", "object", "embed", "base", "source"}
        assert not any(name.startswith("on") for name in attributes)
        if "src" in attributes:
            assert re.fullmatch(r"(\.\./)?figures/[a-z-]+\.svg", attributes["src"])
        assert "srcset" not in attributes
    assert not re.search(r"@import|url\(|@font-face", html)
    for policy in (m["content"] for m in page.all("meta") if "http-equiv" in m):
        assert policy == (
            "default-src 'none'; img-src 'self' file: data:; media-src 'self' file: data:; "
            "style-src 'unsafe-inline'"
        )


def test_links_stay_in_the_report_and_the_results(pages):
    drawn = [one.name for one in illustrations(sample_report())]
    files = {f"figures/{name}.{suffix}" for name in drawn for suffix in ("svg", "png", "pdf")}
    ids = {name: {a["id"] for _, a in Page(html).tags if "id" in a} for name, html in pages.items()}
    found = set()
    for name, html in pages.items():
        for link in (a["href"] for a in Page(html).all("a")):
            path, _, anchor = link.partition("#")
            folder = PurePosixPath(name).parent
            there = posixpath.normpath(folder / path) if path else name
            assert not anchor or anchor in ids[there], link
            found.add(there)
    elsewhere = {"accuracy.html", "../quarantine/stones.csv", "tables/results.csv"}
    assert found == set(pages) | files | elsewhere


def test_each_task_says_simulated_or_recorded_and_stands_beside_the_paper(pages, results):
    page = results
    assert page.row(["Cube size · edge"])[-1] == "simulated"
    assert page.row([f"{SCRIPT} · kind"])[-1] == "recorded"
    assert page.row(["CNN", "RMSE"]) == [
        "CNN", "RMSE", "2.20 ± 0.30 mm", "8.2 mm", "3.2", "0.21", "512",
        "RMSE 2.6 mm overall", "cubes; arXiv 2603.00351",
    ]  # fmt: skip
    assert page.row(["k-NN", "RMSE"]) == [
        "k-NN", "RMSE", "4.00 ± 0.40 mm", "8.2 mm", "3.2", "0.21", "512",
    ]  # fmt: skip
    assert "Simulated is not recorded." in Page(pages["index.html"]).words


def test_the_lowest_error_is_bold_and_shown_first(pages):
    bold = re.findall(r"<strong>(\d.*?)</strong>", pages["results.html"])
    assert bold == ["2.20 ± 0.30 mm", "70.0 ± 5.0 %"]
    html = pages["experiments/size.html"]
    cnn, knn = (html.index(f'<figure id="size--{m}"') for m in ("cnn", "knn"))
    assert cnn < html.index("<summary>k-NN: RMSE 4.00</summary>") < knn


FOUND = PaperComparison(
    PAPER, "size", "edge", "simulated", "0.7 ± 0.1 mm", "CNN", "better", Cost(7.6, 0.9),
    marks=(
        mark_of("ours", "CNN", Score(0.7, 0.1)),
        mark_of("baseline", "k-NN", Score(0.9, 0.2)),
        mark_of("chance", "chance", Score(5.2, 0.0)),
    ),
    page="experiments/size.html",
)  # fmt: skip


def test_results_stand_beside_the_papers_with_their_cost():
    other = PAPER.model_copy(update={"id": "x", "where": "angles"})
    report = dataclasses.replace(sample_report(), comparisons=(FOUND,), paper=(PAPER, other))
    pages = render(report)
    page = Page(pages["paper.html"])
    cells = page.row(["cubes", "RMSE 2.6 mm overall"])
    assert cells[-5:] == ["CNN", "7.6", "0.9", "better", "Not looked for."]
    assert any("and this page does not: angles." in words for words in page.words)
    assert "experiments/size.html" in [a["href"] for a in page.all("a")]
    words = Page(pages["experiments/size.html"]).words
    assert "Paper: RMSE 2.6 mm overall. Ours" in words and ": 0.7 ± 0.1 mm." in words


def test_the_first_screen_has_a_figure_and_a_row_for_each_result():
    absent = PAPER.model_copy(update={"id": "x", "where": "angles", "text": "8°"})
    report = dataclasses.replace(sample_report(), comparisons=(FOUND,), paper=(PAPER, absent))
    html = render(report)["index.html"]
    page = Page(html)
    row = page.row(["cubes", "RMSE 2.6 mm overall"])
    assert row[-1] == "▲ better" and "0.7 ± 0.1 mm" in row[2]
    assert "experiments/size.html" in [a["href"] for a in page.all("a")]
    tally = html[html.index('class="tally"') : html.index("</ul>", html.index('class="tally"'))]
    counts = re.findall(r'<li class="([\w-]+)"><b>(\d)</b>', tally)
    assert counts == [("better", "1"), ("absent", "1")]


def test_skill_is_0_at_chance_and_1_without_error():
    """Chance 5.2 mm; ours 0.7 ± 0.1 mm, k-NN 0.9 ± 0.2 mm, the paper 2.6 mm."""
    picture = skill_figure([FOUND]).draw.args[1]
    found = {point.series: point.score for point in picture.points}
    assert found["ours"].mean == pytest.approx(1 - 0.7 / 5.2)
    assert (found["ours"].low, found["ours"].high) == pytest.approx((1 - 0.8 / 5.2, 1 - 0.6 / 5.2))
    assert found["best other model"].mean == pytest.approx(1 - 0.9 / 5.2)
    assert found["paper"].mean == pytest.approx(0.5)
    assert skill_figure([dataclasses.replace(FOUND, marks=())]) is None


def test_quarantine(pages):
    page = Page(pages["datasets.html"])
    assert page.words.count("Nothing was quarantined.") == 1
    assert page.row(["s1 / r7"])[1:3] == ["error", f"{SCRIPT} ("]
    assert any("1 left out, 1 flagged but used." in words for words in page.words)


def test_headings_tables_and_images_are_accessible(pages):
    for html in pages.values():
        page = Page(html)
        levels = [int(tag[1]) for tag, _ in page.tags if re.fullmatch("h[1-6]", tag)]
        assert levels[0] == 1 and levels.count(1) == 1
        assert all(b - a <= 1 for a, b in itertools.pairwise(levels))
        assert all(a.get("scope") in {"row", "col", "rowgroup"} for a in page.all("th"))
        assert all(len(a["alt"]) > 40 for a in page.all("img"))
        assert page.all("html") == [{"lang": "en"}]
        assert html.startswith("<!DOCTYPE html>")


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (True, "yes"), (None, DASH), ("", DASH), (44100, "44,100"), ("plastic", "plastic"),
        ([-35.0, 0.0], "-35; 0"), ((2, 3, 64), "2; 3; 64"),
        ({"mass_kg_m2": 0.3, "pinned": True}, "mass kg m2 0.3; pinned yes"),
        ({"a": {"within": "b_c", "n": None}, "d": {"n": None}}, "a (within b_c); d"),
    ],
)  # fmt: skip
def test_a_setting_is_written_as_people_do_and_a_place_is_no_range(value, said):
    assert setting(value) == said


def test_figures_must_be_there():
    with pytest.raises(UndefinedError, match="random-against-grouped"):
        render_pages(sample_report(), {})
