"""Figures that a run computes get into README and docs by a tool, and by no other way."""

import re
from pathlib import Path

import pytest

from ajgdata.ablations import ABLATIONS
from ajgdata.evaluate.metrics import METRICS
from ajgdata.paths import Paths
from ajgdata.pipeline.collect import COLUMNS
from ajgdata.store.files import csv_bytes, json_bytes, write_bytes
from ajgdata.store.sessions import read_dataset
from ajgdata.store.tables import write_tables
from ajgdata.types.table import Column, Table
from tools import screenshots
from tools.findings import blocks
from tools.findings.documents import END, blocks_of, documents, outside, rewritten
from tools.findings.evaluations import CHOSEN, HEADLINES, terms
from tools.findings.results import Key, Results

ROOT = Path(__file__).parents[2]
PAGES = documents(ROOT)
#: Pages all of whose results are of a run; others also hold what was measured once, and say so.
OF_A_RUN = ("README.md", "ablations.md", "contact.md", "virtual-gripper.md")

VERDICT = {
    "of": "size", "hypothesis": "louder is better", "change": "twice as loud", "metric": "R²",
    "model": "ridge", "before": -0.25, "before_sd": 0.11, "after": 0.5, "after_sd": 0.02,
    "gain": 0.75, "gain_low": -0.1, "gain_high": 1.6, "p": 0.02, "expected": "better",
    "seconds": 3.0,
}  # fmt: skip

MADE = {"git_commit": "c0ffee1234567", "quick": False}


def metric_row(key: Key, value: float, commit: str = "c0ffee1234567") -> dict:
    given = {**key._asdict(), "source": "simulated", "value": value, "unit": "", "seed": 0}
    return {**given, "commit": commit}


@pytest.fixture
def project(tmp_path):
    """Made-up results of a run."""
    paths = Paths(tmp_path)
    judged = Table("t", "Loudness", "How loud.", tuple(Column(k, k) for k in VERDICT), (VERDICT,))
    columns = (Column("band", "Band", "Hz"), Column("ratio", "Ratio"), Column("seconds", "Time"))
    plain = Table(
        "p", "Bands", "By band.", columns, ({"band": "20|300", "ratio": -2.5e-5, "seconds": 1},)
    )
    for name in ABLATIONS:
        write_tables(paths.ablation(name), [judged, plain], study=name, **MADE)
    known = ("size", "size", "cnn", "grouped", "rmse")
    low = ("size", "size", "cnn", "grouped 60-6000 Hz", "rmse")
    plates = ("plate", "material", "knn", "grouped", "accuracy")
    rows = [
        metric_row(Key(*known, "mean"), 0.7249),
        metric_row(Key(*known, "sd"), 0.1159),
        metric_row(Key(*known, "chance"), 6.4163),
        metric_row(Key(*known, "grasp low"), 0.6),
        metric_row(Key(*known, "grasp high"), 0.9),
        metric_row(Key(*low, "mean"), 0.8312),
        metric_row(Key(*low, "sd"), 0.0911),
        metric_row(Key(*plates, "mean"), 0.5625),
        metric_row(Key(*plates, "sd"), 0.0442),
        metric_row(Key(*plates, "chance"), 0.6),
        metric_row(Key("ycb", "object", "cnn", "cost of grouped", "train_s", "measured"), 7.618),
    ]
    noise = ("size", "noise", "cnn", "repeated fits on:size_80dba", "rmse")
    fits = {"median": 20.6, "low": 17.2, "high": 22.4, "chance": 6.4163}
    rows += [metric_row(Key(*noise, statistic), value) for statistic, value in fits.items()]
    write_bytes(paths.metrics_table, csv_bytes(COLUMNS, rows))
    write_bytes(paths.runs, json_bytes({"agreements": {"agrees": 3, "better": 2}}))
    return paths


def test_every_block_stands_in_one_place_and_every_marker_has_its_block():
    standing = [name for page in PAGES for name in blocks_of(page.read_text(encoding="utf-8"))]
    assert sorted(standing) == sorted(blocks.BLOCKS)


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_what_stands_there_says_which_run_it_is_of(page):
    for name, text in blocks_of(page.read_text(encoding="utf-8")).items():
        run = r"\nRun of commit [0-9a-f]{10}\+?(, [0-9a-f]{10}\+?)*, results [0-9a-f]{10}\.\n\n$"
        assert re.search(run, text), name


