"""Each experiment can be asked for alone: then nothing is made that it does not need."""

import re
import shutil
from collections import Counter

import pytest
import yaml
from conftest import DECLARATION, ROOT, SESSIONS, Project, rules_of

TASK = DECLARATION["tasks"]["pitch"]


@pytest.fixture(scope="module")
def declared(tmp_path_factory) -> Project:
    """What this repository declares, before anything is made."""
    root = tmp_path_factory.mktemp("declared")
    shutil.copytree(ROOT / "datasets", root / "datasets")
    return Project(root)


@pytest.mark.parametrize(
    ("name", "experiments"),
    [
        ("media", {"reflection/reflected_energy": 1}),  # trains nothing
        (
            "size",  # one job a model
            {
                "size/cross_validation": 3,
                "size/conformal_intervals": 2,
                "size/across_sessions": 2,
                "cube/cross_validation": 3,
            },
        ),
    ],
)
def test_an_experiment_needs_only_what_it_is_about(declared, name, experiments):
    """No noise and no other gripper is recorded for the size, and no other task measured."""
    planned = declared.jobs_of(f"report_{name}")
    made = {"acquire": 4, "features": 4, "merge": 1, "experiment": sum(experiments.values())}
    assert rules_of(planned) == {**made, "report_alone": 1, f"report_{name}": 1}
    assert {job[1] for job in planned if job[0] == "acquire"} == {name}
    measured = Counter(
        f"{job[2]}/{job[3].partition('-')[0]}" for job in planned if job[0] == "experiment"
    )
    assert measured == experiments


def test_an_experiment_is_reported_alone_and_evaluated_once(project):
    """`copy` is evaluated under the name `both`, and `tones` under its own and `both`."""
    paths = project.paths
    for session in SESSIONS:
        shutil.copytree(project.folder(session), paths.session("copy", session))
    tasks = {
        "tones": {"pitch": TASK | {"reports": ["tones", "both"]}},
        "copy": {"pitch": TASK | {"reports": ["both"]}},
    }
    for name, its_tasks in tasks.items():
        paths.dataset(name).parent.mkdir(exist_ok=True)
        declared = DECLARATION | {"name": name, "title": name.title(), "tasks": its_tasks}
        paths.dataset(name).write_text(yaml.safe_dump(declared))
    assert project.planned("report_tones") == {"report_alone": 1, "report_tones": 1}
    project.snakemake("report_tones")
    page = paths.report_on("tones").read_text()
    assert "Tones" in page and "Copy" not in page
    for link in re.findall(r"href=\"(?!https?:|#)([^\"]+)\"", page):
        file, _, place = link.partition("#")
        there = paths.report_on("tones").parent / file
        assert there.is_file() and (not place or f'id="{place}"' in there.read_text()), link
    made = {"features": 2, "merge": 1, "experiment": 1, "report_alone": 1}
    made["report_both"] = 1
    assert project.planned("report_both") == made
