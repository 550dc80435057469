"""metrics.csv and predictions.csv: numbers and predictions of all experiments, without a report."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from ajgdata.evaluate.agreement import why_undefined
from ajgdata.experiments.requests import TaskKey, requests_for
from ajgdata.experiments.scores import PREDICTIONS, SCORES
from ajgdata.paths import Paths
from ajgdata.pipeline.task_results import Measurement, computed, measurements
from ajgdata.store.metrics import write_metrics, write_predictions
from ajgdata.store.sessions import read_dataset
from ajgdata.types.table import Table

#: Metrics in the unit of the target. Other metrics are shares, or have their unit in the name.
IN_UNITS = ("rmse", "mae", "width")


def collect(paths: Paths, *, datasets: Sequence[str], tasks: Sequence[TaskKey]) -> None:
    """Write the numbers and the predictions of all existing results of a project.

    `tasks` are the tasks and embeddings of the data sets, as data set and name.
    """
    specs = {name: read_dataset(paths, name) for name in datasets}
    requests = requests_for(specs, tasks)
    available, errors = measurements(paths, requests)
    for error in errors.values():
        print(error)  # the summary of the run repeats it
    keys = [key for request in computed(requests, available) for key in request.keys]
    collected = [available[key] for key in keys]
    write_metrics(paths.metrics_table, metric_rows(collected))
    write_predictions(paths.predictions, prediction_rows(collected))


def metric_rows(measured: Iterable[Measurement]) -> Iterator[dict[str, Any]]:
    """Yield the numbers of measurements as rows of `store.metrics`."""
    for about, tables, costs in measured:
        for table in (*tables, *costs):
            if table.name == SCORES:
                yield from _score_rows(about, table)


def _score_rows(about: Mapping[str, Any], scores: Table) -> Iterator[dict[str, Any]]:
    """Yield the rows of a table of scores, with facts about the measurement."""
    for row in scores.rows:
        reason = ""
        if row["value"] is None:
            reason = why_undefined(row["metric"], row["statistic"], row["condition"])
        yield {
            "dataset": about["dataset"],
            "task": about["task"],
            "experiment": about["experiment"],
            **row,
            "unit": about["unit"] if row["metric"] in IN_UNITS else "",
            "groups": about["groups"],
            "source": about["provenance"]["source"],
            "seed": about["seed"],
            "commit": about["provenance"]["git_commit"],
            "reason": reason,
        }


def prediction_rows(measured: Iterable[Measurement]) -> Iterator[dict[str, Any]]:
    """Yield the predictions of measurements: one row per recording, part and fold."""
    for about, tables, _ in measured:
        identity = {key: about[key] for key in ("dataset", "task", "model")}
        for table in tables:
            if table.name == PREDICTIONS:
                for row in table.rows:
                    yield {**identity, **row}
