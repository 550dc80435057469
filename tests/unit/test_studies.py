"""Studies become files, and files pages: nothing is lost, nothing is unescaped."""

import dataclasses
import sys
import types

import numpy as np
import pytest
from html_page import Page
from report_samples import SCRIPT

from ajgdata.paths import Paths
from ajgdata.pipeline.report import build_page, build_report
from ajgdata.pipeline.studies import run_study
from ajgdata.report.format import DASH
from ajgdata.report.navigation import LEADS, navigation
from ajgdata.report.studies import figures_of
from ajgdata.report.study_page import render_study
from ajgdata.report.study_tables import (
    FIRST_COLUMNS,
    MAX_COLUMNS,
    MAX_ROWS,
    MAX_UNFOLDED_ROWS,
    shown_tables,
)
from ajgdata.store.files import read_json
from ajgdata.store.tables import read_tables, write_tables
from ajgdata.types.table import Column, Table, table_of

TABLE = Table(
    "convergence",
    f"Errors {SCRIPT}",
    "How to read & weep.",
    (
        Column("case", "case"),
        Column("dx_mm", "grid", "mm"),
        Column("error", "error"),
        Column("passed", "holds"),
    ),
    (
        {"case": SCRIPT, "dx_mm": np.float32(2.5), "error": np.inf, "passed": np.bool_(True)},
        {"case": "b", "dx_mm": 5, "error": 1.25e-15, "passed": False},
        {"case": "b", "dx_mm": None, "error": 0.5, "passed": None},
    ),
)
DRAWN = Table(
    "convergence",
    "t",
    "n",
    TABLE.columns[:3],
    tuple(
        {"case": case, "dx_mm": h, "error": factor * h**2}
        for case, factor in (("a", 1), ("b", 3))
        for h in (2, 4)
    ),
)
ABOUT = {
    "study": "verification",
    "quick": False,
    "ajgdata_version": "1",
    "git_commit": "",
    "code": "c",
}


def pretend(monkeypatch, *tables):
    module = types.ModuleType("ajgdata.studies.pretended")
    module.tables = lambda quick: [*tables[: 1 if quick else None]]
    monkeypatch.setitem(sys.modules, module.__name__, module)


def test_what_a_study_found_survives_its_file(monkeypatch, tmp_path):
    pretend(monkeypatch, TABLE, DRAWN)
    out = tmp_path / "deep" / "study.json"
    run_study("pretended", out, code="0" * 16)
    about, (first, second) = read_tables(out)
    assert about["study"] == "pretended" and about["quick"] is False
    assert len(about["code"]) == 16 and about["ajgdata_version"]
    assert second == DRAWN
    assert first == TABLE  # infinity included
    before = out.read_bytes()
    run_study("pretended", out, code="0" * 16)
    assert out.read_bytes() == before
    run_study("pretended", out, code="0" * 16, quick=True)
    assert len(read_tables(out)[1]) == 1
    assert list(out.parent.iterdir()) == [out]


@pytest.fixture
def page(tmp_path, monkeypatch):
    paths = Paths(tmp_path)
    monkeypatch.setitem(LEADS, "pretended", LEADS["verification"])
    pretend(monkeypatch, TABLE)
    run_study("pretended", paths.study("pretended"), code="0" * 16)
    nav = navigation([], ["stability", "accuracy"])
    build_page(paths, "pretended", *read_tables(paths.study("pretended")), nav)
    return paths.page("pretended").read_text(encoding="utf-8")


def test_a_page_shows_every_value_and_runs_nothing(page):
    assert SCRIPT not in page
    shown = Page(page)
    assert shown.row([SCRIPT]) == [SCRIPT, "2.5", "∞", "yes"]
    assert shown.row(["b", "5"]) == ["b", "5", "1.25 × 10⁻¹⁵", "no"]
    assert shown.row(["b", DASH]) == ["b", DASH, "0.5", DASH]
    assert "1 of 2 checks passed." in shown.words
    assert page.count('class="fails"') == 1
    assert "How to read & weep." in shown.words
    fixed = {f"{name}.html" for name in ("index", "paper", "datasets", "run")}
    own = {"#body", "pretended/convergence.csv"}
    links = {a["href"] for a in shown.all("a")}
    assert links == fixed | own | {"stability.html", "accuracy.html"}


