"""CSV files of a report: one table for each figure."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.scores import PREDICTIONS, SCORES
from ajgdata.paths import TABLES_FOLDER
from ajgdata.report.comparison import PaperComparison
from ajgdata.report.render import DrawnFigure
from ajgdata.report.report_data import Report
from ajgdata.store.files import csv_bytes, replacing_folder, write_bytes
from ajgdata.types.table import Column, Table, table_of

#: Table of the comparison with the paper.
PAPER_TABLE = "paper-comparison"


def write_exports(report: Report, results: Sequence[TaskResults], folder: Path) -> tuple[str, ...]:
    """Write every table of a report as CSV to `folder`, which is replaced as a whole.

    `results` are the results in the report. Return the names of the files without suffix.
    """
    tables: dict[str, Table] = {}
    if report.comparisons:
        tables[PAPER_TABLE] = paper_table(report.comparisons)
    for result in results:
        tables.update(table_files(result))
    for diagnosis in report.diagnoses:
        if diagnosis.plan:
            tables[diagnosis.plan_table.name] = diagnosis.plan_table
    for page in report.pages:
        for figure in page.figures:
            if figure.table is not None:
                tables[figure.name] = figure.table
    with replacing_folder(folder) as new:
        for name, table in tables.items():
            write_csv(new / f"{name}.csv", table)
    return tuple(tables)


def write_csv(path: Path, table: Table) -> None:
    """Write a table as CSV. Numbers keep every digit."""
    headers = {column.key: csv_header(column) for column in table.columns}
    rows = [{headers[key]: row[key] for key in headers} for row in table.rows]
    write_bytes(path, csv_bytes(list(headers.values()), rows))


def csv_header(column: Column) -> str:
    """Return the key of a column, with its unit in brackets unless the key ends with the unit.

    >>> csv_header(Column("error", "Error", "mm")), csv_header(Column("size_mm", "Size", "mm"))
    ('error (mm)', 'size_mm')
    """
    has_unit = not column.unit or column.key.lower().endswith(f"_{column.unit.lower()}")
    return column.key if has_unit else f"{column.key} ({column.unit})"


def table_files(results: TaskResults) -> dict[str, Table]:
    """Return the tables of an experiment on a task, by file name without suffix.

    Scores and costs are one table, with the name of the experiment's main figure. The names of
    other tables end in the name of the table. Predictions are only in predictions.csv.
    """
    base = results.named()
    has_models = len(results.results) > 1
    parts: dict[str, list[Table]] = {}
    for result in results.results:
        for table in (*result.tables.values(), *result.cost.values()):
            if table.rows and table.name != PREDICTIONS:
                own = _of_model(table, result.model, has_models)
                parts.setdefault(table.name, []).append(own)
    files: dict[str, Table] = {}
    for name, tables in parts.items():
        rows = tuple(row for table in tables for row in table.rows)
        file = base
        if name != SCORES:
            file += "--" + re.sub(r"[^A-Za-z0-9_]+", "-", name)
        files[file] = replace(tables[0], rows=rows)
    return files


def with_tables(shown: DrawnFigure, names: Iterable[str]) -> DrawnFigure:
    """Return a figure that also links its table, if there is one.

    This is the longest of the `names` with which the name of the figure begins.
    """
    own = [name for name in names if re.match(rf"{re.escape(name)}(-|$)", shown.name)]
    if not own:
        return shown
    table = f"{TABLES_FOLDER}/{max(own, key=len)}.csv"
    return shown._replace(links={**shown.links, "csv": table})


def _of_model(table: Table, model: str, has_models: bool) -> Table:
    """Return a table with a column for the model, if several models have the table."""
    if not has_models or any(column.key == "model" for column in table.columns):
        return table
    rows = tuple({"model": model, **row} for row in table.rows)
    return replace(table, columns=(Column("model", "Model"), *table.columns), rows=rows)


def paper_table(rows: Sequence[PaperComparison]) -> Table:
    """Return the comparison with the paper: a row per published value and data set."""
    cells = [
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
            "remark": row.remark,
            "split": row.split,
            "agrees": row.agrees,
            "train_cpu_s": row.cost.train_cpu_s if row.cost else None,
            "prediction_ms": row.cost.prediction_ms if row.cost else None,
        }
        for row in rows
    ]
    columns = {key: key for key in cells[0]}
    return table_of(PAPER_TABLE, "Comparison with the paper", cells, **columns)
