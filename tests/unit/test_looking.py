"""`ajgdata doctor`, and the counts of labels."""

import re
import sys

from ajgdata.cli.project import diagnostics
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
