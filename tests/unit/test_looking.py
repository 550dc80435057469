"""`ajgdata doctor` and `status`, and the counts of labels."""

import re
import sys

from ajgdata.cli.project import data_status, diagnostics
from ajgdata.pipeline.validate import counts, label_tables


def test_references_are_not_grasps(project):
    rows = project.session("s1")
    labels = {**rows[0].labels, "reference": "empty"}
    project.write([rows[0].model_copy(update={"labels": labels}), *rows[1:]])
    facts = counts(label_tables(project.paths, "d"), {})
    assert (facts["recordings"], facts["grasps"], facts["references"]) == ("2", "2", "1")


def test_doctor_lists_versions_and_the_project(project):
    facts = diagnostics(project.paths)
    assert facts["python"].startswith(".".join(map(str, sys.version_info[:3])))
    assert re.search(r"numpy \d+\.\d+", facts["packages"])
    assert facts["project"] == str(project.root)
    assert diagnostics(None)["project"] == "none here or above"


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
        f"d: 1 recordings left out; {project.paths.quarantine('d')}",
    ]
    recipe = {
        "grasps_per_object": 1,
        "sessions": 2,
        "objects": [{"name": "c", "shape": {"kind": "cube", "edge_mm": 20}}],
    }
    project.declare(recipe=recipe)
    assert "d: 2 sessions to be recorded by the virtual gripper" in data_status(project.paths)