@pytest.mark.parametrize("page", [p for p in PAGES if p.name in OF_A_RUN], ids=lambda p: p.name)
def test_no_result_is_typed(page):
    """A mean with its deviation is a result; so is a table of numbers below 1."""
    for line in outside(page.read_text(encoding="utf-8")).splitlines():
        assert not re.search(r"\d\s*±\s*\d", line), line
        assert not (line.startswith("|") and re.search(r"\| *\**0?\.\d", line)), line


@pytest.mark.parametrize("row", [*HEADLINES, *CHOSEN], ids=lambda row: row.title)
def test_what_the_tables_show_is_what_the_data_sets_declare(row):
    spec = read_dataset(Paths(ROOT), row.dataset)
    task = spec.tasks[row.task]
    withheld = ["withheld"] if task.withhold else []
    compared = ["random"] if task.compare_random else []
    assert row.part in (
        "grouped",
        *compared,
        *withheld,
        *(f"on:{name}" for name in task.test_on),
        *(f"repeated fits on:{name}" for name in task.test_on),
    )
    assert "cnn" in task.models
    if row in HEADLINES:
        assert task.bands == ((60, 6_000), (60, 1_200))
    assert terms(row).metric == METRICS[spec.targets[task.target].kind][0]


def test_results_stand_beside_the_papers_with_the_run_that_they_are_of(project):
    text = blocks.block("all-results", Results(project.results))
    lines = text.splitlines()
    assert lines[3] == (
        "| edge length, 12 cubes seen in training, RMSE "
        "| 0.72 ± 0.12 mm | — | — | 0.831 ± 0.091 mm | — | 6.4 mm | 2.7 mm | better "
        "| `size/size`, grouped |"
    )
    plates, training = "| material of plates ", "| training on the 16 objects, all folds, one core "
    assert (
        plates + "| — | — | 56.2 ± 4.4 %, not better than chance | — | — | 60 % | 100 % | — "
        "| `plate/material`, grouped |" in lines
    )
    assert training + "| 7.6 s | — | — |  |  |  |  |  | `ycb/object` |" in lines
    assert "Comparison with the paper, all rows: 3 agrees, 2 better." in lines
    assert re.fullmatch(r"Run of commit c0ffee1234, results [0-9a-f]{10}\.", lines[-2])


def test_the_readme_has_five_results_that_are_understandable_alone(project):
    lines = blocks.block("results", Results(project.results)).splitlines()
    assert lines[3:5] == [
        "| Edge length of a cube, RMSE | 0.72 mm (0.6 to 0.9) | 2.7 mm | 6.4 mm | better |",
        "| Edge length in noise of 80 dB(A), training at 45 dB(A), RMSE | 21 mm (17 to 22), not"
        " better than chance | 3.5 mm | 6.4 mm | worse |",
    ]
    assert len(lines[3:-2]) == 6 and lines[5].endswith("| — | 85.6 % | — | — |")


def rows_of(name: str, *rows: dict) -> Table:
    return Table(name, name, "", tuple(Column(key, key) for key in rows[0]), rows)


def test_the_sorting_row_is_told_of_the_experiment_and_of_the_card(project):
    of = {"grasps": 20, "part": "plain"}
    which = of | {"policy": "as needed", "looks": 1}
    shares = {"accepted": 0.9, "wrong": 0.0125, "added_s": 0.0}
    lengths = enumerate(((5, 10), (6, 20), (7, 30)))
    runs = [which | {"run": n, "before_error": b, "sorts": s} for n, (b, s) in lengths]
    tables = [
        rows_of("conditions", which | shares, which | shares | {"policy": "always", "looks": 2}),
        rows_of("runs", *runs),
        rows_of("offline", of | {"low": 0, "middle": 13, "high": 58}),
    ]
    for model in ("cnn", "linear"):
        path = project.experiment("ycb", "sorting", f"live_sorting-{model}")
        write_tables(path, tables, provenance={"git_commit": "c0ffee1234567"})
    lines = blocks.block("live-sorting", Results(project.results)).splitlines()
    both = "6 (5.1 to 6.9) | 13 (0 to 58) | 20 (11 to 29)"
    said = f"| 20 grasps each | 1 | {both} | 10 % | 1.25 % | 0 s |"
    assert [line for line in lines if line.endswith(said)] == [
        f"| {label} {said}" for label in ("CNN", "logistic regression")
    ]
    live = [{"looks": 1, "sorts": n, "mistakes": 2, "finished": n > 9} for n in (10, 9)]
    stages = rows_of("stages", {"stage": "sense", "median_ms": 80.0, "p99_ms": 160.0, "count": 19})
    compared = {"looks": 20, "largest": 0.0125, "other_decisions": 1}
    about = {"model": "cnn", "placements": 160, "compared": {"1": compared}, **MADE}
    write_tables(project.sort_live, [rows_of("runs", *live), stages], **about)
    lines = blocks.block("sort-live", Results(project.results)).splitlines()
    assert "CNN, 160 placements." in lines and "| sense | 80 | 160 | 19 |" in lines
    assert "| 1 | 2 | 9.5 (9.05 to 9.95) | 4 | 1 | 20 | 0.0125 | 1 |" in lines


