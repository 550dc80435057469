"""From a store to the documents of an embedding, on spectra that a person can reason about."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from ajgdata.pipeline.embed import logged_of, train_embedding
from ajgdata.pipeline.embed_measures import knn_task, measure_task
from ajgdata.pipeline.embed_transfer import transfer_task
from ajgdata.store.features import Column, Shard, text_column, write_store
from ajgdata.store.latents import open_latents, read_latents
from ajgdata.types import DataError, Embedding

BINS, THINGS, GRASPS = 48, 6, 6
SETTINGS = Embedding(
    supervision="by hand", target="kind", dimensions=(2, 3), shown=3, folds=3, inits=2, epochs=3,
    retrieval_folds=2,
    probes={"object": {}, "kind": {}, "pose": {"within": "object"}, "session_id": {}},
)  # fmt: skip
KINDS = {"kind": "classification", "pose": "regression"}


def shard(sessions=("s1",), tilt=0.0, references=0, seed=0) -> Shard:
    """Two recordings of each grasp: a peak says which thing, a level which grasp; a session tilts
    its spectra. References come without a peak."""
    rng, bins = np.random.default_rng(seed), np.arange(BINS)
    rows, names = [], []
    for number, session in enumerate(sessions):
        gripper = np.exp(-tilt * number * bins / BINS)
        for n in range(references):
            rows.append(gripper * rng.uniform(0.98, 1.02, BINS))
            names.append((session, "", "", f"{session}/empty{n}", 0.0))
        for thing in range(THINGS):
            for grasp in range(GRASPS):
                pose = rng.uniform(-1, 1)
                for _ in range(2):
                    peak = 1 + 2 * np.exp(-(((bins - 4 - 7 * thing) / 3) ** 2))
                    noise = rng.uniform(0.98, 1.02, BINS)
                    rows.append(gripper * peak * np.exp(0.3 * pose * bins / BINS) * noise)
                    kind = "low" if thing < THINGS / 2 else "high"
                    names.append((session, f"t{thing}", kind, f"{session}/{thing}.{grasp}", pose))
    session, thing, kind, grasp, pose = zip(*names, strict=True)
    columns = {
        "recording": text_column([f"r{n:04d}" for n in range(len(rows))]),
        "session_id": text_column(session), "object": text_column(thing),
        "kind": text_column(kind), "grasp_id": text_column(grasp), "pose": Column(np.array(pose)),
        "gripper": text_column([f"g-{s}" for s in session]), "medium": text_column(session),
    }  # fmt: skip
    feature = np.array(rows, np.float32)
    return Shard(feature, bins * 21.5, columns, {"source": "simulated", "data_set": "toy"})


def stored(path: Path, made: Shard) -> Path:
    write_store(path, made, {"units": "1"})
    return path


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """A folder with all documents of one embedding."""
    folder = tmp_path_factory.mktemp("embed")
    store = stored(folder / "store.nc", shard(sessions=("s1", "s2")))
    train_embedding(
        store, settings=SETTINGS, seed=0, latents=folder / "latents.nc", cost=folder / "cost.json"
    )
    measure_task(
        store, folder / "latents.nc", settings=SETTINGS, kinds=KINDS,
        distances=folder / "distances.json", probes=folder / "probes.json",
        retrieval=folder / "retrieval.json",
    )  # fmt: skip
    return folder


def read(folder: Path, name: str) -> dict:
    return json.loads((folder / f"{name}.json").read_text())


def train(folder: Path, made: Shard, settings: Embedding = SETTINGS, seed: int = 0):
    store = stored(folder / "store.nc", made)
    path = folder / "latents.nc"
    train_embedding(store, settings=settings, seed=seed, latents=path, cost=folder / "cost.json")
    return read_latents(path)


def test_latents_of_every_recording_by_every_network(made):
    found = read_latents(made / "latents.nc")
    rows = 2 * THINGS * GRASPS * 2
    assert {d: z.shape for d, z in found.latent.items()} == {
        2: (3, 2, rows, 2), 3: (3, 2, rows, 3),
    }  # fmt: skip
    assert found.unseen.shape == (2, 2, rows, 3)
    grasp, thing = found.columns["grasp_id"].values, found.columns["object"].values
    for fold in range(3):  # no grasp on both sides, every thing on both
        new = found.validation_fold == fold
        assert not set(grasp[new]) & set(grasp[~new])
        assert set(thing[new]) == set(thing[~new])
    for fold in range(2):
        new = found.unseen_fold == fold
        assert not set(thing[new]) & set(thing[~new])
    cost = read(made, "cost")
    assert cost["networks"] == 3 * 2 * 2 + 2 * 2
    assert cost["cpu_s"] > 0


def test_xarray_reads_them_with_labels(made):
    with open_latents(made / "latents.nc") as found:
        assert found["latent_3"].dims == ("fold", "init", "recording", "dimension_3")
        assert {"object", "validation_fold", "pose"} <= set(found.coords)
        assert set(found.data_vars) == {"latent_2", "latent_3", "unseen_3"}
        assert found.attrs["source"] == "simulated"
    with pytest.raises(DataError, match="have not been made"):
        open_latents(made / "none.nc")


def test_same_inputs_same_bytes(made, tmp_path):
    train(tmp_path, shard(sessions=("s1", "s2")))
    assert (tmp_path / "latents.nc").read_bytes() == (made / "latents.nc").read_bytes()


def test_classes_are_not_looked_at(made, tmp_path):
    """Class labels, and every other column but the log's, may say anything: nothing changes."""
    plain, rng = shard(sessions=("s1", "s2")), np.random.default_rng(5)
    columns = {
        name: Column(rng.permutation(column.values))
        if name not in ("recording", "object", "grasp_id")
        else column
        for name, column in plain.columns.items()
    }
    assert (columns["kind"].values != plain.columns["kind"].values).any()
    shuffled = train(tmp_path, dataclasses.replace(plain, columns=columns))
    before = read_latents(made / "latents.nc")
    for dimension in before.latent:
        assert shuffled.latent[dimension].tobytes() == before.latent[dimension].tobytes()
    assert shuffled.unseen.tobytes() == before.unseen.tobytes()
    assert np.array_equal(shuffled.validation_fold, before.validation_fold)


