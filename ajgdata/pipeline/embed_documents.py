"""The documents on an embedding (docs/embedding.md) -> what the page on it shows."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ajgdata.paths import Paths
from ajgdata.report.embedded import (
    Distances,
    Embedded,
    Moved,
    Neighbours,
    Picture,
    Pictured,
    Probe,
    Retrieval,
    Silhouette,
    Transfer,
)
from ajgdata.report.format import Score
from ajgdata.store.features import Shard, read_store
from ajgdata.store.files import read_json
from ajgdata.store.sessions import read_dataset
from ajgdata.types import DatasetSpec, Embedding

Document = Mapping[str, Any]


def read_embedded(paths: Paths, dataset: str, name: str, *, measured: bool) -> Embedded:
    """One embedding with its pictures, if it has any, and with what was `measured`."""
    spec, store = read_dataset(paths, dataset), read_store(paths.merged(dataset))
    settings = spec.embeddings[name]
    documents, shown = {}, None
    if measured:
        for key in settings.documents:
            documents[key] = read_json(paths.embedding_document(dataset, name, key))
    if not settings.base:
        projections = read_json(paths.projections(dataset, name))
        if "skipped" in projections:
            documents["projections"] = projections
        else:
            shown = pictured(projections, store, settings)
    return embedded(spec, name, str(store.attrs["source"]), documents, shown)


def embedded(
    spec: DatasetSpec,
    name: str,
    source: str,
    documents: Mapping[str, Document],
    shown: Pictured | None,
) -> Embedded:
    """One embedding from its documents by name; one that was skipped is told, not shown."""
    settings = spec.embeddings[name]
    made = {key: document for key, document in documents.items() if "skipped" not in document}
    parts: dict[str, Any] = {}
    if "knn" in made:
        costs = {(row["space"], row["dimension"]): row for row in made["knn_cost"]["rows"]}
        parts |= {
            "chance": _number(made["knn"]["chance"]),
            "neighbours": tuple(_neighbours(row, costs) for row in made["knn"]["rows"]),
        }
    if "distances" in made:
        spaces = made["distances"]["spaces"]
        parts["distances"] = tuple(_distances(key, one) for key, one in sorted(spaces.items()))
    if "probes" in made:
        parts["probes"] = _probes(made["probes"]["rows"])
        parts["silhouettes"] = tuple(
            Silhouette(row["space"], row["label"], _score(row))
            for row in made["probes"]["silhouette"]
        )
    if "retrieval" in made:
        parts["retrieval"] = tuple(
            Retrieval(row["space"], row["k"], row["gallery"], _score(row), _number(row["chance"]))
            for row in made["retrieval"]["rows"]
        )
    if "transfer" in made:
        parts["transfer"] = _transfer(made["transfer"])
        parts["transfer_s"] = made["transfer_cost"]["cpu_s"]
    if "cost" in made:
        parts["networks"] = made["cost"]["networks"]
        parts["training_s"] = made["cost"]["cpu_s"]
    skipped = {key: str(d["skipped"]) for key, d in documents.items() if "skipped" in d}
    title = spec.title or spec.name
    return Embedded(
        dataset=spec.name,
        name=name,
        title=title if len(spec.embeddings) == 1 else f"{title} · {name.replace('_', ' ')}",
        source="simulated" if source == "simulated" else "recorded",
        supervision=settings.supervision,
        settings=settings.model_dump(mode="json", exclude={"supervision"}),
        made_by=_made_by(made.values()),
        skipped=skipped,
        pictured=shown,
        **parts,
    )


def pictured(projections: Document, store: Shard, settings: Embedding) -> Pictured:
    """The pictures, with the columns of the store that say what each recording is.

    First the thing, then its category, then what is probed, the session and the grasp. Recordings
    of nothing have no picture.
    """
    place = {name: row for row, name in enumerate(store.columns["recording"].values.tolist())}
    rows = np.array([place[name] for name in projections["recording"]], int)
    first = settings.instance, settings.category or settings.target
    columns = dict.fromkeys((*first, *settings.probes, "session_id", settings.groups))
    return Pictured(
        recording=np.asarray(projections["recording"], np.str_),
        training=np.asarray(projections["training"], bool),
        columns={name: _column(store.columns[name].values[rows]) for name in columns},
        pictures=tuple(
            Picture(one["space"], one["method"], np.asarray(one["points"], float))
            for one in projections["pictures"]
        ),
    )


def _column(values: np.ndarray) -> np.ndarray:
    """Text or float64."""
    return values if values.dtype.kind == "U" else values.astype(float)


def _made_by(documents: Iterable[Document]) -> str:
    """Commits of the features behind the documents."""
    commits = {str(d["provenance"]["git_commit"]) for d in documents if "provenance" in d}
    return f"features of commit {', '.join(sorted(commits))}" if commits else "nothing"


def _number(value: float | None) -> float:
    """JSON has no NaN: null stands for it."""
    return math.nan if value is None else float(value)


def _score(row: Document) -> Score:
    runs = tuple(map(_number, row["per_run"]))
    return Score(_number(row["mean"]), _number(row["sd"]), runs)


def _neighbours(row: Document, costs: Mapping[tuple[str, int | None], Document]) -> Neighbours:
    key = row["space"], row["dimension"]
    cost = costs[key]
    ask_s = cost["transform_s"] + cost["query_s"]
    return Neighbours(*key, _score(row), cost["fit_s"], ask_s, cost["recordings"])


def _matrix(rows: Sequence[Sequence[float | None]], size: int) -> np.ndarray:
    return np.array([[_number(v) for v in row] for row in rows], float).reshape(size, size)


def _distances(space: str, one: Document) -> Distances:
    categories, objects, others = one["categories"], one["objects"], one["other_objects"]
    count = len(categories)
    return Distances(
        space=space,
        categories=tuple(categories),
        mean=_matrix(one["mean"], count),
        sd=_matrix(one["sd"], count),
        other=_matrix(others["mean"], count),
        other_sd=_matrix(others["sd"], count),
        objects=tuple(objects),
        object_category=tuple(one["object_category"]),
        object_mean=_matrix(one["object_mean"], len(objects)),
        per_run=np.array([_matrix(run, count) for run in one["per_run"]]),
    )


def _probes(rows: Sequence[Document]) -> tuple[Probe, ...]:
    """Without those that say nothing: a rank correlation of angles, for instance."""
    return tuple(
        Probe(
            row["space"], row["probe"], row["target"], row["split"], row["metric"],
            _score(row), _number(row["chance"]),
        )
        for row in rows
        if row["mean"] is not None
    )  # fmt: skip


def _transfer(document: Document) -> Transfer:
    return Transfer(
        training_grippers=tuple(document["training_grippers"]),
        held_out_grippers=tuple(document["held_out_grippers"]),
        dimension=document["dimension"],
        chance=_number(document["chance"]),
        rows=tuple(
            Moved(row["space"], row["gripper"], row["calibration"], _score(row))
            for row in document["rows"]
        ),
        within=tuple(
            Moved(row["space"], row["gripper"], None, _score(row)) for row in document["within"]
        ),
        probes=_probes(document["probes"]),
    )
