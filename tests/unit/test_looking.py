"""`ajgdata doctor` and `status`, and the counts of labels."""

import os
import re
import sys

from ajgdata.cli.project import data_status, diagnostics, summarised
from ajgdata.pipeline.label_counts import counts, label_tables

HEADER = "output_file\tdate\trule\tlog-file(s)\tstatus\tplan\n"


def test_references_are_not_grasps(project):
    rows = project.session("s1")
    labels = {**rows[0].labels, "reference": "silence"}
    project.write([rows[0].model_copy(update={"labels": labels}), *rows[1:]])
    facts = counts(label_tables(project.paths, "d"), {})
    assert (facts["recordings"], facts["grasps"], facts["references"]) == ("2", "2", "1")


def test_doctor_says_versions_and_what_is_wrong(project):
    facts, wrong = diagnostics(project.paths)
    assert facts["python"].startswith(".".join(map(str, sys.version_info[:3])))
    assert re.search(r"numpy \d+\.\d+", facts["packages"])
    assert facts["cores"].startswith(f"{len(os.sched_getaffinity(0))} of ")
    assert facts["project"] == str(project.root)
    assert wrong == []
    assert diagnostics(None)[0]["project"] == "none here or above"
    assert re.fullmatch(
        r"[\d.]+ GB free on disk; `make clean` removes .*", diagnostics(project.paths, 1e18)[1][0]
    )


def test_summary_is_grouped_by_rule_and_reason():
    table = HEADER + "".join(
        f"{file}\t-\t{rule}\t-\t{status}\t{plan}\n"
        for file, rule, status, plan in [
            ("report.html", "report", "ok", "update pending"),
            ("a.json", "evaluate", "updated input files", "update pending"),
            ("b.json", "evaluate", "updated input files", "update pending"),
            ("c.json", "evaluate", "missing", "update pending"),
            ("d.nc", "merge", "ok", "no update"),
        ]
    )
    current, groups = summarised(table)
    assert current == 1
    assert [(g.rule, g.reason, g.files) for g in groups] == [
        ("evaluate", "missing", ("c.json",)),
        ("evaluate", "updated input files", ("a.json", "b.json")),
        ("report", "what it is made from", ("report.html",)),
    ]


def test_data_status_says_what_no_run_mends(project):
    assert data_status(project.paths) == [
        "d: declared, no recordings; `ajgdata import FOLDER --dataset d`"
    ]
    rows = project.session("s1")
    assert data_status(project.paths) == []
    project.write([rows[0].model_copy(update={"sha256": ""}), *rows[1:]])
    (project.folder() / "audio" / "b.wav").unlink()
    project.shard()
    project.merge("s1")
    assert data_status(project.paths) == [
        "d/s1: 1 recordings not sealed; `ajgdata seal d` writes their hashes",
        f"d: 1 recordings left out; {project.paths.quarantine('d')}",
    ]
    recipe = {
        "grasps_per_object": 1,
        "sessions": 2,
        "objects": [{"name": "c", "shape": {"kind": "cube", "edge_mm": 20}}],
    }
    project.declare(recipe=recipe)
    assert "d: 2 sessions to be recorded by the virtual gripper" in data_status(project.paths)
