"""Labels that are unusual or wrong, from recordings.csv to the results of a run."""

import csv
from pathlib import Path

import yaml
from conftest import DECLARATION

import ajgdata

FORMULA = '=HYPERLINK("http://example.org","low")'


def read(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def edit(project, change) -> None:
    """Apply `change` to every row of every recordings.csv."""
    for session in ("day1", "day2"):
        path = project.folder(session) / "recordings.csv"
        rows = [change(dict(row)) for row in read(path)]
        with path.open("w", encoding="utf-8", newline="") as stream:
            writer = csv.DictWriter(stream, rows[0], lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)


def changed(row: dict[str, str]) -> dict[str, str]:
    """A formula as the class `low`, and a number that is a text in one recording per session."""
    number = row["recording_id"]
    hz = "many" if number == "0" else f"5{number}"
    return row | {"pitch": FORMULA if row["pitch"] == "low" else "high", "hz": hz}


def test_formulas_and_invalid_cells_in_the_results_of_a_run(project):
    """A formula is text in tables for people; an invalid cell leaves the tasks of others."""
    task = DECLARATION["tasks"]["pitch"]
    declared = DECLARATION | {
        "targets": {**DECLARATION["targets"], "hz": {"kind": "regression"}},
        "tasks": {"pitch": task, "hz": task | {"target": "hz"}},
    }
    project.paths.dataset("tones").write_text(yaml.safe_dump(declared))
    edit(project, changed)
    before = (project.folder("day1") / "recordings.csv").read_bytes()
    project.snakemake("results/metrics.json")
    assert (project.folder("day1") / "recordings.csv").read_bytes() == before
    rows = read(project.paths.predictions)
    classes = {row["y_true"] for row in rows if row["task"] == "pitch"}
    assert classes == {f"'{FORMULA}", "high"}
    with ajgdata.load_features("tones", project.root) as features:
        assert set(features.pitch.values.tolist()) == {FORMULA, "high"}
    cells = [cell for row in read(project.paths.metrics_table) for cell in row.values()]
    assert not [cell for cell in cells if cell.startswith(("=", "@", "+", "\t"))]
    pitch, hz = (
        {row["recording"] for row in rows if row["task"] == name} for name in ("pitch", "hz")
    )
    assert pitch - hz == {"day1/0", "day2/0"} and len(hz) == 14
    assert {row["code"] for row in read(project.paths.quarantine("tones"))} == {"bad_label"}
