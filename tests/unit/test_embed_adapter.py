"""From a store to measurements of an embedding, on spectra that a person can reason about."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from experiment_samples import with_task_settings
from sklearn.decomposition import PCA
from sklearn.metrics import silhouette_score

from ajgdata.embed.projections import REDUCERS, project
from ajgdata.experiments.base import Inputs, Outcome
from ajgdata.experiments.embedding import scores_by
from ajgdata.experiments.registry import load_experiment
from ajgdata.pipeline.train import train_embedding
from ajgdata.store.feature_array import frequency_axis
from ajgdata.store.features import (
    FeatureColumn,
    FeatureRows,
    Latents,
    read_latents,
    read_store,
    text_column,
    write_store,
)
from ajgdata.types import Embedding

BINS = 48
THINGS = 6
GRASPS = 6
SETTINGS = Embedding(
    supervision="by hand",
    target="kind",
    dimensions=(2, 3),
    shown=3,
    folds=2,
    inits=2,
    epochs=2,
)
KINDS = {"kind": "classification", "pose": "regression"}


def shard() -> FeatureRows:
    """Two recordings of each grasp: a peak says which thing, a level which grasp."""
    rng = np.random.default_rng(0)
    bins = np.arange(BINS)
    rows = []
    names = []
    for session in ("s1", "s2"):
        for thing in range(THINGS):
            for grasp in range(GRASPS):
                pose = rng.uniform(-1, 1)
                for _ in range(2):
                    peak = 1 + 2 * np.exp(-(((bins - 4 - 7 * thing) / 3) ** 2))
                    noise = rng.uniform(0.98, 1.02, BINS)
                    rows.append(peak * np.exp(0.3 * pose * bins / BINS) * noise)
                    kind = "low" if thing < THINGS / 2 else "high"
                    names.append((session, f"t{thing}", kind, f"{session}/{thing}.{grasp}", pose))
    session, thing, kind, grasp, pose = zip(*names, strict=True)
    columns = {
        "recording": text_column([f"r{n:04d}" for n in range(len(rows))]),
        "session_id": text_column(session),
        "object": text_column(thing),
        "kind": text_column(kind),
        "grasp_id": text_column(grasp),
        "pose": FeatureColumn(np.array(pose)),
    }
    feature = np.array(rows, np.float32)
    return FeatureRows(
        feature, (frequency_axis(bins * 21.5),), columns, {"source": "simulated", "data_set": "toy"}
    )


@pytest.fixture(scope="module")
def output(tmp_path_factory) -> Path:
    """A folder with the latents of one embedding, and what training took."""
    folder = tmp_path_factory.mktemp("embed")
    train(folder, shard())
    return folder


@pytest.fixture
def without_umap(monkeypatch):
    """PCA in place of UMAP, which compiles for half a minute; slow tests run UMAP."""
    for module in ("ajgdata.embed.projections", "ajgdata.evaluate.neighbours"):
        monkeypatch.setattr(
            f"{module}.make_reducer", lambda _, dimension, seed: PCA(dimension, random_state=seed)
        )


def measured(folder: Path, name: str) -> Outcome:
    """The outcome of an experiment on a folder's store and latents."""
    given = {
        "dataset": "toy",
        "task": "e",
        "target": "kind",
        "kind": "classification",
        "unit": "",
        "groups": SETTINGS.groups,
        "folds": SETTINGS.folds,
        "seed": 0,
        "kinds": KINDS,
    }
    given |= {"store": read_store(folder / "store.nc"), "training_cost": read(folder, "cost")}
    given["latents"] = read_latents(folder / "latents.nc")
    return load_experiment(name).measure(Inputs(**with_task_settings(given)), SETTINGS, "")


def table(outcome: Outcome, name: str):
    return next(item for item in (*outcome.tables, *outcome.cost) if item.name == name)


def of_scores(outcome: Outcome) -> dict:
    """Values of the table of scores by space, dimension, condition, metric and statistic."""
    keys = ("model", "dimension", "condition", "metric", "statistic")
    rows = table(outcome, "scores").rows
    values = {tuple(row[key] for key in keys): row["value"] for row in rows}
    assert len(values) == len(rows)
    return values


def read(folder: Path, name: str) -> dict:
    return json.loads((folder / f"{name}.json").read_text())


def train(folder: Path, rows: FeatureRows) -> Latents:
    store = folder / "store.nc"
    path = folder / "latents.nc"
    write_store(store, rows)
    train_embedding(store, settings=SETTINGS, seed=0, latents=path, cost=folder / "cost.json")
    return read_latents(path)


def test_latents_of_every_recording_by_every_network(output):
    latents = read_latents(output / "latents.nc")
    rows = 2 * THINGS * GRASPS * 2
    assert {d: z.shape for d, z in latents.latent.items()} == {
        2: (2, 2, rows, 2),
        3: (2, 2, rows, 3),
    }
    grasp = latents.columns["grasp_id"].values
    thing = latents.columns["object"].values
    for fold in range(2):  # no grasp on both sides, every thing on both
        new = latents.validation_fold == fold
        assert not set(grasp[new]) & set(grasp[~new])
        assert set(thing[new]) == set(thing[~new])
    cost = read(output, "cost")
    assert cost["networks"] == 2 * 2 * 2
    assert cost["cpu_s"] > 0


