"""All results of a run -> one table of numbers and one of predictions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ajgdata.evaluate.agreement import why_undefined
from ajgdata.experiments import EXPERIMENTS
from ajgdata.experiments.base import SCORES
from ajgdata.paths import Paths
from ajgdata.pipeline.experiments import JobKey
from ajgdata.store.files import csv_bytes, write_bytes
from ajgdata.store.tables import read_tables
from ajgdata.types.table import Table

COLUMNS = (
    "dataset", "task", "model", "source", "part", "metric", "statistic", "value", "unit", "seed",
    "commit",
)  # fmt: skip
#: Last: why there is no value.
REASON = "reason"
PREDICTION_COLUMNS = (
    "dataset", "task", "model", "recording", "split", "fold", "y_true", "y_pred", "probability",
)  # fmt: skip
#: Metrics that are in the unit of the target; others are shares, or have their unit in the name.
IN_UNITS = ("rmse", "mae", "width")
#: A table with a row for each recording.
PREDICTIONS = "predictions"


def collect(paths: Paths, documents: Sequence[JobKey]) -> list[dict[str, Any]]:
    """Write the results `documents` together; returns what is known about each.

    `metrics.csv` has a row for each number: a metric of a part of an experiment (`grouped`,
    `random`, `withheld`, `overall`, `on:<data set>`, `curve:<grasps per class>`,
    `stft:<window>/<hop>`, ...), with the statistic (`fold 0` and so on, or mean, sd, pooled,
    chance, measured). If a number is undefined, the value is empty and `reason` says why. For an
    embedding, the task is its name after `embedding:`, and the model is the space.
    `predictions.csv` has a row for each recording, split and fold.
    """
    collected, numbers, predicted = [], [], []
    for dataset, task, kind in documents:
        about, tables = read_tables(paths.experiment(dataset, task, kind))
        costs = read_tables(paths.experiment_cost(dataset, task, kind))[1]
        named = {table.name: table for table in tables}
        if held_out := named.get(PREDICTIONS):
            where = {key: about[key] for key in ("dataset", "task", "model")}
            predicted += [{**where, **row} for row in held_out.rows]
        collected.append({**about, "kind": kind})
        numbers += [row for table in (*tables, *costs) for row in _rows(about, table)]
    write_bytes(paths.metrics_table, csv_bytes((*COLUMNS, REASON), numbers))
    write_bytes(paths.predictions, csv_bytes(PREDICTION_COLUMNS, predicted))
    return collected


def _rows(about: Mapping[str, Any], table: Table) -> Iterator[dict[str, object]]:
    """Yield the numbers of a table of scores as rows of `COLUMNS`; other tables have none."""
    if table.name != SCORES:
        return
    of_embedding = EXPERIMENTS[about["experiment"]].of_embedding
    for row in table.rows:
        missing = row["value"] is None
        yield {
            "dataset": about["dataset"],
            "task": f"embedding:{about['task']}" if of_embedding else about["task"],
            "source": about["provenance"]["source"],
            **row,
            "value": "" if missing else row["value"],
            REASON: why_undefined(row["part"], row["metric"], row["statistic"]) if missing else "",
            "unit": about["unit"] if row["metric"] in IN_UNITS else "",
            "seed": about["seed"],
            "commit": about["provenance"]["git_commit"],
        }
