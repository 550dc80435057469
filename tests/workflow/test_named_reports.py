"""Each experiment can be asked for alone: then nothing is made that it does not need."""

import re
import shutil

import pytest
import yaml
from conftest import DECLARATION, ROOT, SESSIONS, Project

TASK = {"target": "pitch", "folds": 3, "models": ["knn"]}


@pytest.fixture(scope="module")
def declared(tmp_path_factory) -> Project:
    """What this repository declares, before anything is made."""
    root = tmp_path_factory.mktemp("declared")
    shutil.copytree(ROOT / "datasets", root / "datasets")
    return Project(root)


def needs(project: Project, target: str) -> tuple[dict[str, int], set[str]]:
    """Jobs that a dry run announces, and data sets that are recorded for them."""
    text = project.snakemake("--dry-run", target)
    recorded = set(re.findall(r"Recording session \S+ of (\S+) with", text))
    table = re.search(r"Job stats:\njob +count\n[- ]+\n(.*?)\ntotal", text, flags=re.S)
    jobs = dict(row.split() for row in table[1].splitlines())
    return {rule: int(count) for rule, count in jobs.items() if rule != target}, recorded


def test_media_trains_nothing(declared):
    jobs, recorded = needs(declared, "report_media")
    assert recorded == {"media"}
    assert jobs == {"acquire": 4, "features": 4, "merge": 1, "energy": 1, "experiment": 1}


def test_size_records_no_noise_and_no_other_gripper(declared):
    jobs, recorded = needs(declared, "report_size")
    assert recorded == {"size"}
    of_size = {"acquire": 4, "features": 4, "merge": 1, "evaluate": 6, "experiment": 1}
    assert jobs == of_size


def test_an_experiment_is_reported_alone_and_evaluated_once(project):
    """`copy` is evaluated under the name `both`, and `tones` under its own and `both`."""
    paths = project.paths
    for session in SESSIONS:
        shutil.copytree(project.folder(session), paths.session("copy", session))
    tasks = {
        "tones": {"pitch": TASK | {"experiments": ["tones", "both"]}},
        "copy": {"pitch": TASK | {"experiments": ["both"]}},
    }
    for name, its_tasks in tasks.items():
        paths.dataset(name).parent.mkdir(exist_ok=True)
        declared = DECLARATION | {"name": name, "title": name.title(), "tasks": its_tasks}
        paths.dataset(name).write_text(yaml.safe_dump(declared))
    assert project.planned("report_tones") == {"experiment": 1, "report_tones": 1}
    project.snakemake("report_tones")
    page = paths.report_on("tones").read_text()
    assert "Tones" in page and "Copy" not in page
    for link in re.findall(r"href=\"(?!https?:|#)([^\"]+)\"", page):
        assert (paths.report_on("tones").parent / link).is_file(), link
    made = {"features": 2, "merge": 1, "evaluate": 1, "experiment": 1, "report_both": 1}
    assert project.planned("report_both") == made
