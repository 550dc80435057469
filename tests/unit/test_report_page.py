"""The page: self-contained, escaped, honest about sources, and the same each time."""

import base64
import dataclasses
import hashlib
import posixpath
import re
from pathlib import Path, PurePosixPath

import pytest
from html_page import Page
from report_samples import PAPER, SCRIPT, dataset, illustration, sample_report

from ajgdata.paths import Paths
from ajgdata.pipeline.experiment_pages import COMPARISON, section_of
from ajgdata.report.comparison import Change, PaperComparison, Reason, ResultCost, mark_of
from ajgdata.report.forest import LINE_PX, paper_rows, place
from ajgdata.report.format import Score
from ajgdata.report.navigation import Link, link_from_report, navigation
from ajgdata.report.page import illustrations, render_pages
from ajgdata.report.render import drawn_figure
from ajgdata.report.report_data import Report
from ajgdata.store.report_files import read_page_text

PROJECT = Paths(Path(__file__).resolve().parents[2])
LISTED = [Link("experiments/size.html", "How large?", "Paper's")]


def render(report: Report, *more) -> dict[str, str]:
    figures = {figure.name: drawn_figure(figure, "figures") for figure in illustrations(report)}
    nav = navigation(LISTED, ["accuracy"], compares=bool(report.comparisons))
    return render_pages(report, figures, nav, *more)


@pytest.fixture(scope="module")
def pages():
    return render(sample_report())


@pytest.fixture(scope="module")
def html(pages):
    return "".join(pages.values())


def test_the_index_links_to_the_figure_of_error_against_run_time(pages):
    links = [a["href"] for a in Page(pages["index.html"]).all("a")]
    assert "experiments/size.html#size--run-time" in links


def test_labels_are_escaped(html):
    assert SCRIPT not in html and "<b>granite" not in html
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in html
    assert SCRIPT in " ".join(Page(html).words)


def test_nothing_is_fetched_and_only_the_script_of_the_report_runs(html):
    page = Page(html)
    for tag, attributes in page.tags:
        assert tag != "script" or not attributes
        assert tag not in {"link", "iframe", "object", "embed", "base", "source"}
        assert not any(name.startswith("on") for name in attributes)
        if "src" in attributes:
            assert re.fullmatch(r"(\.\./)?figures/[a-z-]+\.svg", attributes["src"])
        assert "srcset" not in attributes
    assert not re.search(r"@import|url\(|@font-face", html)
    (script,) = set(re.findall(r"<script>(.*?)</script>", html, re.DOTALL))
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    for policy in (m["content"] for m in page.all("meta") if "http-equiv" in m):
        assert policy == (
            "default-src 'none'; img-src 'self' file: data:; media-src 'self' file: data:; "
            f"style-src 'unsafe-inline'; script-src 'sha256-{digest}'"
        )


def test_links_stay_in_the_report_and_the_results(pages):
    drawn = [figure.name for figure in illustrations(sample_report())]
    files = {f"figures/{name}.{suffix}" for name in drawn for suffix in ("svg", "pdf")}
    ids = {name: {a["id"] for _, a in Page(html).tags if "id" in a} for name, html in pages.items()}
    targets = set()
    for name, html in pages.items():
        for link in (a["href"] for a in Page(html).all("a")):
            path, _, anchor = link.partition("#")
            folder = PurePosixPath(name).parent
            there = posixpath.normpath(folder / path) if path else name
            assert not anchor or anchor in ids[there], link
            targets.add(there)
    elsewhere = {"accuracy.html", "../quarantine/stones.csv"}
    elsewhere |= {"../metrics.csv", "../predictions.csv"}
    assert targets == set(pages) | files | elsewhere


def test_each_task_says_simulated_or_recorded_and_has_the_published_value(pages):
    page = Page(pages["experiments/size.html"])
    assert page.row(["Cube size · edge"])[-1] == "simulated"
    assert page.row(["CNN", "RMSE"]) == [
        "CNN",
        "RMSE",
        "2.20 ± 0.30 mm",
        "8.2 mm",
        "3.2",
        "0.21",
        "RMSE 2.6 mm overall",
        "cubes; arXiv 2603.00351",
    ]
    assert page.row(["k-NN", "RMSE"]) == [
        "k-NN",
        "RMSE",
        "4.00 ± 0.40 mm",
        "8.2 mm",
        "3.2",
        "0.21",
    ]
    page = Page(pages["experiments/stones.html"])
    assert page.row([f"{SCRIPT} · kind"])[-1] == "recorded"


COMPARED = PaperComparison(
    PAPER,
    "size",
    "edge",
    "simulated",
    "0.7 ± 0.1 mm",
    "CNN",
    "better",
    ResultCost(7.6, 0.9),
    marks=(
        mark_of("ours", Score(0.7, 0.1)),
        mark_of("baseline", Score(0.9, 0.2)),
        mark_of("chance", Score(5.2, 0.0)),
    ),
    page="experiments/size.html",
)