def test_classes_are_not_looked_at(output, tmp_path):
    """Class labels, and every other column but the log's, may say anything: nothing changes."""
    plain = shard()
    rng = np.random.default_rng(5)
    columns = {
        name: FeatureColumn(rng.permutation(column.values))
        if name not in ("recording", "object", "grasp_id")
        else column
        for name, column in plain.columns.items()
    }
    assert (columns["kind"].values != plain.columns["kind"].values).any()
    shuffled = train(tmp_path, dataclasses.replace(plain, columns=columns))
    before = read_latents(output / "latents.nc")
    for dimension in before.latent:
        assert shuffled.latent[dimension].tobytes() == before.latent[dimension].tobytes()
    assert np.array_equal(shuffled.validation_fold, before.validation_fold)


def test_distances_are_of_the_things_that_there_are(output):
    result = measured(output, "embedding_distances")
    keys = ("space", "first", "second")
    scores = scores_by(table(result, "categories"), keys, "distance")
    values = of_scores(result)
    assert len(scores) == 2 * 3  # spaces, pairs of classes
    for space, dimension, runs in (("latent", SETTINGS.shown, 4), ("raw", None, 2)):
        score = scores[space, "high", "low"]
        assert len(score.per_fold) == runs
        named = (space, dimension, "high to low", "distance")
        assert values[*named, "mean"] == pytest.approx(score.mean)
        assert values[*named, "sd"] == pytest.approx(score.sd)
        assert values[*named, "run 1"] == score.per_fold[1]


@pytest.mark.usefixtures("without_umap")
def test_neighbours_and_what_they_cost(output):
    result = measured(output, "embedding_knn")
    scores = scores_by(table(result, "knn"), ("space", "dimension"), "accuracy")
    methods = ("latent", "pca", "umap")
    assert list(scores) == [("raw", None), *((m, d) for m in methods for d in (2, 3))]
    times = table(result, "times")
    assert [(row["space"], row["dimension"]) for row in times.rows] == list(scores)
    assert result.about["chance"] == 0.5
    values = of_scores(result)
    raw = scores["raw", None].mean
    assert raw == scores["pca", 3].mean == scores["umap", 3].mean == 1.0
    for (space, dimension), score in scores.items():
        named = (space, dimension, "", "accuracy")
        assert values[*named, "mean"] == score.mean
        assert values[*named, "run 0"] == score.per_fold[0]
        assert values[*named, "chance"] == 0.5
    spent = read(output, "cost")
    assert times.rows[1]["fit_s"] == pytest.approx(spent["cpu_s"] / 8)
    assert {row["statistic"] for row in result.cost[0].rows} == {"cost"}
    keys = ("model", "dimension", "metric")
    cost = {tuple(row[key] for key in keys): row["value"] for row in result.cost[0].rows}
    assert cost["", None, "cpu_s"] == spent["cpu_s"]
    assert cost["latent", 2, "fit_s"] == times.rows[1]["fit_s"]
    assert cost["raw", None, "query_s"] == times.rows[0]["query_s"]


@pytest.mark.usefixtures("without_umap")
def test_projections_are_of_one_run_and_know_their_recordings(output):
    result = measured(output, "embedding_projections")
    latents = read_latents(output / "latents.nc")
    recordings = table(result, "recordings")
    points = table(result, "points")
    assert recordings.column("recording") == latents.columns["recording"].values.tolist()
    assert recordings.column("training") == (latents.validation_fold != 0).tolist()
    flat = points.where(space="latent", method="plane")
    plane = np.column_stack([flat.numbers("x"), flat.numbers("y")])
    np.testing.assert_allclose(plane, latents.latent[2][0, 0], rtol=1e-6)
    # a plane keeps part of the variance; of training points around their mean
    pca = points.where(space="latent", method="pca")
    rows = latents.validation_fold != 0
    plane = np.column_stack([pca.numbers("x"), pca.numbers("y")])[rows]
    assert plane.mean(axis=0) == pytest.approx(0, abs=1e-6)
    share = plane.var(axis=0).sum() / latents.latent[3][0, 0][rows].var(axis=0).sum()
    assert 2 / 3 < share <= 1 + 1e-6  # the two largest of three variances


# Projections: slow, because UMAP compiles for half a minute


cluster = np.repeat([0, 1, 2], 20)
TRAINING = np.arange(60) % 4 != 0


@pytest.fixture(scope="module")
def points():
    """Three clusters, ten times their width apart, in twelve dimensions."""
    rng = np.random.default_rng(0)
    centres = 10 * np.linalg.qr(rng.standard_normal((12, 12)))[0][:3]
    return (centres[cluster] + rng.standard_normal((60, 12)) / 3).astype(np.float32)


@pytest.fixture(scope="module")
def planes(points):
    return project(points, TRAINING, seed=3)


@pytest.mark.slow
def test_clusters_stay_clusters_with_the_points_that_were_not_learned_from(planes):
    assert list(planes) == list(REDUCERS)
    for name, plane in planes.items():
        assert plane.shape == (60, 2) and plane.dtype == np.float32
        # of two points of one cluster and one of another, the two are nearest: 0.5 is generous
        assert silhouette_score(plane, cluster) > 0.5, name
        centres = np.stack([plane[TRAINING & (cluster == k)].mean(axis=0) for k in range(3)])
        nearest = np.linalg.norm(plane[:, None] - centres, axis=2).argmin(axis=1)
        np.testing.assert_array_equal(nearest, cluster, err_msg=name)


@pytest.mark.slow
def test_what_is_held_out_teaches_nothing(points, planes):
    moved = points.copy()
    moved[~TRAINING] = moved[~TRAINING][::-1]
    again = project(moved, TRAINING, seed=3)
    for name in ("pca", "umap"):
        np.testing.assert_array_equal(again[name][TRAINING], planes[name][TRAINING], err_msg=name)