def test_things_are_looked_at(made, tmp_path):
    """The counterpart of the test above: with other things come other latents."""
    plain = shard(sessions=("s1", "s2"))
    turned = text_column(np.roll(plain.columns["object"].values, 2).tolist())
    columns = {**plain.columns, "object": turned}
    other = train(tmp_path, dataclasses.replace(plain, columns=columns))
    before = read_latents(made / "latents.nc")
    assert not np.allclose(other.latent[3], before.latent[3])


def test_documents_are_of_the_things_that_there_are(made):
    distances = read(made, "distances")
    assert distances["provenance"]["source"] == "simulated"
    assert distances["settings"]["supervision"] == "by hand"
    for space in ("latent", "raw"):
        one = distances["spaces"][space]
        assert one["categories"] == ["high", "low"]
        assert one["objects"] == [f"t{n}" for n in range(THINGS)]
        assert one["object_category"] == ["low"] * 3 + ["high"] * 3
        assert np.array(one["object_mean"]).shape == (THINGS, THINGS)
        assert np.array(one["per_run"]).shape == (6 if space == "latent" else 3, 2, 2)
    latent = np.array(distances["spaces"]["latent"]["object_mean"])
    others = ~np.eye(THINGS, dtype=bool)
    assert latent[~others].mean() < latent[others].mean()


def test_probes_read_what_is_there_to_be_read(made):
    rows = {
        (r["space"], r["split"], r["probe"], r["target"], r["metric"]): r
        for r in read(made, "probes")["rows"]
    }
    assert rows["raw", "grouped", "linear", "object", "accuracy"]["mean"] > 0.95
    assert rows["raw", "unseen", "linear", "pose", "r2"]["mean"] > 0.5
    assert rows["latent", "grouped", "knn", "kind", "accuracy"]["chance"] == 0.5
    assert len(rows["latent", "grouped", "knn", "kind", "accuracy"]["per_run"]) == 6
    splits = {(split, target) for _, split, _, target, _ in rows}
    assert ("unseen", "object") not in splits  # no probe can name what it never met
    assert ("grouped", "pose") not in splits


def test_retrieval_is_of_unseen_things(made):
    rows = {(r["space"], r["gallery"], r["k"]): r for r in read(made, "retrieval")["rows"]}
    raw = rows["raw", "unseen", 1]
    assert raw["mean"] > 0.9  # every thing has a peak of its own
    # three unseen things, 24 recordings of each; two of 72 are the query's own grasp
    assert raw["chance"] == pytest.approx(22 / 70)
    assert rows["raw", "all", 1]["chance"] == pytest.approx(22 / 142)


def test_neighbours_and_what_they_cost(made):
    knn_task(
        made / "store.nc", made / "latents.nc", made / "cost.json", settings=SETTINGS, seed=0,
        output=made / "knn.json", cost=made / "knn_cost.json",
    )  # fmt: skip
    found, cost = read(made, "knn"), read(made, "knn_cost")
    spaces = [(row["space"], row["dimension"]) for row in found["rows"]]
    methods = ("latent", "pca", "umap")
    assert spaces == [("raw", None), *((m, d) for m in methods for d in (2, 3))]
    assert spaces == [(row["space"], row["dimension"]) for row in cost["rows"]]
    assert found["chance"] == 0.5
    raw = found["rows"][0]["mean"]
    for row in found["rows"]:
        assert row["gain_points"] == pytest.approx(100 * (row["mean"] - raw))
        assert row["gain_relative"] == pytest.approx(row["mean"] / raw - 1)
        assert row["mean"] == pytest.approx(np.mean(row["per_run"]))
    share = read(made, "cost")["cpu_s"] / 16
    assert cost["rows"][1]["fit_s"] == pytest.approx(share)


