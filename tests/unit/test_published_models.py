"""Published models: equal predictions, measured scores, and one line for each mistake."""

import json
import shutil

import numpy as np
import pytest
import yaml
from published import flip, make_project, remake
from recorded import run_experiments
from worlds import Project, assert_one_line

import ajgdata as library
from ajgdata.paths import Paths, Tree
from ajgdata.pipeline.fetch import fetch
from ajgdata.pipeline.publish import publish
from ajgdata.pipeline.published_models import model_files
from ajgdata.pipeline.train import train_model
from ajgdata.report.format import number
from ajgdata.store.features import read_store
from ajgdata.store.files import write_bytes
from ajgdata.store.publishing.archive import checksums_bytes
from ajgdata.store.sessions import read_dataset
from ajgdata.store.tables import read_measurements
from ajgdata.types import DataError

KEY = ("edge", "knn")


@pytest.fixture(scope="module")
def trained(tmp_path_factory) -> Project:
    """A project with one final model and its scores, which the tests only read."""
    project = make_project(tmp_path_factory.mktemp("trained") / "project")
    paths = project.paths
    run_experiments(paths, "d")
    spec = read_dataset(paths, "d")
    train_model(
        read_store(paths.features("d")),
        spec.training("edge"),
        task="edge",
        model="knn",
        seed=0,
        folder=paths.model("d", *KEY),
        dataset="d",
    )
    return project


@pytest.fixture(scope="module")
def world(trained, tmp_path_factory):
    """The project, and its published data set with the model."""
    out = tmp_path_factory.mktemp("published") / "d"
    publish(trained.paths, "d", out, models=model_files(trained.paths, "d"))
    return trained, Tree(out)


def test_the_model_of_the_folder_predicts_the_same(world, trained):
    features = read_store(trained.paths.features("d")).flat
    here = library.load_model("d", *KEY, project=trained.root)
    there = library.load_model("d", *KEY, project=world[1].root)
    assert np.array_equal(here.predict(features), there.predict(features))
    file = next((world[1].root / "audio/s2").iterdir())
    predictors = [
        library.load_predictor("d", *KEY, project=root) for root in (trained.root, world[1].root)
    ]
    first, second = (predictor.predict_file(file) for predictor in predictors)
    assert first == second
    suffixes = {path.suffix for path in (world[1].root / "models").rglob("*") if path.is_file()}
    assert suffixes == {".json", ".skops", ".safetensors", ".md"}


def test_the_description_has_the_measured_scores_and_the_settings(world, trained):
    text = (world[1] / "models/edge/knn/README.md").read_text()
    ((about, tables),) = read_measurements(
        trained.paths.experiment("d", "edge", "cross_validation", "plain")
    )
    rows = next(table for table in tables if table.name == "scores").rows
    values = {
        row["statistic"]: row["value"]
        for row in rows
        if (row["split"], row["target_values"], row["metric"]) == ("grouped", "training", "rmse")
    }
    mean, sd, low, high = (values[key] for key in ("mean", "sd", "grasp low", "grasp high"))
    line = next(
        line for line in text.splitlines() if line.startswith("| grouped |") and "rmse" in line
    )
    assert f"| {number(mean)} ± {number(sd)} mm |" in line
    interval = f"| {number(low)} to {number(high)} mm |" if low is not None else "| — |"
    assert interval in line
    assert "| predicts | edge_mm in mm (regression) |" in text
    assert "| data set | d, version 1.0.0 |" in text
    assert "window 256" in text and "hop 128" in text
    assert (
        f"| trained on | {about['parts']['grouped']['recordings']} recordings, recorded |" in text
    )
    assert "[models/edge/knn](models/edge/knn/README.md)" in (world[1] / "README.md").read_text()


def test_models_are_fetched_on_request(world, trained, tmp_path):
    (tmp_path / "elsewhere/datasets").mkdir(parents=True)
    paths = Paths(tmp_path / "elsewhere")
    fetch(paths, str(world[1].root), with_models=True)
    features = read_store(trained.paths.features("d")).flat
    there = library.load_model("d", *KEY, project=paths.recordings("d") / "published")
    here = library.load_model("d", *KEY, project=trained.root)
    assert np.array_equal(here.predict(features), there.predict(features))
    fetch(paths, str(world[1].root), name="plain")
    assert not (paths.recordings("plain") / "published/models").exists()


def test_a_version_with_other_models_is_another_version(world, trained, tmp_path):
    shutil.copytree(world[1].root, tmp_path / "d")
    publish(trained.paths, "d", tmp_path / "d", models=model_files(trained.paths, "d"))
    with pytest.raises(DataError, match=r"other content: files of models, first models/edge/knn"):
        publish(trained.paths, "d", tmp_path / "d")


def test_files_that_are_changed_and_other_names_are_refused(world, tmp_path):
    tree = Tree(tmp_path / "d")
    shutil.copytree(world[1].root, tree.root)
    with pytest.raises(DataError, match="has no model edge/cnn"):
        library.load_model("d", "edge", project=tree.root)
    with pytest.raises(DataError, match=r"is not a model of 'e'\. Use the name 'd'"):
        library.load_model("e", *KEY, project=tree.root)
    flip(tree / "models/edge/knn/model.skops")
    with pytest.raises(DataError, match=r"model.skops: its bytes are not those of SHA256SUMS"):
        library.load_model("d", *KEY, project=tree.root)
    shutil.rmtree(tree.root / "models")
    write_bytes(tree / tree.SUMS, checksums_bytes(tree.root))
    (tmp_path / "elsewhere/datasets").mkdir(parents=True)
    with pytest.raises(DataError, match=r"names no model\. Fetch without --with-models"):
        fetch(Paths(tmp_path / "elsewhere"), str(tree.root), with_models=True)


def test_models_that_are_missing_or_outdated_are_not_published(
    trained, ajgdata, tmp_path, monkeypatch
):
    project = Project(Paths(tmp_path / "copy"))
    shutil.copytree(trained.root, project.root)
    monkeypatch.chdir(project.root)
    about = project.paths.model("d", *KEY) / "model.json"
    content = json.loads(about.read_text())
    content["provenance"]["inputs_sha256"] = "0" * 64
    about.write_text(json.dumps(content))
    command = ("publish", "d", "--with-models")
    err = ajgdata(*command)[2]
    assert_one_line(err, "is of other features than the feature file. Run `ajgdata run d`")
    about.unlink()
    assert_one_line(ajgdata(*command)[2], "models/d/edge/knn: is not trained yet")
    content = yaml.safe_load(project.paths.dataset("d").read_text())
    project.declare(**content, final_models=False)
    remake(project)
    assert_one_line(ajgdata(*command)[2], "has no final model. Publish without --with-models")
    assert not project.paths.published("d").exists()