def test_figures_are_drawn_linked_and_embedded(tmp_path):
    paths = Paths(tmp_path)
    write_tables(paths.study("verification"), [DRAWN], **ABOUT)
    build_page(paths, "verification", *read_tables(paths.study("verification")), [])
    shown = Page(paths.page("verification").read_text(encoding="utf-8"))
    (image,) = shown.all("img")
    assert image["src"] == "verification/convergence.svg" and len(image["alt"]) > 40
    links = [a["href"] for a in shown.all("a")]
    assert len(links) == 3
    assert all((paths.report.parent / link).is_file() for link in links)


RESONANCES = table_of(
    "resonances",
    "t",
    [
        {"resonance": "tube", "theory_hz": 100, "measured_hz": 98, "simulated_hz": 100.04},
        {"resonance": "sphere", "theory_hz": 200, "measured_hz": 202, "simulated_hz": 200},
    ],
    resonance="Resonance",
    theory_hz="Theory, Hz",
    measured_hz="Measured, Hz",
    simulated_hz="Simulated, Hz",
)
ATTENUATION = table_of(
    "attenuation",
    "t",
    [{"frequency_hz": 400, "theory_db_m": 0.1, "measured_db_m": 0.15, "simulated_db_m": 0.6}],
    frequency_hz="Frequency, Hz",
    theory_db_m="Theory, dB/m",
    measured_db_m="Measured, dB/m",
    simulated_db_m="Simulated, dB/m",
)


def with_uncertainties(table, *keys):
    """Return the table with a column of uncertainties for each of its columns `keys`."""
    columns = tuple(Column(key, key) for key in keys)
    rows = tuple(row | dict.fromkeys(keys, 0.01) for row in table.rows)
    return dataclasses.replace(table, columns=(*table.columns, *columns), rows=rows)


def test_the_page_on_validation_has_a_figure_of_two_tables_and_both_badges(tmp_path):
    paths = Paths(tmp_path)
    tables = [
        with_uncertainties(RESONANCES, "measured_sd_hz", "simulated_sd_hz"),
        with_uncertainties(ATTENUATION, "measured_sd_db_m", "simulated_sd_db_m"),
    ]
    write_tables(paths.study("validation"), tables, **ABOUT | {"study": "validation"})
    build_page(paths, "validation", *read_tables(paths.study("validation")), [])
    page = paths.page("validation").read_text(encoding="utf-8")
    (image,) = Page(page).all("img")
    assert image["src"] == "validation/resonances.svg"
    assert "Resonances: measured within 2.0 %, simulated 0.1 % of theory" in image["alt"]
    assert "tube: measured -2 %, simulated 0.04 %" in image["alt"]
    assert 'class="badge simulated"' in page and 'class="badge recorded"' in page
    assert "does not cover grains, the membrane or grasped objects" in " ".join(Page(page).words)
    assert list(figures_of("validation", tables[:1])) == []


def test_a_study_of_another_version_is_missing_in_the_report_and_listed(tmp_path):
    paths = Paths(tmp_path)
    write_tables(paths.study("verification"), [DRAWN], **ABOUT)
    paths.study("accuracy").write_text('{"tables": []}')
    studies = ["verification", "accuracy", "stability"]
    build_report(paths, datasets=[], tasks=[], requested=[], studies=studies)
    file = paths.study("accuracy")
    problem = "states no format; this version of ajgdata reads format 3"
    command = "snakemake --force results/gripper/accuracy.json"
    line = f"{file}: {problem}. Run `{command}`, which computes it again."
    assert read_json(paths.runs)["unreadable"] == {str(file): line}
    assert paths.page("verification").is_file() and not paths.page("accuracy").exists()
    index = Page(paths.report.read_text(encoding="utf-8"))
    assert "simulation studies (2)" in " ".join(index.words)