def test_recordings_of_nothing_are_no_thing():
    made = shard(references=3)
    logged = logged_of(made, SETTINGS)
    assert len(logged.feature) == len(made.feature) - 3
    assert "" not in logged.instance


def test_folds_that_hold_out_things_train_nothing_twice(tmp_path):
    settings = SETTINGS.model_copy(update={"groups": "object"})
    found = train(tmp_path, shard(), settings)
    assert np.array_equal(found.unseen, found.latent[3])
    thing = found.columns["object"].values
    for fold in range(3):
        new = found.validation_fold == fold
        assert not set(thing[new]) & set(thing[~new])
    assert read(tmp_path, "cost")["networks"] == 3 * 2 * 2


def test_unseen_things_are_an_extra(tmp_path):
    settings = SETTINGS.model_copy(update={"retrieval_folds": 0, "epochs": 1})
    found = train(tmp_path, shard(), settings)
    assert found.unseen is None
    assert (found.unseen_fold == -1).all()
    outputs = {name: tmp_path / f"{name}.json" for name in ("distances", "probes", "retrieval")}
    measure_task(
        tmp_path / "store.nc", tmp_path / "latents.nc", settings=settings, kinds=KINDS, **outputs
    )
    assert "retrieval_folds is 0" in read(tmp_path, "retrieval")["skipped"]
    assert {row["split"] for row in read(tmp_path, "probes")["rows"]} == {"grouped"}


def test_what_cannot_be_trained_is_said(tmp_path):
    one = shard()
    rows = one.columns["object"].values == "t0"
    columns = {n: Column(c.values[rows], c.attrs) for n, c in one.columns.items()}
    alone = dataclasses.replace(one, feature=one.feature[rows], columns=columns)
    found = train(tmp_path, alone)
    assert "one thing" in found.attrs["skipped"]
    outputs = {name: tmp_path / f"{name}.json" for name in ("distances", "probes", "retrieval")}
    measure_task(
        tmp_path / "store.nc", tmp_path / "latents.nc", settings=SETTINGS, kinds=KINDS, **outputs
    )
    assert "one thing" in read(tmp_path, "probes")["skipped"]


def test_damaged_latents_are_named(tmp_path):
    path = tmp_path / "latents.nc"
    path.write_bytes(b"no file of ours")
    with pytest.raises(DataError, match="not a readable file of latents"):
        read_latents(path)


@pytest.fixture(scope="module")
def transferred(tmp_path_factory) -> dict:
    """Grippers that tilt every spectrum, the fourth more than any that was trained on."""
    folder = tmp_path_factory.mktemp("transfer")
    grippers = stored(folder / "g.nc", shard(("s0", "s1", "s2", "s3"), tilt=2.0, references=2))
    base = stored(folder / "b.nc", dataclasses.replace(
        shard(("s0",), seed=1), attrs={"source": "simulated"}
    ))  # fmt: skip
    settings = SETTINGS.model_copy(
        update={"base": "toy", "held_out": ("s3",), "epochs": 10, "probes": {}}
    )
    transfer_task(
        grippers, base, settings=settings, kinds=KINDS, seed=0,
        output=folder / "transfer.json", cost=folder / "transfer_cost.json",
    )  # fmt: skip
    assert read(folder, "transfer_cost")["cpu_s"] > 0
    return read(folder, "transfer")


def test_transfer_of_every_space_with_each_number_of_grasps(transferred):
    assert transferred["training_grippers"] == ["s0", "s1", "s2"]
    assert transferred["chance"] == pytest.approx(1 / THINGS)
    rows = {(r["space"], r["calibration"]): r for r in transferred["rows"]}
    assert {n for _, n in rows} == {0, 1, 2, 4}
    assert len(rows["raw", 0]["per_run"]) == 3  # draws
    assert len(rows["gripper_latent", 0]["per_run"]) == 3 * 2  # draws and initialisations


def test_a_reference_undoes_what_the_gripper_does(transferred):
    """Here a gripper multiplies each bin, and the recording of nothing holds just that factor."""
    rows = {(r["space"], r["calibration"]): r["mean"] for r in transferred["rows"]}
    assert rows["referenced", 0] > 0.95
    assert rows["raw", 0] < rows["referenced", 0]
    assert rows["raw", 4] > rows["raw", 0]


def test_references_that_are_missing_are_asked_for(tmp_path):
    store = stored(tmp_path / "g.nc", shard(("s0", "s1")))
    settings = SETTINGS.model_copy(update={"base": "toy", "held_out": ("s1",)})
    transfer_task(
        store, stored(tmp_path / "b.nc", shard(("s0",))), settings=settings, kinds=KINDS, seed=0,
        output=tmp_path / "transfer.json", cost=tmp_path / "transfer_cost.json",
    )  # fmt: skip
    assert "has no recording of nothing" in read(tmp_path, "transfer")["skipped"]
