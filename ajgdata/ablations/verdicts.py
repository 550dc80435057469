"""Tables of an ablation, verdicts on its hypotheses, and the reasons that follow.

Verdicts are given page by page (`with_verdicts`), because the correction for several tests needs
all tests of a page.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ajgdata.models import model_label
from ajgdata.report.comparison import Change, Reason
from ajgdata.report.format import column_title
from ajgdata.types.ablation import Ablation, Why
from ajgdata.types.table import Column, Table, table_of

METRIC_NAMES = {"rmse": "RMSE", "accuracy": "accuracy"}
SUPPORTED = "supported"
TRIALS = {
    "hypothesis": "Hypothesis", "change": "What was changed", "expected": "Then it should be",
    "model": "Model", "metric": "Metric", "before": "Before", "before_sd": "sd", "after": "After",
    "after_sd": "sd", "gain": "Gain", "gain_low": "from", "gain_high": "to", "p": "p",
    "of": "Rows of the paper",
}  # fmt: skip
#: Columns that `with_verdicts` adds.
VERDICT, CORRECTED_P = Column("verdict", "Verdict"), Column("p_holm", "p, corrected")


#: A metric of each fold.
Folds = tuple[float, ...]


class Measured(NamedTuple):
    """Folds of an ablation by model and variant (`quiet`, `quiet on:size_80dba`)."""

    metric: str
    unit: str
    folds: Mapping[str, Mapping[str, Folds]]


def trial_table(name: str, ablation: Ablation, measured: Measured) -> Table:
    """Return the tests of an ablation's hypotheses, one row per model, without verdicts."""
    rows = [
        _trial(ablation, why, model, measured) for model in measured.folds for why in ablation.why
    ]
    note = (
        f"{ablation.note} Mean and standard deviation over folds. Gain: improvement and its 95 %"
        " interval (of this test only), corrected for folds that share training grasps."
    )
    return table_of(name, ablation.title, rows, note.strip(), **TRIALS)


def _trial(ablation: Ablation, why: Why, model: str, measured: Measured) -> dict[str, Any]:
    """Return a row; a gain that cannot be tested has no interval and no p."""
    from ajgdata.evaluate.fold_tests import paired_fold_test

    before, after = (measured.folds[model][side] for side in (why.before, why.after))
    sides = (ablation.variants[side.partition(" on:")[0]] for side in (why.before, why.after))
    paired = all(side.split == "grouped" for side in sides)
    test = paired_fold_test(before, after, metric=measured.metric, paired=paired)
    return {
        "hypothesis": why.claim,
        "change": why.change,
        "expected": why.expected,
        "model": _label(model, measured),
        "metric": with_brackets(METRIC_NAMES[measured.metric], measured.unit),
        **_mean_sd("before", before),
        **_mean_sd("after", after),
        "gain": test.gain,
        "gain_low": test.low,
        "gain_high": test.high,
        "p": test.p,
        "of": " ".join(why.of),
    }


def _label(model: str, measured: Measured) -> str:
    return model_label(model, "classification" if measured.metric == "accuracy" else "regression")


def with_brackets(name: str, unit: str) -> str:
    """Return `RMSE (mm)`."""
    return f"{name} ({unit})" if unit else name


def _mean_sd(key: str, folds: Folds) -> dict[str, float]:
    return {key: float(np.mean(folds)), f"{key}_sd": float(np.std(folds, ddof=1))}


def value_table(name: str, ablation: Ablation, measured: Measured) -> Table:
    """Return the metric of every variant with every model, on everything that it is tested on."""
    rows = [
        {"model": _label(model, measured), "variant": variant, **_mean_sd("value", folds)}
        for model, own in measured.folds.items()
        for variant, folds in own.items()
    ]
    value = column_title(METRIC_NAMES[measured.metric], measured.unit)
    columns = {"model": "Model", "variant": "Variant", "value": value, "value_sd": "sd"}
    note = "Mean and standard deviation over folds."
    return table_of(f"{name}_values", f"{ablation.title}: all values", rows, note, **columns)


def with_verdicts(tables: Sequence[Table]) -> list[Table]:
    """Return the tables of a page, with a verdict on each trial.

    p values are corrected for the number of tests on the page (Holm).
    """
    from ajgdata.evaluate.fold_tests import LEVEL, holm, verdict

    tested = [row for table in tables if _is_tested(table) for row in table.rows]
    corrected = holm([math.nan if row["p"] is None else row["p"] for row in tested])
    p_of = {id(row): p for row, p in zip(tested, corrected, strict=True)}
    count = sum(not math.isnan(p) for p in corrected)
    note = (
        f" Supported: p < {LEVEL:g} in the expected direction, refuted: in the other; p is"
        f" corrected for the {count} tests on this page (Holm). Not testable: all folds differ by"
        " the same amount."
    )

    def judged(row: dict[str, Any]) -> dict[str, Any]:
        p = p_of[id(row)]
        answer = verdict(row["gain"], p, row["expected"])
        return row | {VERDICT.key: answer, CORRECTED_P.key: None if math.isnan(p) else p}

    return [
        replace(
            table,
            note=table.note + note,
            columns=(*table.columns[:3], VERDICT, *table.columns[3:], CORRECTED_P),
            rows=tuple(judged(row) for row in table.rows),
        )
        if _is_tested(table)
        else table
        for table in tables
    ]


def _is_tested(table: Table) -> bool:
    return {"p", "gain", "expected"} <= {column.key for column in table.columns}


def reasons_of(tables: Sequence[Table], page: str) -> list[Reason]:
    """Return the hypotheses of the tables that have verdicts, each with all its tests.

    They link to their table on the page `page`.
    """
    changes: dict[tuple[str, str, str], list[Change]] = {}
    for table in tables:
        for row in table.rows if VERDICT in table.columns else ():
            before, after = float(row["before"] or 0), float(row["after"] or 0)
            supported = row["verdict"] == SUPPORTED
            change = Change(str(row["change"]), str(row["model"]), before, after, supported)
            key = table.name, str(row["hypothesis"]), str(row["of"])
            changes.setdefault(key, []).append(change)
    return [
        Reason(tuple(of.split()), claim, f"{page}.html#{table}", tuple(tests))
        for (table, claim, of), tests in changes.items()
    ]
