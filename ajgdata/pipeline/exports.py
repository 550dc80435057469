"""Results and a report -> CSV files beside its figures."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ajgdata.experiments.base import SCORES, STATISTICS, TaskResults
from ajgdata.paths import TABLES
from ajgdata.pipeline.collect import IN_UNITS
from ajgdata.report.comparison import PaperComparison
from ajgdata.report.page import spectra_name
from ajgdata.report.render import Picture
from ajgdata.report.report_data import Report, Spectra
from ajgdata.store.files import replacing_folder, spreadsheet_cell, write_bytes
from ajgdata.types.table import Column, Table, Value, table_of

#: Tables of a whole report: all results, and those beside the paper.
RESULTS, BESIDE_PAPER = "results", "beside-paper"
RESULT_KEYS = ("dataset", "task", "source", "experiment", "model", "part", "metric", "unit")
PAPER_KEYS = (
    "figure", "where", "paper", "unit", "paper_text", "dataset", "task", "source", "model",
    "result", "split", "agrees", "train_s", "inference_ms_per_recording",
)  # fmt: skip
#: What is measured of a model, by its name in the results.
COSTS = ("train_s", "latency_s", "peak_rss_mb")


def write_exports(report: Report, results: Sequence[TaskResults], folder: Path) -> tuple[str, ...]:
    """Write every table of a report as CSV to `folder`, which is replaced as a whole.

    `results` are those that the report shows. Returns the names of the files without suffix.
    """
    tables = [*report_tables(report, results)]
    for one in results:
        tables += table_files(one).items()
    with replacing_folder(folder) as new:
        for name, table in tables:
            write_csv(new / f"{name}.csv", table)
    return tuple(name for name, _ in tables)


def write_csv(path: Path, table: Table) -> None:
    """Write one table as CSV: also those of studies and ablations, beside the figures of a page."""
    write_bytes(path, csv_of(table).encode())


def csv_of(table: Table) -> str:
    """Return a table as CSV with Unix line ends. Columns are headed by their keys, with the unit
    in brackets unless the key has it; numbers keep every digit."""
    heads = [_keyed(column) for column in table.columns]
    rows = [[row[column.key] for column in table.columns] for row in table.rows]
    text = io.StringIO(newline="")
    cells = [[spreadsheet_cell(cell) for cell in row] for row in (heads, *rows)]
    csv.writer(text, lineterminator="\n").writerows(cells)
    return text.getvalue()


def _keyed(column: Column) -> str:
    own = not column.unit or column.key.lower().endswith(f"_{column.unit.lower()}")
    return column.key if own else f"{column.key} ({column.unit})"


def table_files(results: TaskResults) -> dict[str, Table]:
    """Return the tables of an experiment on a task, by file name without suffix.

    Those of scores and costs are one, named like the experiment's main figure; others end in their
    own name.
    """
    base, parted = results.named(), len(results.results) > 1
    kept: dict[str, list[Table]] = {}
    for one in results.results:
        for table in (*one.tables.values(), *one.cost.values()):
            if table.rows:
                kept.setdefault(table.name, []).append(_of_model(table, one.model, parted))
    files: dict[str, Table] = {}
    for name, parts in kept.items():
        rows = tuple(row for part in parts for row in part.rows)
        files[base if name == SCORES else f"{base}--{_safe(name)}"] = replace(parts[0], rows=rows)
    return files


def with_tables(shown: Picture, names: Iterable[str]) -> Picture:
    """Return a picture that also links its table: the longest of `names` that its name begins
    with, else all results."""
    own = [name for name in names if re.match(rf"{re.escape(name)}(-|$)", shown.name)]
    table = max(own, key=len, default=RESULTS)
    return shown._replace(links={**shown.links, "csv": f"{TABLES}/{table}.csv"})


def _of_model(table: Table, model: str, parted: bool) -> Table:
    """Return a table with a column for the model, where several models have such a table."""
    if not parted or any(column.key == "model" for column in table.columns):
        return table
    rows = tuple({"model": model, **row} for row in table.rows)
    return replace(table, columns=(Column("model", "Model"), *table.columns), rows=rows)


def _safe(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9_]+", "-", name)


def report_tables(report: Report, results: Sequence[TaskResults]) -> Iterator[tuple[str, Table]]:
    """Yield the tables of a whole report by file name without suffix: all results, those beside
    the paper and the spectra, named like the figures of these."""
    yield RESULTS, results_table(results)
    if report.comparisons:
        yield BESIDE_PAPER, paper_table(report.comparisons)
    for one in report.datasets:
        if one.spectra is not None:
            yield spectra_name(one.name), _spectra_table(one.spectra)


def _spectra_table(spectra: Spectra) -> Table:
    """Return a row for each label and frequency."""
    rows = (
        {"group": label, "frequency_hz": hz, "mean": mean}
        for label, means in zip(spectra.labels, np.asarray(spectra.mean, float), strict=True)
        for hz, mean in zip(np.asarray(spectra.frequency_hz, float), means, strict=True)
    )
    heads = {"group": spectra.grouping, "frequency_hz": "Frequency, Hz", "mean": "Mean feature"}
    return table_of("spectra", "Mean feature", rows, **heads)


def results_table(results: Sequence[TaskResults]) -> Table:
    """Return every score that has a mean over folds, runs or draws: one a row, with its cost.

    Accuracies are shares, errors in the unit of the target; the cost is that of the grouped split,
    or of the same part where this has one of its own.
    """
    rows = []
    for one in results:
        for result in one.results:
            costs = _values(result.cost.get(SCORES))
            for (model, part, metric), found in _values(result.tables.get(SCORES)).items():
                if "mean" not in found:
                    continue
                paid = {name: _cost(costs, model, part, name) for name in COSTS}
                where = {"dataset": one.dataset, "task": one.task, "source": one.source}
                where |= {"experiment": one.experiment, "model": model, "part": part}
                unit = one.unit if metric in IN_UNITS else ""
                statistics = {name: found.get(name) for name in STATISTICS}
                rows.append({**where, "metric": metric, "unit": unit, **statistics, **paid})
    heads = {key: key for key in (*RESULT_KEYS, *STATISTICS, *COSTS)}
    return table_of(RESULTS, "All results", rows, **heads)


def _values(scores: Table | None) -> dict[tuple[str, str, str], dict[str, Value]]:
    """Return the values of a table of scores by statistic, by model, part and metric."""
    found: dict[tuple[str, str, str], dict[str, Value]] = {}
    for row in scores.rows if scores else ():
        key = row["model"], row["part"], row["metric"]
        found.setdefault(key, {})[row["statistic"]] = row["value"]
    return found


def _cost(
    costs: Mapping[tuple[str, str, str], Mapping[str, Value]], model: str, part: str, name: str
) -> Value:
    for paid in (part, "grouped"):
        if measured := costs.get((model, f"cost of {paid}", name)):
            return measured.get("measured")
    return None


def paper_table(rows: Sequence[PaperComparison]) -> Table:
    """Return what stands beside the paper, a row for each of its figures and each data set."""
    cells = (
        {
            "figure": row.paper.id,
            "where": row.paper.where,
            "paper": row.paper.value,
            "unit": row.paper.unit,
            "paper_text": row.paper.text,
            "dataset": row.dataset,
            "task": row.task,
            "source": row.source,
            "model": row.model,
            "result": row.result,
            "split": row.split,
            "agrees": row.agrees,
            "train_s": row.cost.train_s if row.cost else None,
            "inference_ms_per_recording": row.cost.inference_ms_per_recording if row.cost else None,
        }
        for row in rows
    )
    return table_of(BESIDE_PAPER, "Beside the paper", cells, **{key: key for key in PAPER_KEYS})
