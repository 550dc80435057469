"""The documents on an embedding (docs/embedding.md) -> the numbers in them, one by one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

Document = Mapping[str, Any]
Matrix = Sequence[Sequence[float | None]]


class Found(NamedTuple):
    """One number: of which space ("" for all), which part of what was measured, and what of it."""

    space: str
    part: str
    metric: str
    statistic: str
    value: float | None


def found_in(name: str, document: Document) -> Iterator[Found]:
    """Every number of the document `name`; none of one that could not be made."""
    if "skipped" not in document:
        yield from READERS[name](document)


def _summary(row: Document, part: str, metric: str) -> Iterator[Found]:
    """Each run, their mean and sd, and chance if it is told."""
    for run, value in enumerate(row["per_run"]):
        yield Found(row["space"], part, metric, f"run {run}", value)
    for statistic in ("mean", "sd", "chance"):
        if statistic in row:
            yield Found(row["space"], part, metric, statistic, row[statistic])


def _at(row: Document) -> str:
    return "" if row["dimension"] is None else f":{row['dimension']}"


def _knn(document: Document) -> Iterator[Found]:
    for row in document["rows"]:
        part = f"knn{_at(row)}"
        yield from _summary({**row, "chance": document["chance"]}, part, "accuracy")
        for gain in ("gain_points", "gain_relative"):
            yield Found(row["space"], part, gain, "mean", row[gain])


def _knn_cost(document: Document) -> Iterator[Found]:
    for row in document["rows"]:
        for name in ("fit_s", "transform_s", "query_s"):
            yield Found(row["space"], f"cost of knn{_at(row)}", name, "measured", row[name])


def _cost(part: str) -> Callable[[Document], Iterator[Found]]:
    def read(document: Document) -> Iterator[Found]:
        for name, value in document.items():
            yield Found("", part, name, "measured", value)

    return read


def _distances(document: Document) -> Iterator[Found]:
    for space, one in document["spaces"].items():
        named = {"distances": one, "distances, other objects": one["other_objects"]}
        for part, matrices in named.items():
            parts = {"mean": matrices["mean"], "sd": matrices["sd"]}
            parts |= {f"run {run}": matrix for run, matrix in enumerate(matrices["per_run"])}
            yield from _pairs(space, part, one["categories"], parts)
        parts = {"mean": one["object_mean"], "sd": one["object_sd"]}
        yield from _pairs(space, "distances, objects", one["objects"], parts)


def _pairs(
    space: str, part: str, names: Sequence[str], matrices: Mapping[str, Matrix]
) -> Iterator[Found]:
    """The upper half of symmetric matrices."""
    for i, first in enumerate(names):
        for j, second in enumerate(names[i:], i):
            for statistic, matrix in matrices.items():
                yield Found(space, part, f"{first} to {second}", statistic, matrix[i][j])


def _probe_rows(document: Document) -> Iterator[Found]:
    for row in document["probes" if "probes" in document else "rows"]:
        part = f"probe:{row['split']}:{row['probe']}"
        yield from _summary(row, part, f"{row['metric']} of {row['target']}")


def _probes(document: Document) -> Iterator[Found]:
    yield from _probe_rows(document)
    for row in document["silhouette"]:
        yield from _summary(row, "silhouette", f"silhouette of {row['label']}")


def _retrieval(document: Document) -> Iterator[Found]:
    for row in document["rows"]:
        yield from _summary(row, f"retrieval:{row['gallery']}", f"precision at {row['k']}")


def _transfer(document: Document) -> Iterator[Found]:
    for row in document["rows"]:
        scored = {**row, "chance": document["chance"]}
        yield from _summary(scored, f"transfer:{row['gripper']}:{row['calibration']}", "accuracy")
    for row in document["within"]:
        yield from _summary(row, f"transfer:{row['gripper']}:within", "accuracy")
    yield from _probe_rows(document)


#: By the document's name.
READERS: dict[str, Callable[[Document], Iterator[Found]]] = {
    "cost": _cost("cost of training"),
    "knn": _knn,
    "knn_cost": _knn_cost,
    "distances": _distances,
    "probes": _probes,
    "retrieval": _retrieval,
    "transfer": _transfer,
    "transfer_cost": _cost("cost of transfer"),
}