def test_sentences_that_notes_share_are_shown_once(tmp_path):
    notes = "About A. Mean over 5.5 s.", "About B. Mean over 5.5 s."
    tables = [dataclasses.replace(DRAWN, name=note[6], note=note) for note in notes]
    text = " ".join(Page(render_study("verification", ABOUT, tables, {})).words)
    assert text.count("Mean over 5.5 s.") == 1 and text.count("About B.") == 1


def checks(name, count, failed=(), columns=8):
    """A table of checks, of which those numbered `failed` do not hold."""
    keys = ["case", *(f"value_{number}" for number in range(columns - 2)), "passed"]
    rows = tuple(
        {key: number for key in keys} | {"case": f"{name} {number}", "passed": number not in failed}
        for number in range(count)
    )
    return Table(name, f"Checks {name}", "Note.", tuple(Column(key, key) for key in keys), rows)


def test_a_page_shows_eight_rows_of_six_columns_and_folds_all_tables():
    tables = [checks("a", 5), checks("b", 20), checks("c", 3)]
    first, second, third = shown_tables("pretended", tables)
    assert [len(shown.rows) for shown in (first, second, third)] == [5, 3, 0]
    assert sum(len(shown.rows) for shown in (first, second, third)) == MAX_ROWS
    assert {len(shown.columns) for shown in (first, second, third)} == {MAX_COLUMNS}
    assert [len(shown.folded) for shown in (first, second, third)] == [5, 20, 3]
    html = render_study("stability", ABOUT, tables, {})
    page = Page(html)
    assert len(page.all("details")) == 3 and "Table (3 rows)" in page.words
    before, *folded = html.split("<details>")
    assert Page(html).all("table") and before.count("<tr>") == 1 + 5
    assert before.count('<th scope="col"') == MAX_COLUMNS
    assert folded[0].split("</details>")[0].count('<th scope="col"') == 8
    assert "20 of 20 checks passed." in page.words


def test_a_small_table_is_complete_and_not_folded():
    (shown,) = shown_tables("pretended", [checks("a", 3, columns=4)])
    assert len(shown.rows) == 3 and shown.folded == []
    assert "<details" not in render_study("stability", ABOUT, [checks("a", 3, columns=4)], {})


def test_a_failed_check_is_never_hidden():
    ahead, behind = shown_tables("p", [checks("a", 20, failed=[15]), checks("b", 5, failed=[4])])
    assert ahead.rows[0]["case"] == "a 15" and not ahead.is_open
    assert behind.rows == [] and behind.is_open
    html = render_study("stability", ABOUT, [checks("a", 20), checks("b", 5, failed=[4])], {})
    assert html.count("<details open>") == 1 and html.count('class="fails"') == 1


def test_tables_of_causes_are_not_folded():
    (shown,) = shown_tables("causes", [checks("a", 40, columns=9)])
    assert len(shown.rows) == MAX_UNFOLDED_ROWS and len(shown.columns) == 9
    assert shown.folded == []


@pytest.fixture(scope="module")
def accuracy_tables():
    from ajgdata.studies import accuracy

    return accuracy.tables(quick=True)


def test_each_source_of_error_shrinks_as_its_setting_gets_better(accuracy_tables):
    budget, differences = accuracy_tables
    (kind,) = budget.split_by("kind")
    for source, key in (("grid", "dx_mm"), ("stopping", "decay_db"), ("time step", "cfl")):
        rows = budget.where(source=source).rows
        by_setting = {float(row["setting"].removeprefix(f"{key} ")): row["error"] for row in rows}
        errors = [by_setting[setting] for setting in sorted(by_setting)]
        assert len(errors) >= 3
        assert errors == sorted(errors, reverse=source == "stopping"), source
    (total,) = budget.where(source="together").rows
    largest = max(row["error"] for row in budget.where(is_default=True, kind=kind).rows)
    assert 0.9 * largest <= total["error"] <= 3 * largest
    assert differences.numbers("correlation")[:3].min() > 0.9


