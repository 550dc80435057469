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
from ajgdata.report.studies import figures_of, render_study
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
    build_page(paths, "pretended", [paths.study("pretended")], nav)
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
    build_page(paths, "verification", [paths.study("verification")], [])
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
    build_page(paths, "validation", [paths.study("validation")], [])
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
    command = "snakemake everything --forcerun results/gripper/accuracy.json"
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
