"""Hypotheses on variants: paired tests of fold values, verdicts, and causes for the report.

Verdicts are given page by page (`with_verdicts`), because the correction for several tests needs
all tests of a page.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ajgdata.evaluate.fold_tests import SIGNIFICANCE_LEVEL, holm, paired_fold_test, verdict
from ajgdata.evaluate.metrics import METRICS
from ajgdata.evaluate.parts import TRAINING_VALUES, WITHHELD_VALUES
from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.scores import SCORES, is_fold
from ajgdata.report.comparison import Change, Reason
from ajgdata.store.variants import VARIANTS
from ajgdata.types import Kind
from ajgdata.types.registry import model_label
from ajgdata.types.table import Column, Table, table_of
from ajgdata.types.variants import WITHHELD, Hypothesis, Variants

#: Page of the report on all hypotheses.
CAUSES_PAGE = "causes"
TESTS = {
    "hypothesis": "Hypothesis",
    "change": "What was changed",
    "expected": "Then it should be",
    "model": "Model",
    "metric": "Metric",
    "before": "Before",
    "before_sd": "sd",
    "after": "After",
    "after_sd": "sd",
    "gain": "Gain",
    "gain_low": "from",
    "gain_high": "to",
    "p": "p",
    "of": "Rows of the paper",
}
#: Columns that `with_verdicts` adds.
HYPOTHESIS_VERDICT = Column("verdict", "Verdict")
CORRECTED_P = Column("p_holm", "p, corrected")
TESTS_NOTE = (
    "Mean and standard deviation over folds. Gain: improvement and its 95 % interval (of this test"
    " only), corrected for folds that share training grasps."
)


def divided_by_page(
    results: Sequence[TaskResults],
) -> tuple[list[TaskResults], list[TaskResults]]:
    """Return the results for the pages of tasks, and those for the page on causes."""
    of_tasks = []
    of_causes = []
    for task in results:
        causes = []
        others = []
        for result in task.results:
            is_variants = task.experiment == VARIANTS
            if is_variants and task.settings.files[result.model].explains_differences:
                causes.append(result)
            else:
                others.append(result)
        if others:
            of_tasks.append(replace(task, results=tuple(others)))
        if causes:
            of_causes.append(replace(task, results=tuple(causes)))
    return of_tasks, of_causes


def cause_tables(results: Sequence[TaskResults]) -> list[Table]:
    """Return the tables of the page on causes, with verdicts, in the order of the files.

    `results` are those of files of variants that explain differences. Tables of tests are first.
    """
    tests = []
    grids = []
    for task in results:
        about = task.task_settings.kind, task.task_settings.unit
        for result in task.results:
            file = task.settings.files[result.model]
            scores = result.tables[SCORES]
            if file.hypotheses:
                tests.append(hypothesis_table(result.model, file, scores, *about))
            elif file.axis:
                grids.append(grid_table(result.model, file, scores, *about))
    by_name = sorted(tests, key=lambda table: table.name)
    return [*with_verdicts(by_name), *sorted(grids, key=lambda table: table.name)]


def hypothesis_table(name: str, file: Variants, scores: Table, kind: Kind, unit: str) -> Table:
    """Return the tests of the hypotheses of a file, one row per model, without verdicts.

    `scores` are the stored scores of the file, and `unit` is that of the target. A gain that cannot
    be tested has no interval and no p. A hypothesis without stored scores has no row.
    """
    metric = METRICS[kind][0]
    title = "accuracy" if kind == "classification" else "RMSE"
    if unit and metric == "rmse":
        title = f"{title} ({unit})"
    rows = []
    missing = 0
    for model in file.models:
        for hypothesis in file.hypotheses:
            before, after = (
                fold_values(scores, file, *side, model, metric) for side in hypothesis.sides
            )
            if not before or not after:
                missing += 1
                continue
            is_paired = _has_equal_folds(file, hypothesis)
            test = paired_fold_test(before, after, metric=metric, paired=is_paired)
            rows.append(
                {
                    "hypothesis": hypothesis.claim,
                    "change": hypothesis.change,
                    "expected": hypothesis.expected,
                    "model": model_label(model, kind),
                    "metric": title,
                    "before": float(np.mean(before)),
                    "before_sd": float(np.std(before, ddof=1)),
                    "after": float(np.mean(after)),
                    "after_sd": float(np.std(after, ddof=1)),
                    "gain": test.gain,
                    "gain_low": test.low,
                    "gain_high": test.high,
                    "p": test.p,
                    "of": " ".join(hypothesis.explains),
                }
            )
    note = f"{file.question} {file.note}".strip()
    if missing:
        note = f"{note} {missing} tests have no results yet: run `snakemake everything`."
    return table_of(name, file.title, rows, f"{note} {TESTS_NOTE}", **TESTS)


def fold_values(
    scores: Table, file: Variants, name: str, tested: str, model: str, metric: str
) -> list[float]:
    """Return the metric of each fold for a variant; none if it was not measured.

    `tested` is a data set, `withheld`, or "" for held-out grasps. `model` is a model of the file.
    """
    rows = tested_scores(scores, file, name, tested, model, metric).rows
    return [row["value"] for row in rows if is_fold(row["statistic"])]


def tested_scores(
    scores: Table, file: Variants, name: str, tested: str, model: str, metric: str
) -> Table:
    """Return the scores of a variant for one test; see `fold_values`."""
    change = file.variant(name).change
    is_elsewhere = tested not in ("", WITHHELD)
    return scores.where(
        condition=name,
        model=model if change.model is None else change.model,
        metric=metric,
        test_set=tested if is_elsewhere else file.held_out_set(change),
        target_values=WITHHELD_VALUES if tested == WITHHELD else TRAINING_VALUES,
    )


def _has_equal_folds(file: Variants, hypothesis: Hypothesis) -> bool:
    """Return whether both sides have the same folds: those of grasps."""
    return all(file.variant(name).change.split == "grouped" for name, _ in hypothesis.sides)


def grid_table(name: str, file: Variants, scores: Table, kind: Kind, unit: str) -> Table:
    """Return the errors of the first model over the axis of a file, by series and panel.

    These are the errors at withheld values if the task withholds some.
    """
    model = file.models[0]
    metric = METRICS[kind][0]
    is_withheld = WITHHELD_VALUES in scores.column("target_values")
    tested = WITHHELD if is_withheld else ""
    rows = []
    for variant in file.all_variants:
        named = (file, variant.name, tested, model, metric)
        folds = fold_values(scores, *named)
        if folds:
            (chance,) = tested_scores(scores, *named).where(statistic="chance").numbers("value")
            rows.append(
                {
                    "task": file.panel_of(variant),
                    "x": file.x(variant),
                    "series": file.series(variant),
                    "error": float(np.mean(folds)),
                    "sd": float(np.std(folds, ddof=1)),
                    "chance": chance,
                }
            )
    series = [key for key in file.vary if key not in (file.axis, file.panel)]
    title = "RMSE" if metric == "rmse" else "Accuracy"
    title = f"{title} at withheld values" if is_withheld else title
    columns = {
        "task": "Task",
        "x": file.axis,
        "series": " and ".join(series) or "Series",
        "error": f"{title}, {model_label(model, kind)}{f' ({unit})' if unit else ''}",
        "sd": "Standard deviation over folds",
        "chance": "Chance level",
    }
    return table_of(name, file.title, rows, f"{file.question} {file.note}".strip(), **columns)


def with_verdicts(tables: Sequence[Table]) -> list[Table]:
    """Return the tables of tests of a page, with a verdict on each test.

    p values are corrected for the number of tests on the page (Holm).
    """
    all_p = [p for table in tables for p in table.numbers("p").tolist()]
    corrected = iter(holm(all_p))
    count = int(np.isfinite(all_p).sum())
    note = (
        f" Supported: p < {SIGNIFICANCE_LEVEL:g} in the expected direction, refuted: in the other;"
        f" p is corrected for the {count} tests on this page (Holm). Not testable: all folds differ"
        " by the same amount."
    )

    def judged(row: dict[str, Any], p: float) -> dict[str, Any]:
        """Return a row with its corrected p value, and the verdict that follows from it."""
        answer = verdict(row["gain"], p, row["expected"])
        return row | {HYPOTHESIS_VERDICT.key: answer, CORRECTED_P.key: None if math.isnan(p) else p}

    return [
        replace(
            table,
            note=table.note + note,
            columns=(*table.columns[:3], HYPOTHESIS_VERDICT, *table.columns[3:], CORRECTED_P),
            rows=tuple(judged(row, next(corrected)) for row in table.rows),
        )
        for table in tables
    ]


def reasons_of(tables: Sequence[Table]) -> list[Reason]:
    """Return the hypotheses of the tables that have verdicts, each with all its tests."""
    changes: dict[tuple[str, str, str], list[Change]] = {}
    for table in tables:
        if HYPOTHESIS_VERDICT in table.columns:
            for row in table.rows:
                is_supported = row["verdict"] == "supported"
                before = float(row["before"] or 0)
                after = float(row["after"] or 0)
                change = Change(str(row["change"]), str(row["model"]), before, after, is_supported)
                key = table.name, str(row["hypothesis"]), str(row["of"])
                changes.setdefault(key, []).append(change)
    return [
        Reason(tuple(of.split()), claim, f"{CAUSES_PAGE}.html#{table}", tuple(tests))
        for (table, claim, of), tests in changes.items()
    ]