def test_results_are_compared_with_published_values_and_have_a_cost():
    other = PAPER.model_copy(update={"id": "x", "where": "angles"})
    report = dataclasses.replace(sample_report(), comparisons=(COMPARED,), paper=(PAPER, other))
    pages = render(report)
    page = Page(pages["paper.html"])
    cells = page.row(["cubes", "▲ better"])
    assert cells[2:4] == ["RMSE 2.6 mm overall", "arXiv 2603.00351"]
    assert cells[-4:] == ["simulated", "CNN", "7.6", "0.9"]  # no cause was tested: no column
    assert "Cause" not in pages["paper.html"]
    assert any("without a result in this report: angles." in words for words in page.words)
    own = Page(pages["experiments/size.html"])
    assert own.row(["cubes"])[1:] == ["2.6 mm", "0.7 mm (0.6 to 0.8)", "simulated", "▲ better"]


def test_a_page_prints_the_limits_of_its_comparison_with_the_paper():
    """The network was changed after its error in noise had been seen."""
    note = section_of(read_page_text(PROJECT, "noise"), COMPARISON)
    report = sample_report()
    size = dataclasses.replace(report.pages[0], comparison_note=note)
    compared = dataclasses.replace(report, comparisons=(COMPARED,), pages=(size, report.pages[1]))
    own = " ".join(Page(render(compared)["experiments/size.html"]).words)
    assert "This comparison is not blind." in own and "noise_per_bin" in own
    assert "not blind" not in render(compared)["experiments/stones.html"]


def test_the_first_page_counts_the_recordings_of_each_source():
    datasets = [
        dataset("a", "simulated", n_recordings=1000),
        dataset("b", "simulated", n_recordings=500),
        dataset("c", "recorded", n_recordings=20),
    ]
    report = dataclasses.replace(sample_report(), datasets=tuple(datasets))
    assert report.recordings_by_source == {"simulated": 1500, "recorded": 20}
    words = " ".join(Page(render(report)["index.html"]).words)
    assert "1,500 recordings" in words
    assert "20 recordings" in words


def test_the_first_page_has_one_row_per_result_and_the_same_count_as_the_page_of_the_paper():
    report = dataclasses.replace(sample_report(), comparisons=(COMPARED, COMPARED), answer=("So.",))
    pages = render(report)
    index = Page(pages["index.html"])
    assert index.row(["cubes"])[1:] == ["2.6 mm", "0.7 mm (0.6 to 0.8)", "simulated", "▲ better"]
    assert "2 results of the paper: 2 better" in " ".join(index.words)
    assert any(words.startswith("2 better.") for words in Page(pages["paper.html"]).words)
    assert "So." in index.words
    no_cause = "No cause has been tested yet."
    assert any(words.startswith(no_cause) for words in index.words)


def test_without_published_values_the_first_page_has_models_and_next_steps():
    """No page and no column about the paper; chance level and result of each model."""
    report = sample_report()
    size, stones = report.sections
    marks = mark_of("ours", Score(2.2, 0.3)), mark_of("chance", Score(8.2, 0.0))
    rows = (dataclasses.replace(size.rows[0], marks=marks, unit="mm"), *size.rows[1:])
    advice = ("30 % of a are predicted as b.",)
    part = dataclasses.replace(size.parts[0], rows=rows, advice=advice)
    size = dataclasses.replace(size, parts=(part,))
    pages = render(dataclasses.replace(report, sections=(size, stones)))
    assert "paper.html" not in pages
    index = pages["index.html"]
    assert "Published" not in index and "Verdict" not in index
    assert "recordings quarantined" in index and "1 recording quarantined" in index
    page = Page(index)
    assert page.row(["Cube size · edge: CNN"])[1:] == ["8.2 mm", "2.20 ± 0.30 mm", "simulated"]
    assert f"left:{place(1 - 2.2 / 8.2)}%" in index
    assert "Cube size · edge: 30 % of a are predicted as b." in page.words


def test_skill_is_0_at_chance_and_1_without_error():
    """Chance 5.2 mm; ours 0.7 ± 0.1 mm, k-NN 0.9 ± 0.2 mm, the paper 2.6 mm. The other model has
    its own line, so that no mark hides another."""
    (row,) = paper_rows([COMPARED], with_badges=True)
    positions = {position.role: position for position in row.positions}
    assert positions["ours"].at == pytest.approx(place(1 - 0.7 / 5.2))
    ends = place(1 - 0.8 / 5.2), place(1 - 0.6 / 5.2)
    assert (positions["ours"].low, positions["ours"].high) == pytest.approx(ends)
    assert positions["baseline"].at == pytest.approx(place(1 - 0.9 / 5.2))
    assert positions["paper"].at == pytest.approx(place(0.5))
    assert row.alt == (
        "0 is guessing, 1 is perfect: our result 0.87, published value 0.5, best other model 0.83"
    )
    assert [positions[role].line for role in ("ours", "paper", "baseline")] == [0, 0, 1]
    assert row.height_px == 2 * LINE_PX