def test_the_figure_of_the_error_budget_marks_the_default(accuracy_tables):
    (shown,) = figures_of("accuracy", accuracy_tables)
    assert shown.title.startswith("Default settings: relative error of the feature 0.0")
    assert shown.title.endswith("mostly from the grid")
    (axes,) = shown.draw().axes
    labels = axes.get_legend_handles_labels()[1]
    assert {"grid", "stopping", "default", "together"} <= {*labels}
    star = next(line for line in axes.get_lines() if line.get_label() == "together")
    assert star.get_xdata().tolist() == [1.0]


def test_the_figure_of_omissions_fills_those_that_are_used():
    keys = {"part": "Part", "kind": "Scenes", "saved": "Saved", "feature": "F", "verdict": "V"}
    rows = [
        {"part": "frame", "kind": "cubes", "saved": 0.2, "feature": 0.001, "verdict": "left out"},
        {"part": "film", "kind": "cubes", "saved": 0.0, "feature": 0.0, "verdict": "keep"},
    ]
    (shown,) = figures_of("omissions", [table_of("omissions", "T", rows, **keys)])
    assert shown.title == (
        "The simulation uses 1 of 2 omissions: they save up to 20 % of the time and change the"
        " feature by up to 0.001"
    )
    shown.draw()


def test_first_columns_are_columns_of_the_studies(accuracy_tables):
    for table in accuracy_tables:
        assert set(FIRST_COLUMNS[table.name]) <= {column.key for column in table.columns}
    assert all(len(keys) <= MAX_COLUMNS for keys in FIRST_COLUMNS.values())


@pytest.fixture(scope="module")
def stability():
    """Tables of the study, with two limits, a limit that is not reached, and one long run."""
    from ajgdata.studies import stability as study
    from ajgdata.studies.extreme_cases import Trial, from_bowl
    from ajgdata.studies.limits import HeavyWall, LightObjectWithCore, Pressure

    trial = Trial("wall", "stiff", from_bowl(packing=None, wall=(0.3, 0.0, 1e10)), 500)
    limits = [(limit, limit.run()) for limit in (HeavyWall(6.0), Pressure(6.0))]
    unreached = [(limit, limit.run()) for limit in (LightObjectWithCore(6.0),)]
    runs = list(study.long_runs([trial], 2_000))
    return [
        study.limit_table(limits),
        study.unreached_table(unreached),
        study.long_run_table(runs),
        study.trial_table([study.judge(trial)]),
        study.energy_table(runs),
        study.distance_table(limits),
    ]


def test_the_page_on_stability_begins_with_its_figure(stability, tmp_path):
    paths = Paths(tmp_path)
    write_tables(paths.study("stability"), stability, **ABOUT)
    build_page(paths, "stability", *read_tables(paths.study("stability")), [])
    html = paths.page("stability").read_text(encoding="utf-8")
    page = Page(html)
    (image,) = page.all("img")
    assert image["src"] == "stability/limits.svg"
    assert html.index("<img") < html.index("<table")
    assert "Energy" in image["alt"] and "2 of 3 limits are reached" in image["alt"]
    for table in stability:
        file = paths.page_figures("stability") / f"{table.name}.csv"
        assert len(file.read_text(encoding="utf-8").splitlines()) == 1 + len(table.rows)
    before = html.split("<details")[0]
    assert before.count("<tr>") <= 1 + MAX_ROWS
    assert before.count('<th scope="col"') == MAX_COLUMNS


def test_the_figure_of_stability_has_a_conclusion_and_two_logarithmic_panels(stability):
    (illustration,) = figures_of("stability", stability)
    assert len(illustration.title) <= 90
    figure = illustration.draw()
    left, right = figure.axes
    assert left.get_xscale() == right.get_xscale() == "log"
    assert left.get_yscale() == right.get_yscale() == "log"
    # Two precisions and the allowed growth of both; a limit and its slope.
    assert len(left.lines) == 4 and len(right.lines) == 2
    slope = right.lines[-1].get_xydata()
    assert np.diff(np.log(slope), axis=0)[0] == pytest.approx([np.log(1e4)] * 2)


def test_without_its_tables_the_page_on_stability_has_no_figure(stability):
    assert list(figures_of("stability", stability[:2])) == []
