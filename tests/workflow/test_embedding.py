"""Embeddings as the workflow makes them: alone if asked for alone, again if a setting changes."""

import json

import pytest
import yaml
from conftest import DECLARATION, SESSIONS

from ajgdata.store.files import csv_bytes, read_csv

EMBEDDING = {
    "supervision": "by hand",
    "target": "pitch",
    "folds": 2,
    "inits": 1,
    "dimensions": [2],
    "shown": 2,
    "epochs": 1,
    "probes": {"pitch": {}},
}
NEW = {"embed": 1, "embed_knn": 1, "embed_measure": 1, "report_embedding": 1}


def declare(project, **changes):
    content = DECLARATION | {"embeddings": {"pitches": EMBEDDING | changes}}
    project.paths.dataset("tones").write_text(yaml.safe_dump(content))


def name_things(project):
    """Four things a session, of two grasps each."""
    for session in SESSIONS:
        path = project.folder(session) / "recordings.csv"
        header, rows = read_csv(path)
        named = [row | {"object": f"thing{int(row['recording_id']) % 4}"} for row in rows]
        path.write_bytes(csv_bytes(header, named))


def test_asked_for_alone_it_runs_what_it_needs(project):
    declare(project)
    assert project.planned("report_embedding") == NEW


@pytest.mark.slow
def test_documents_are_made_and_made_again(project):
    declare(project)
    name_things(project)
    project.snakemake("report_embedding")
    paths = project.paths
    knn = json.loads(paths.embedding_document("tones", "pitches", "knn").read_text())
    assert [row["space"] for row in knn["rows"]] == ["raw", "latent", "pca", "umap"]
    assert knn["provenance"]["source"] == "recorded"
    assert knn["settings"]["supervision"] == "by hand"
    assert project.planned("report_embedding") == {}
    declare(project, margin=2.0)
    assert project.planned("report_embedding") == NEW
