"""`ajgdata status` lists the outdated results of a project, with the reasons in words."""

import json
import shutil

import pytest
import typer
import yaml
from conftest import DECLARATION, Project, add_recording, edit_table

from ajgdata.cli.status import status
from ajgdata.paths import Paths

#: Snakemake leaves files of its own open.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
MEASURED = "experiment cross_validation of pitch (plain)"
KNN = "model knn of pitch"
AFTER_FEATURES = {
    MEASURED: "its input is outdated: features",
    KNN: "its input is outdated: features",
}


@pytest.fixture(scope="module")
def whole(finished, tmp_path_factory) -> Project:
    """The project after `ajgdata run tones`."""
    project = finished.copied(tmp_path_factory.mktemp("whole") / "tones")
    datasets = ("--config", "datasets=[tones]", "alone=True", "pages=[]", "publish=[]")
    project.snakemake(*datasets)
    return project


@pytest.fixture
def project(whole, tmp_path) -> Project:
    return whole.copied(tmp_path / "copy")


def nothing(project):
    pass


def label(project):
    edit_table(project, "day1", lambda rows: rows[0].update(pitch="high"))


def folds(project):
    task = DECLARATION["tasks"]["pitch"] | {"folds": 4}
    project.paths.dataset("tones").write_text(
        yaml.safe_dump(DECLARATION | {"tasks": {"pitch": task}})
    )


def window(project):
    features = {"features": {"window": 1024}}
    project.paths.dataset("tones").write_text(yaml.safe_dump(DECLARATION | features))


def no_model(project):
    shutil.rmtree(project.paths.model("tones", "pitch", "knn"))


def no_quarantine(project):
    project.paths.quarantine("tones").unlink()


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (nothing, {}),
        (add_recording, {"features": "session day1 changed", **AFTER_FEATURES}),
        (label, {"features": "session day1 changed", **AFTER_FEATURES}),
        (window, {"features": "`features` of dataset.yaml changed", **AFTER_FEATURES}),
        (folds, {MEASURED: "its settings in dataset.yaml changed (folds)"}),
        (no_model, {KNN: "not computed yet"}),
        (
            no_quarantine,
            {"features": f"{Paths().quarantine('tones')} is missing", **AFTER_FEATURES},
        ),
    ],
)
def test_each_change_has_its_reason(project, monkeypatch, capsys, change, expected):
    change(project)
    monkeypatch.chdir(project.root)
    with pytest.raises(typer.Exit) as stopped:
        status(["tones"], as_json=True)
    assert stopped.value.exit_code == 0
    state = json.loads(capsys.readouterr().out)
    assert state["unusable"] == []
    own = {job["name"]: ", ".join(job["reasons"]) for job in state["jobs"] if job["dataset"]}
    assert own == expected
    n_files = sum(len(job["files"]) for job in state["jobs"])
    assert state["n_outdated"] + state["n_missing"] == n_files <= state["n_results"]
    assert state["n_missing"] == {no_model: 1, no_quarantine: 1}.get(change, 0)
    assert state["command"] == "ajgdata run tones"
