"""Results of embeddings in one document and one table."""

import csv
import json

import embedding_samples
import pytest
import yaml

from ajgdata.paths import Paths
from ajgdata.pipeline.collect import collect
from ajgdata.pipeline.embed_rows import READERS
from ajgdata.store.files import json_bytes, write_bytes
from ajgdata.types import Embedding

DATASET, NAME = "d", "poses"
PROVENANCE = {**embedding_samples.PROVENANCE, "seed": 7}


def collected(folder, documents, **changes):
    """The document and the rows of one embedding."""
    paths = Paths(folder)
    declared = embedding_samples.declared(**changes).model_dump(mode="json", exclude_defaults=True)
    write_bytes(paths.dataset(DATASET), yaml.safe_dump(declared).encode())
    for name, content in documents.items():
        measured = {} if name.endswith("cost") else {"provenance": PROVENANCE}
        path = paths.embedding_document(DATASET, NAME, name)
        write_bytes(path, json_bytes({**content, **measured}))
    collect(
        paths, tasks=[], embeddings=[(DATASET, NAME)], document=paths.all_metrics,
        table=paths.metrics_table,
    )  # fmt: skip
    with paths.metrics_table.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    return json.loads(paths.all_metrics.read_bytes()), rows


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    return collected(tmp_path_factory.mktemp("collected"), embedding_samples.documents())


def values(rows, **wanted):
    found = [row for row in rows if wanted.items() <= row.items()]
    return {row["statistic"]: float(row["value"]) for row in found if row["value"]}


def test_a_row_for_every_run_with_its_seed_and_what_made_it(both):
    _, rows = both
    row = {"dataset": DATASET, "task": f"embedding:{NAME}", "model": "latent", "part": "knn:4"}
    found = values(rows, **row, metric="accuracy")
    mean = 0.6 - 0.2 / 4
    assert found == pytest.approx(
        {"run 0": mean - 0.1, "run 1": mean + 0.1, "mean": mean, "sd": 0.1 * 2**0.5, "chance": 0.25}
    )
    assert {(r["source"], r["seed"], r["commit"]) for r in rows} == {("simulated", "7", "abc1234")}


@pytest.mark.parametrize(
    ("part", "metric", "model", "statistic", "value"),
    [
        ("knn", "accuracy", "raw", "mean", 0.5),
        ("cost of knn:4", "fit_s", "latent", "measured", 4.0),
        ("cost of training", "cpu_s", "", "measured", 20.0),
        ("distances", "other to other", "raw", "run 1", 5.0),
        ("distances", "other to spherical", "latent", "mean", 3.0),
        ("distances, other objects", "spherical to spherical", "latent", "mean", 1.5),
        ("distances, objects", "apple to orange", "latent", "sd", 0.1),
        ("probe:unseen:knn", "r2 of angle_deg", "raw", "mean", -2.0),
        ("silhouette", "silhouette of object", "raw", "run 0", -0.2),
        ("retrieval:all", "precision at 5", "latent", "mean", 0.16),
    ],
)
def test_every_kind_of_measurement(both, part, metric, model, statistic, value):
    found = values(both[1], part=part, metric=metric, model=model)
    assert found[statistic] == pytest.approx(value)


def test_no_two_rows_say_the_same(both):
    told = [tuple(v for k, v in row.items() if k != "value") for row in both[1]]
    assert len(set(told)) == len(told)


def test_what_is_undefined_has_an_empty_cell(both):
    undefined = [r for r in both[1] if r["metric"] == "other to other" and not r["value"]]
    assert {r["part"] for r in undefined} == {"distances, other objects"}


def test_the_document_holds_what_the_table_holds(both):
    (one,) = both[0]["embeddings"]
    assert (one["dataset"], one["embedding"]) == (DATASET, NAME)
    assert {key for key in one if key in READERS} == set(embedding_samples.documents())
    assert one["retrieval"]["rows"] == embedding_samples.retrieval()["rows"]


def test_every_document_that_is_made_can_be_read():
    alone = Embedding(supervision="x", target="y")
    between = Embedding(supervision="x", target="y", base="z", held_out=("s",))
    assert {*alone.documents, *between.documents} == set(READERS)


def test_transfer_and_what_could_not_be_made(tmp_path):
    made = {"transfer": embedding_samples.transfer(), "transfer_cost": {"cpu_s": 3.0}}
    changes = {"base": "other", "held_out": ["tall"]}
    _, rows = collected(tmp_path, made, **changes)
    row = {"model": "gripper_latent", "metric": "accuracy"}
    assert values(rows, **row, part="transfer:tall:4")["mean"] == pytest.approx(0.8)
    assert values(rows, **row, part="transfer:tall:within")["run 0"] == pytest.approx(0.4)
    made["transfer"] = {"skipped": "there is no session 'tall'"}
    document, rows = collected(tmp_path, made, **changes)
    assert document["embeddings"][0]["transfer"]["skipped"].endswith("'tall'")
    assert [(r["metric"], r["value"]) for r in rows] == [("cpu_s", "3.0")]
