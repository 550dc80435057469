"""All results of a run -> one document and one table."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ajgdata.paths import Paths
from ajgdata.pipeline.embed_rows import found_in
from ajgdata.pipeline.experiments import documents_of, runs_of
from ajgdata.store.files import csv_bytes, json_bytes, read_json, write_bytes
from ajgdata.store.provenance import software
from ajgdata.store.sessions import read_dataset

COLUMNS = (
    "dataset", "task", "model", "source", "part", "metric", "statistic", "value", "unit", "seed",
    "commit",
)  # fmt: skip
#: Metrics that are in the unit of the target; others are shares, or have their unit in the name.
IN_UNITS = ("rmse", "mae")


def collect(
    paths: Paths,
    *,
    tasks: Sequence[tuple[str, str]],
    embeddings: Sequence[tuple[str, str]],
    document: Path,
    table: Path,
) -> None:
    """Write every result of `tasks` and `embeddings`, pairs of data set and name, into `document`
    (JSON), and its numbers, one a row, into `table` (CSV).

    A row is a metric of a part of an evaluation (`grouped`, `random`, `withheld`, `overall`,
    `on:<data set>`, `cost`): `statistic` is `fold 0` and so on, or mean, sd, pooled or chance. Of a
    learning curve the part is `curve:<groups per class>` and the statistic the draw; of settings of
    the STFT it is `stft:<window>/<hop>`, with the band in Hz if there is one. Of an embedding the
    task is its name after `embedding:`, the model the space, and the statistic the run, mean, sd
    or chance.
    """
    named = {dataset for dataset, _ in (*tasks, *embeddings)}
    specs = {name: read_dataset(paths, name) for name in named}
    evaluations = [
        {**_where(run), **read_json(paths.metrics(*run)), "cost": read_json(paths.cost(*run))}
        for run in runs_of(specs, tasks)
    ]
    further: dict[str, list[dict[str, Any]]] = {kind: [] for kind in ROWS}
    for one in documents_of(paths, specs, tasks):
        found = {"dataset": one.dataset, "task": one.task, **read_json(one.path)}
        if one.kind == "stft":
            found["cost"] = read_json(paths.stft_cost(one.dataset, one.task))
        further[one.kind].append(found)
    embedded = [
        {
            "dataset": dataset,
            "embedding": name,
            **{
                part: read_json(paths.embedding_document(dataset, name, part))
                for part in specs[dataset].embeddings[name].documents
            },
        }
        for dataset, name in embeddings
    ]
    content = {
        "software": software(), "evaluations": evaluations, **further, "embeddings": embedded
    }  # fmt: skip
    write_bytes(document, json_bytes(content))
    rows = [row for one in evaluations for row in _evaluation_rows(one)]
    for kind, documents in further.items():
        made = (document for document in documents if "skipped" not in document)
        rows += [row for document in made for row in ROWS[kind](document)]
    rows += [row for one in embedded for row in _embedding_rows(one)]
    write_bytes(table, csv_bytes(COLUMNS, rows))


def _embedding_rows(one: Mapping[str, Any]) -> Iterator[dict[str, object]]:
    """Documents of one run have one provenance; those on cost have none."""
    documents = {name: part for name, part in one.items() if isinstance(part, dict)}
    provenance = next(d["provenance"] for d in documents.values() if "provenance" in d)
    about = {
        "dataset": one["dataset"],
        "task": f"embedding:{one['embedding']}",
        "unit": "",
        "seed": provenance["seed"],
        "provenance": provenance,
    }
    for name, document in documents.items():
        for found in found_in(name, document):
            yield _row({**about, "model": found.space}, *found[1:])


def _where(run: tuple[str, str, str]) -> dict[str, str]:
    return dict(zip(("dataset", "task", "model"), run, strict=True))


def _row(
    one: Mapping[str, Any], part: str, metric: str, statistic: str, value: float | None
) -> dict[str, object]:
    return {
        "dataset": one["dataset"],
        "task": one["task"],
        "model": one["model"],
        "source": one["provenance"]["source"],
        "part": part,
        "metric": metric,
        "statistic": statistic,
        "value": "" if value is None else value,
        "unit": one["unit"] if metric in IN_UNITS else "",
        "seed": one["seed"],
        "commit": one["provenance"]["git_commit"],
    }


def _evaluation_rows(one: Mapping[str, Any]) -> Iterator[dict[str, object]]:
    parts = {k: v for k, v in one.items() if isinstance(v, dict) and "per_fold" in v}
    for part, scores in parts.items():
        for metric, values in scores["per_fold"].items():
            for fold, value in enumerate(values):
                yield _row(one, part, metric, f"fold {fold}", value)
            for statistic in ("mean", "sd", "pooled", "chance"):
                if statistic in scores:
                    yield _row(one, part, metric, statistic, scores[statistic][metric])
    for name, test in one["silent"].items():
        yield _row(one, f"silent:{name}", test["measure"], "pooled", test["value"])
        yield _row(one, f"silent:{name}", test["measure"], "chance", test["null"])
        yield _row(one, f"silent:{name}", "p", f"of {test['permutations']}", test["p"])
    for split, cost in one["cost"].items():
        for name, value in cost.items():
            if not isinstance(value, list):
                yield _row(one, f"cost of {split}", name, "measured", value)


def _curve_rows(one: Mapping[str, Any]) -> Iterator[dict[str, object]]:
    for point in one["points"]:
        for metric, value in point["scores"].items():
            part = f"curve:{point['groups']}"
            yield _row(one, part, metric, f"draw {point['repeat']}", value)


def _test_rows(one: Mapping[str, Any]) -> Iterator[dict[str, object]]:
    yield _row(one, "permutations", one["metric"], "pooled", one["value"])
    yield _row(one, "permutations", "p", f"of {len(one['null'])}", one["p"])


def _stft_rows(one: Mapping[str, Any]) -> Iterator[dict[str, object]]:
    for point, cost in zip(one["points"], one["cost"], strict=True):
        part = f"stft:{point['window']}/{point['hop']}"
        if point["band_hz"]:
            part += " {:g}-{:g} Hz".format(*point["band_hz"])
        for model, scores in point["models"].items():
            by_model = {**one, "model": model}
            for metric, values in scores["per_fold"].items():
                for fold, value in enumerate(values):
                    yield _row(by_model, part, metric, f"fold {fold}", value)
                for statistic in ("mean", "sd", "pooled", "chance"):
                    yield _row(by_model, part, metric, statistic, scores[statistic][metric])
            times = {"feature_s_per_recording": cost["feature_s_per_recording"]}
            for name, value in (times | cost["models"][model]).items():
                yield _row(by_model, f"cost of {part}", name, "measured", value)


def _sorting_rows(one: Mapping[str, Any]) -> Iterator[dict[str, object]]:
    for name in ("plain", "scaled"):
        part = one[name]
        yield _row(one, f"sorting, {name}", "accuracy", "pooled", part["accuracy"])
        error = part["calibration_error"]
        yield _row(one, f"sorting, {name}", "calibration_error", "pooled", error)
        for metric in ("share", "accuracy"):
            value = part["accepted"][metric]
            yield _row(one, f"sorting, {name}, accepted", metric, "pooled", value)
        for run, sorts in enumerate(part["sorts"]):
            yield _row(one, f"sorting, {name}", "sorts_in_a_row", f"run {run}", sorts)


def _energy_rows(one: Mapping[str, Any]) -> Iterator[dict[str, object]]:
    metric = f"energy relative to {one['reference']}"
    for part in one["parts"]:
        for statistic in ("mean", "sd"):
            yield _row(one, f"energy:{part['label']}", metric, statistic, part[statistic])
        for name, value in part["by_object"].items():
            yield _row(one, f"energy:{part['label']}", metric, f"mean of {name}", value)


def _transfer_rows(one: Mapping[str, Any]) -> Iterator[dict[str, object]]:
    for other, points in one["on"].items():
        for point in points:
            part = f"transfer:{other}:{point['grasps']}"
            for metric, value in point["scores"].items():
                yield _row(one, part, metric, f"fold {point['fold']}", value)
            for metric, value in point["home"].items():
                yield _row(one, f"transfer:home:{other}", metric, f"fold {point['fold']}", value)


#: Rows of each kind of further experiment, by its name in the document.
ROWS: dict[str, Callable[[Mapping[str, Any]], Iterator[dict[str, object]]]] = {
    "curves": _curve_rows,
    "permutations": _test_rows,
    "sorting": _sorting_rows,
    "stft": _stft_rows,
    "energies": _energy_rows,
    "transfers": _transfer_rows,
}