def test_links_from_the_report_are_percent_encoded(tmp_path):
    paths = Paths(tmp_path)
    assert link_from_report(paths, tmp_path / "data" / "take #1 50%.wav") == (
        "../../data/take%20%231%2050%25.wav"
    )


def test_issues_of_a_kind_are_counted_with_one_example():
    report = sample_report()
    stones = next(d for d in report.datasets if d.findings)
    quiet = dataclasses.replace(
        stones.findings[0], code="quiet", level="warning", fix="convert it to WAV"
    )
    findings = tuple(dataclasses.replace(quiet, recording_id=f"r{n}") for n in range(9))
    datasets = (dataclasses.replace(stones, findings=findings),)
    html = render(dataclasses.replace(report, datasets=datasets, sections=()))["datasets.html"]
    assert "9 × <code>quiet</code>" in html and "Convert it to WAV." in html
    assert "/r0:" in html and "/r1" not in html


def test_a_cause_has_the_evidence_and_names_of_its_results_and_supported_ones_come_first():
    """Ours 0.7 mm, the paper 2.6 mm: a cause is supported if its change increases the error."""

    def reason(claim: str, before: float, supported: bool = True) -> Reason:
        change = Change("no scatter", "CNN", before, 2 * before, supported)
        return Reason(("size",), claim, "causes.html#x", (change,))

    noise = reason("noise", 1, False)
    first = reason("scatter", 0.7)
    second = reason("scatter", 0.8)
    rows = (
        dataclasses.replace(COMPARED, reasons=(noise, first)),
        dataclasses.replace(COMPARED, reasons=(noise, second), label="grouped"),
    )
    report = dataclasses.replace(sample_report(), comparisons=rows, paper=(PAPER,))
    html = render(report)["experiments/size.html"]
    section = html[html.index('id="why"') : html.index('id="details"')]
    items = [re.sub(r"<[^>]+>", "", item) for item in re.findall(r"<li>(.*?)</li>", section)]
    name = rows[0].name
    other = rows[1].name
    assert items == [
        f"Supported ({name}): scatter: no scatter (CNN 0.7 → 1.4).",
        f"Supported ({other}): scatter: no scatter (CNN 0.8 → 1.6).",
        f"Not supported ({name}; {other}): noise.",
    ]


def test_equal_feature_settings_are_one_row(pages):
    report = sample_report()
    names = ", ".join(d.name for d in report.datasets)
    settings = {d.features for d in report.datasets}
    assert len(settings) == 1 and Page(pages["run.html"]).row([names])


def test_a_page_with_its_own_figure_folds_those_of_experiments_and_omits_replaced_ones():
    report = sample_report()
    (size,) = [page for page in report.pages if page.name == "size"]
    parts = [part for section in report.on("size") for part in section.parts]
    replaced, *folded = [figure.name for part in parts for figure in part.figures]
    own = illustration("sizes-of-the-paper")._replace(title="A finding", replaces=(replaced,))
    changed = tuple(
        dataclasses.replace(page, figures=(own,)) if page is size else page for page in report.pages
    )
    report = dataclasses.replace(report, pages=changed)
    assert replaced not in [figure.name for figure in illustrations(report)]
    pages = render(report)
    assert "sizes-of-the-paper" in [a["id"] for a in Page(pages["index.html"]).all("figure")]
    html = pages["experiments/size.html"]
    opened = re.sub(r"<details>.*?</details>", "", html, flags=re.S)
    assert [a["id"] for a in Page(opened).all("figure")] == ["sizes-of-the-paper"]
    assert folded
    assert [a["id"] for a in Page(html).all("figure")] == ["sizes-of-the-paper", *folded]
    without_numbers = dataclasses.replace(COMPARED, marks=())
    compared = render(dataclasses.replace(report, comparisons=(without_numbers,)))
    assert "A finding." in Page(compared["experiments/size.html"]).words


def test_a_remark_on_a_verdict_is_on_its_page_and_in_the_comparison():
    compared = dataclasses.replace(COMPARED, remark="one of two statements agrees")
    pages = render(dataclasses.replace(sample_report(), comparisons=(compared,), paper=(PAPER,)))
    words = Page(pages["experiments/size.html"]).words
    assert "cubes: better; one of two statements agrees." in words
    assert "one of two statements agrees" in Page(pages["paper.html"]).words
