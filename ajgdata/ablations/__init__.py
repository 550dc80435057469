"""Ablations: experiments on the same grasps, each of which could refute a hypothesis.

An ablation is a file `reports/ablations/<name>.yaml`: variants of one evaluation, and hypotheses on
their differences, which could explain why simulation and paper differ. Verdicts are given page by
page (`with_verdicts`), because the correction for several tests needs all tests of a page. Light:
Snakemake imports it.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ajgdata.paths import Paths
from ajgdata.report.comparison import Change, Reason
from ajgdata.store.files import read_model
from ajgdata.types.comparison import Ablation
from ajgdata.types.table import Column, Table, table_of

TRIALS = {
    "hypothesis": "Hypothesis", "change": "What was changed", "expected": "Then it should be",
    "model": "Model", "metric": "Metric", "before": "Before", "before_sd": "sd", "after": "After",
    "after_sd": "sd", "gain": "Gain", "gain_low": "from", "gain_high": "to", "p": "p",
    "of": "Rows of the paper",
}  # fmt: skip
#: Columns that `with_verdicts` adds.
HYPOTHESIS_VERDICT, CORRECTED_P = Column("verdict", "Verdict"), Column("p_holm", "p, corrected")
#: Metric of each fold, by model and by variant with what it is tested on (`quiet on:size_80dba`).
FoldMetrics = Mapping[str, Mapping[str, Sequence[float]]]


def read_ablations(paths: Paths) -> dict[str, Ablation]:
    """Return the ablations of a project by name. Raises DataError for a file that is wrong."""
    files = sorted(paths.ablation_settings.glob("*.yaml"))
    return {file.stem: read_model(file, Ablation) for file in files}


def possible(paths: Paths, simulated: Collection[str]) -> dict[str, Ablation]:
    """Return the ablations whose data sets are all among `simulated`."""
    ablations = read_ablations(paths).items()
    return {name: item for name, item in ablations if set(item.datasets) <= set(simulated)}


def trial_table(
    name: str, ablation: Ablation, folds: FoldMetrics, metric: str, unit: str = ""
) -> Table:
    """Return the tests of an ablation's hypotheses, one row per model, without verdicts.

    A gain that cannot be tested has no interval and no p.
    """
    from ajgdata.evaluate.fold_tests import paired_fold_test
    from ajgdata.models import model_label

    rows = []
    title = {"rmse": "RMSE", "accuracy": "accuracy"}[metric] + f" ({unit})" * bool(unit)
    for model, variants in folds.items():
        label = model_label(model, "classification" if metric == "accuracy" else "regression")
        for why in ablation.why:
            before, after = variants[why.before], variants[why.after]
            sides = (ablation.variants[s.partition(" on:")[0]] for s in (why.before, why.after))
            paired = all(side.split == "grouped" for side in sides)
            test = paired_fold_test(before, after, metric=metric, paired=paired)
            row: dict[str, Any] = {"hypothesis": why.claim, "change": why.change}
            row |= {"expected": why.expected}
            row |= {"model": label, "metric": title, "of": " ".join(why.of)}
            row |= _mean_sd("before", before) | _mean_sd("after", after)
            row |= {"gain": test.gain, "gain_low": test.low, "gain_high": test.high, "p": test.p}
            rows.append(row)
    note = (
        f"{ablation.note} Mean and standard deviation over folds. Gain: improvement and its 95 %"
        " interval (of this test only), corrected for folds that share training grasps."
    )
    return table_of(name, ablation.title, rows, note.strip(), **TRIALS)


def _mean_sd(key: str, folds: Sequence[float]) -> dict[str, Any]:
    return {key: float(np.mean(folds)), f"{key}_sd": float(np.std(folds, ddof=1))}


def with_verdicts(tables: Sequence[Table]) -> list[Table]:
    """Return the tables of a page, with a verdict on each trial.

    p values are corrected for the number of tests on the page (Holm). Tables that only say why an
    ablation was not possible stay as they are.
    """
    from ajgdata.evaluate.fold_tests import SIGNIFICANCE_LEVEL, holm, verdict

    p = np.concatenate([t.numbers("p") for t in tables if _is_tested(t)] or [np.array([])])
    count, corrected = int(np.isfinite(p).sum()), iter(holm(p.tolist()))
    note = (
        f" Supported: p < {SIGNIFICANCE_LEVEL:g} in the expected direction, refuted: in the other;"
        f" p is corrected for the {count} tests on this page (Holm). Not testable: all folds differ"
        " by the same amount."
    )

    def judged(row: dict[str, Any], p: float) -> dict[str, Any]:
        answer = verdict(row["gain"], p, row["expected"])
        return row | {
            HYPOTHESIS_VERDICT.key: answer,
            CORRECTED_P.key: None if math.isnan(p) else p,
        }

    return [
        replace(
            table,
            note=table.note + note,
            columns=(*table.columns[:3], HYPOTHESIS_VERDICT, *table.columns[3:], CORRECTED_P),
            rows=tuple(judged(row, next(corrected)) for row in table.rows),
        )
        if _is_tested(table)
        else table
        for table in tables
    ]


def _is_tested(table: Table) -> bool:
    return "p" in {column.key for column in table.columns}


def reasons_of(tables: Sequence[Table], page: str) -> list[Reason]:
    """Return the hypotheses of the tables that have verdicts, each with all its tests.

    They link to their table on the page `page`.
    """
    changes: dict[tuple[str, str, str], list[Change]] = {}
    for table in tables:
        for row in table.rows if HYPOTHESIS_VERDICT in table.columns else ():
            before, after = float(row["before"] or 0), float(row["after"] or 0)
            supported = row["verdict"] == "supported"
            change = Change(str(row["change"]), str(row["model"]), before, after, supported)
            key = table.name, str(row["hypothesis"]), str(row["of"])
            changes.setdefault(key, []).append(change)
    return [
        Reason(tuple(of.split()), claim, f"{page}.html#{table}", tuple(tests))
        for (table, claim, of), tests in changes.items()
    ]