def test_a_line_for_each_verdict_and_each_row(project):
    lines = blocks.block("ablation-mirror", Results(project.results)).splitlines()
    verdict = (
        "| size | louder is better | twice as loud | R² | ridge | −0.25 ± 0.11 | 0.500 ± 0.020 "
    )
    assert f"{verdict}| −0.1 to 1.6 | not supported |" in lines
    at = lines.index("| Band, Hz | Ratio |")
    assert lines[at + 2] == "| 20\\|300 | −2.5 × 10⁻⁵ |"


def test_a_run_is_named_after_what_was_read(project):
    """Neither a file that a block does not read, nor where the results are, changes its name."""
    before = blocks.block("results", Results(project.results))
    write_tables(project.ablation("noise"), [], study="noise", **MADE)
    assert blocks.block("results", Results(project.results)) == before
    moved = project.results.rename(project.root / "elsewhere")
    assert blocks.block("results", Results(moved)) == before
    table = moved / "metrics.csv"
    table.write_text(table.read_text().replace("0.7249", "0.7250"))
    copy = moved.rename(project.root / "later")
    assert blocks.block("results", Results(copy)).splitlines()[-2] != before.splitlines()[-2]


def test_only_what_is_between_the_markers_is_rewritten():
    text = (
        "a  \r\n\ttab\n<!-- findings: one -->\nold\n" + END + "b <!-- findings: none --> é\n\n"
        "<!-- findings: two -->\n" + END + "no line end"
    )
    asked = []

    def content(name, before):
        asked.append((name, before))
        return f"new {name}\n"

    assert rewritten(text, content) == (
        "a  \r\n\ttab\n<!-- findings: one -->\nnew one\n" + END + "b <!-- findings: none --> é\n\n"
        "<!-- findings: two -->\nnew two\n" + END + "no line end"
    )
    assert asked == [("one", "old\n"), ("two", "")]
    assert rewritten(text, lambda name, before: before) == text
    assert "old" not in outside(text) and "tab" in outside(text)


@pytest.mark.parametrize(
    "text",
    [
        "<!-- findings: one -->\nnever closed\n",
        END,
        "<!-- findings: one -->\n" + END + END,
        "<!-- findings: one -->\n<!-- findings: two -->\n" + END,
        "<!-- findings: one -->\n" + END + "<!-- findings: one -->\n" + END,
    ],
)
def test_markers_that_do_not_pair_are_refused(text):
    with pytest.raises(ValueError, match="findings"):
        blocks_of(text)


def test_a_figure_that_was_typed_over_is_found_where_the_results_are_those_it_names(project):
    written = blocks.block("all-results", Results(project.results))
    page = "<!-- findings: all-results -->\n" + written + END
    assert blocks.drifted(page, project.results) == []
    typed = page.replace("0.72 ± 0.12", "0.70 ± 0.12")
    assert blocks.drifted(typed, project.results) == ["all-results"]
    table = project.metrics_table
    table.write_text(table.read_text().replace("0.7249", "0.7250"))  # another run
    other = project.results.rename(project.root / "other")
    assert blocks.drifted(typed, other) == []


def test_screenshots_stay_where_there_is_no_browser_or_no_report(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(screenshots, "IMAGES", tmp_path)
    page = tmp_path / "index.html"
    screenshots.write_screenshots(page)
    assert f"left as they were, there is no {page}" in capsys.readouterr().out
    page.touch()
    monkeypatch.setenv("PATH", "")
    screenshots.write_screenshots(page)
    assert "not installed: apt-get install chromium chromium-driver" in capsys.readouterr().out
    assert list(tmp_path.iterdir()) == [page]


def test_pictures_of_the_docs_are_small():
    """Every clone has them, each version of them."""
    sizes = {file.name: file.stat().st_size for file in screenshots.IMAGES.iterdir()}
    assert sum(sizes.values()) <= screenshots.MAX_BYTES
