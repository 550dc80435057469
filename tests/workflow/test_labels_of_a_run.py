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


def test_formulas_are_text_in_tables_for_people_and_unchanged_elsewhere(project):
    edit(project, lambda row: row | {"pitch": FORMULA if row["pitch"] == "low" else "high"})
    before = (project.folder("day1") / "recordings.csv").read_bytes()
    project.snakemake("results/metrics.json")
    assert {row["y_true"] for row in read(project.paths.predictions)} == {f"'{FORMULA}", "high"}
    assert (project.folder("day1") / "recordings.csv").read_bytes() == before
    with ajgdata.load_features("tones", project.root) as features:
        assert set(features.pitch.values.tolist()) == {FORMULA, "high"}
    cells = [cell for row in read(project.paths.metrics_table) for cell in row.values()]
    assert not [cell for cell in cells if cell.startswith(("=", "@", "+", "\t"))]


def test_an_invalid_cell_of_one_target_leaves_the_tasks_of_others(project):
    task = DECLARATION["tasks"]["pitch"]
    declared = DECLARATION | {
        "targets": {**DECLARATION["targets"], "hz": {"kind": "regression"}},
        "tasks": {"pitch": task, "hz": task | {"target": "hz"}},
    }
    project.paths.dataset("tones").write_text(yaml.safe_dump(declared))
    edit(
        project,
        lambda row: (
            row
            | {
                "hz": "many"
                if row["recording_id"] == "0"
                else row["sample"] + "5" + row["recording_id"]
            }
        ),
    )
    project.snakemake("results/metrics.json")
    rows = read(project.paths.predictions)
    tested = {
        name: {row["recording"] for row in rows if row["task"] == name} for name in ("pitch", "hz")
    }
    assert tested["pitch"] - tested["hz"] == {"day1/0", "day2/0"}
    assert len(tested["hz"]) == 14
    assert {row["code"] for row in read(project.paths.quarantine("tones"))} == {"bad_label"}
