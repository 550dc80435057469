"""The page: self-contained, escaped, honest about sources, and the same each time."""

import dataclasses
import itertools
import re

import pytest
from html_page import Page
from jinja2 import UndefinedError
from report_samples import PAPER, SCRIPT, dataset, row, sample_report, sections

from ajgdata.report.comparison import LOWER, Cost, PaperComparison
from ajgdata.report.format import DASH
from ajgdata.report.page import MAX_FINDINGS, illustrations, paper_cells, render_page
from ajgdata.report.render import picture, setting
from ajgdata.report.report_data import Report, Skipped
from ajgdata.types import Finding


def figures(report: Report):
    listed = [
        picture(one, f"<svg>{one.name}</svg>".encode(), "figures") for one in illustrations(report)
    ]
    return {one.name: one for one in listed}


def render(report: Report, *more) -> str:
    return render_page(report, figures(report), *more)


@pytest.fixture(scope="module")
def html():
    return render(sample_report())


def test_labels_are_escaped(html):
    assert SCRIPT not in html and "<b>granite" not in html
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in html
    assert SCRIPT in " ".join(Page(html).words)


def test_published_data_sets_are_linked_and_others_are_not(html):
    report = sample_report()
    name = report.datasets[0].name
    linked = render(report, (), [name])
    assert f'href="../published/{name}/README.md"' in linked
    assert "../published/" not in html


def test_nothing_is_fetched(html):
    page = Page(html)
    for tag, attributes in page.tags:
        assert tag not in {"script", "link", "iframe", "object", "embed", "base", "source"}
        assert not any(name.startswith("on") for name in attributes)
        if "src" in attributes:
            assert attributes["src"].startswith("data:image/svg+xml;base64,")
        assert "srcset" not in attributes
    assert not re.search(r"@import|url\(|@font-face", html)
    policy = next(m["content"] for m in page.all("meta") if "http-equiv" in m)
    assert policy == "default-src 'none'; img-src data:; style-src 'unsafe-inline'"


def test_links_stay_on_the_page_or_beside_it(html):
    page = Page(html)
    ids = {a["id"] for _, a in page.tags if "id" in a}
    links = [a["href"] for a in page.all("a")]
    assert {link[1:] for link in links if link.startswith("#")} <= ids
    files = {link for link in links if not link.startswith("#")}
    names = [one.name for one in illustrations(sample_report())]
    expected = {f"figures/{name}.{suffix}" for name in names for suffix in ("svg", "png", "pdf")}
    assert files == expected | {"../quarantine/stones.csv"}


def test_only_web_addresses_become_links():
    for url, linked in (("https://example.org/a?b=1&c", True), ("javascript:alert(1)", False)):
        report = Report("t", "1", "c", (dataset("size", "simulated", url=url),))
        assert (url in [a["href"] for a in Page(render(report)).all("a")]) == linked


def test_each_task_says_simulated_or_recorded_and_stands_beside_the_paper(html):
    page = Page(html)
    assert page.row(["Cube size · edge"])[-1] == "simulated"
    assert page.row([f"{SCRIPT} · kind"])[-1] == "recorded"
    assert page.row(["CNN", "RMSE"]) == [
        "CNN", "RMSE", "2.20 ± 0.30 mm", "8.2 mm", "3.2", "0.21", "512",
        "RMSE 2.6 mm overall", "cubes; arXiv 2603.00351",
    ]  # fmt: skip
    assert page.row(["k-NN", "RMSE"]) == [
        "k-NN", "RMSE", "4.00 ± 0.40 mm", "8.2 mm", "3.2", "0.21", "512",
    ]  # fmt: skip
    assert "Simulated is not recorded." in page.words


def test_a_missing_paper_figure_is_a_dash(html):
    assert Page(html).row(["CNN", "accuracy"])[-1] == "—"


def test_a_shared_paper_figure_is_written_once():
    shared = [row("CNN", "1", paper=PAPER), row("k-NN", "2", paper=PAPER)]
    assert paper_cells(shared) == [
        ("RMSE 2.6 mm overall", "cubes; arXiv 2603.00351", 2),
        ("", "", 0),
    ]
    mixed = [*shared, row("SVM", "3"), row("CNN", "4", part="withheld", paper=PAPER)]
    assert [cell[2] for cell in paper_cells(mixed)] == [2, 0, 1, 1]
    assert paper_cells(mixed)[2][0] == DASH


def test_the_lowest_error_is_bold_and_shown_first(html):
    assert re.findall(r"<strong>(\d.*?)</strong>", html) == ["2.20 ± 0.30 mm", "70.0 ± 5.0 %"]
    cnn, knn = (html.index(f'<figure id="size--{m}"') for m in ("cnn", "knn"))
    assert cnn < knn < html.index("<summary>k-NN: RMSE 4.00</summary>")


