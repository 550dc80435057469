"""`ajgdata doctor` prints versions and the project."""

import re
import sys

from ajgdata.cli.project import diagnostics


def test_doctor_lists_versions_and_the_project(project):
    facts = diagnostics(project.paths)
    assert facts["python"].startswith(".".join(map(str, sys.version_info[:3])))
    assert re.search(r"numpy \d+\.\d+", facts["packages"])
    assert facts["project"] == str(project.root)
    assert diagnostics(None)["project"] == "none here or above"
