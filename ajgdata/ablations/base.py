"""The protocol of an ablation: data sets -> measure() -> tables -> figures, and verdicts.

Verdicts are given page by page (`with_verdicts`), because the correction for several tests needs
all tests of a page.

An ablation is one module that ends in `ABLATION = Ablation(...)`. Light: Snakemake imports it, so
matplotlib, SciPy's statistics and scikit-learn are imported inside functions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ajgdata.models import model_label
from ajgdata.report.blocks import TableFigure
from ajgdata.report.comparison import Change, Reason
from ajgdata.types import Kind
from ajgdata.types.table import Column, Table, Value

if TYPE_CHECKING:
    from ajgdata.ablations.data import AblationData
    from ajgdata.evaluate.crossval import CrossValidation
    from ajgdata.evaluate.paired_fold_test import Expected

METRIC_NAMES = {"rmse": "RMSE", "accuracy": "accuracy", "r2": "R²"}
SUPPORTED = "supported"
#: Columns of a table of trials.
TRIAL_COLUMNS = (
    Column("hypothesis", "Hypothesis"),
    Column("change", "What was changed"),
    Column("expected", "Then it should be"),
    Column("model", "Model"),
    Column("metric", "Metric"),
    Column("before", "Before"),
    Column("before_sd", "sd"),
    Column("after", "After"),
    Column("after_sd", "sd"),
    Column("gain", "Gain"),
    Column("gain_low", "from"),
    Column("gain_high", "to"),
    Column("p", "p"),
    Column("seconds", "Time", "s"),
    Column("of", "Rows of the paper"),
)


#: Columns that `with_verdicts` adds.
VERDICT = Column("verdict", "Verdict")
CORRECTED_P = Column("p_holm", "p, corrected")


class Folds(NamedTuple):
    """A metric of each fold, and the process seconds that training took."""

    values: tuple[float, ...]
    seconds: float


def folds_of(result: CrossValidation, metric: str, part: str | None = None) -> Folds:
    """Return `metric` of each fold, of the grasps held out or of a `part` of extra rows."""
    scores = result.scores if part is None else result.extra_tests[part].scores
    return Folds(scores.per_fold[metric], result.cost.train_cpu_s)


@dataclass(frozen=True)
class Hypothesis:
    """A reason why simulation and paper might differ in figures `of` the paper: if `claim` holds,
    `change` makes the result better, or worse, as `expected`."""

    of: tuple[str, ...]
    claim: str
    change: str
    expected: Expected = "better"


@dataclass(frozen=True)
class Trial:
    """A hypothesis put to the test with one model: fold values of `metric` before and after."""

    hypothesis: Hypothesis
    model: str
    metric: str
    unit: str
    before: Folds
    after: Folds
    paired: bool = True

    def row(self) -> dict[str, Value]:
        """Return its row of the table; a gain that cannot be tested has no interval and no p."""
        from ajgdata.evaluate.paired_fold_test import paired_fold_test

        before, after = self.before.values, self.after.values
        test = paired_fold_test(before, after, metric=self.metric, paired=self.paired)
        interval = {"gain_low": test.low, "gain_high": test.high, "p": test.p}
        kind: Kind = "classification" if self.metric == "accuracy" else "regression"
        unit = f" ({self.unit})" if self.unit else ""
        return {
            "hypothesis": self.hypothesis.claim,
            "change": self.hypothesis.change,
            "expected": self.hypothesis.expected,
            "model": model_label(self.model, kind),
            "metric": METRIC_NAMES[self.metric] + unit,
            "before": float(np.mean(before)),
            "before_sd": float(np.std(before, ddof=1)),
            "after": float(np.mean(after)),
            "after_sd": float(np.std(after, ddof=1)),
            "gain": test.gain,
            **{key: None if math.isnan(value) else value for key, value in interval.items()},
            "seconds": self.before.seconds + self.after.seconds,
            "of": " ".join(self.hypothesis.of),
        }


def trial_table(name: str, title: str, note: str, trials: Sequence[Trial]) -> Table:
    """Return the trials of an ablation as a table with one row per trial, without verdicts."""
    return Table(
        name,
        title,
        f"{note} Mean and standard deviation over folds, whose grasps were never trained on unless"
        " the change is the split. Gain: improvement and its 95 % interval (of this test only),"
        " corrected for folds that share training grasps. Time: training of both.",
        TRIAL_COLUMNS,
        tuple(trial.row() for trial in trials),
    )


def with_verdicts(tables: Sequence[Table]) -> list[Table]:
    """Return the tables of a page, with a verdict on each trial.

    p values are corrected for the number of tests on the page (Holm).
    """
    from ajgdata.evaluate.paired_fold_test import LEVEL, holm, verdict

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


@dataclass(frozen=True)
class Ablation:
    """One ablation: the data sets that it needs, how it is made, and what is drawn of its tables.

    `measure(data)` raises ValueError where data sets lack what it asks for.
    """

    name: str
    datasets: tuple[str, ...]
    measure: Callable[[AblationData], list[Table]]
    figures: tuple[TableFigure, ...] = ()


def reasons_of(tables: Sequence[Table], page: str) -> list[Reason]:
    """Return the hypotheses of the tables that have verdicts, each with all its tests.

    They link to their table on the page `page`.
    """
    changes: dict[tuple[str, str, str], list[Change]] = {}
    for table in tables:
        for row in table.rows if "verdict" in {c.key for c in table.columns} else ():
            before, after = float(row["before"] or 0), float(row["after"] or 0)
            supported = row["verdict"] == SUPPORTED
            change = Change(str(row["change"]), str(row["model"]), before, after, supported)
            key = table.name, str(row["hypothesis"]), str(row["of"])
            changes.setdefault(key, []).append(change)
    return [
        Reason(tuple(of.split()), claim, f"{page}.html#{table}", tuple(tests))
        for (table, claim, of), tests in changes.items()
    ]