def test_rows_of_a_part_stand_below_its_heading(html):
    heading = html.index("edge, values withheld from training")
    assert html.index("4.00 ± 0.40 mm") < heading < html.index("3.50 ± 0.40 mm")
    assert html.count("values withheld from training") == 1


def test_words_and_tables_of_an_experiment_are_on_the_page(html):
    page = Page(html)
    assert "Regression of edge_mm." in page.words
    assert page.row(["15", "3"]) == ["15", "3"]
    assert page.row([SCRIPT, "—"]) == [SCRIPT, "—"]
    assert "<em>escaped</em>" in html and "<summary>Fold by fold</summary>" in html


def test_results_stand_beside_the_papers_with_their_cost():
    found = PaperComparison(
        PAPER, "size", "edge", "simulated", "0.7 ± 0.1 mm", "CNN", LOWER, Cost(7.6, 0.9)
    )
    other = PAPER.model_copy(update={"id": "x", "where": "angles"})
    report = dataclasses.replace(sample_report(), comparisons=(found,), paper=(PAPER, other))
    page = Page(render(report))
    cells = page.row(["cubes", "RMSE 2.6 mm overall"])
    assert cells[-5:] == ["CNN", "7.6", "0.9", LOWER, "Not looked for."]
    assert any("and this page does not: angles." in words for words in page.words)
    assert "#task-size-edge" in [a["href"] for a in page.all("a")]


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"dataset": "nope"}, "the report has no data set nope"),
        ({"source": "recorded"}, "recorded, but its data set is not"),
        ({"dataset": "stones", "source": "recorded", "task": "kind"}, "occurs twice"),
    ],
)
def test_a_section_that_fits_no_data_set_is_refused(changes, says):
    first, second = sections()
    with pytest.raises(ValueError, match=says):
        dataclasses.replace(
            sample_report(), sections=(dataclasses.replace(first, **changes), second)
        )


def test_two_data_sets_of_one_name_are_refused():
    with pytest.raises(ValueError, match="share a name"):
        Report("t", "1", "c", (dataset("size", "simulated"),) * 2)


def test_quarantine(html):
    page = Page(html)
    assert page.words.count("Nothing was quarantined.") == 1
    assert page.row(["s1 / r7"])[1:3] == ["error", f"{SCRIPT} ("]
    assert any("1 left out, 1 flagged but used." in words for words in page.words)


def test_a_long_quarantine_is_cut_and_says_so():
    rows = tuple(
        Finding("s1", f"r{i}", "f.wav", "error", "silent", "is silent", "repeat it")
        for i in range(MAX_FINDINGS + 1)
    )
    html = render(Report("t", "1", "c", (dataset("size", "simulated", findings=rows),)))
    assert f"s1 / r{MAX_FINDINGS - 1}<" in html and f"s1 / r{MAX_FINDINGS}<" not in html
    assert f"its first {MAX_FINDINGS} rows are here" in html


def test_headings_tables_and_images_are_accessible(html):
    page = Page(html)
    levels = [int(tag[1]) for tag, _ in page.tags if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1 and levels.count(1) == 1
    assert all(b - a <= 1 for a, b in itertools.pairwise(levels))
    assert all(a.get("scope") in {"row", "col", "rowgroup"} for a in page.all("th"))
    assert all(len(a["alt"]) > 40 for a in page.all("img"))
    assert len(page.all("img")) == len(list(illustrations(sample_report())))
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


def test_settings_and_provenance_are_shown(html):
    page = Page(html)
    assert page.row(["Cube size", "2,048"]) == [
        "Cube size", "2,048", "512", "hann", "magnitude", "l1", "100 to 18,000", "no",
    ]  # fmt: skip
    assert page.row(["Cube size", "0.1.0"])[1:] == ["0.1.0", "abc1234", "c0ffee", "f00d"]
    assert "grid spacing (mm)" in page.words


def test_what_was_not_evaluated_is_said_with_its_reason():
    skipped = Skipped("size", "edge", "CNN", "4 groups for 5 folds")
    html = render(dataclasses.replace(sample_report(), skipped=(skipped,)))
    assert "<li>size · edge · CNN: 4 groups for 5 folds</li>" in html


def test_recorded_data_alone_need_no_warning_about_simulation():
    report = Report("t", "1", "c", (dataset("stones", "recorded"),), sections()[1:])
    html = render(report)
    assert "Simulated is not recorded" not in html and 'class="badge simulated"' not in html


def test_an_empty_report_is_a_page():
    html = render(Report("Nothing yet", "1", "c", ()))
    assert html.count("No task has been evaluated.") == 1
    Page(html)


def test_the_same_report_gives_the_same_page(html):
    assert render(sample_report()) == html


def test_figures_must_be_there():
    with pytest.raises(UndefinedError, match="random-against-grouped"):
        render_page(sample_report(), {})
