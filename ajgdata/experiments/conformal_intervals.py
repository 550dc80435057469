"""Prediction intervals: coverage and width on held-out grasps of the interval that is shipped.

The interval is prediction ± half width, exactly as a model in use states it (`evaluate.in_use`):
the half width is a quantile of residuals on inner folds of the training part, in which each grasp
has the same weight (Lee, Barber, Willett 2023, arXiv 2306.06342).
"""

from __future__ import annotations

import time

import numpy as np
from threadpoolctl import threadpool_limits

from ajgdata.evaluate.in_use import half_width, held_out_residuals
from ajgdata.evaluate.metrics import wrapped
from ajgdata.evaluate.parts import GROUPED, part_columns
from ajgdata.evaluate.splits import grouped_folds
from ajgdata.experiments.base import Experiment, Inputs, Outcome
from ajgdata.experiments.built_in import BUILT_IN
from ajgdata.experiments.plots import Plot
from ajgdata.experiments.scores import ScoreKey, ScoreRow, fold_statistic, score_table
from ajgdata.experiments.settings import ConformalIntervalsSettings
from ajgdata.models import fit_named_model
from ajgdata.report.format import column_title
from ajgdata.store.metrics import COST
from ajgdata.types.table import table_of

TITLE = "Conformal intervals"
COVERAGE_COLUMNS = {"coverage": "Stated coverage", "fold": "Fold", "held": "Coverage"}


def measure(inputs: Inputs, settings: ConformalIntervalsSettings, model: str) -> Outcome:
    """Return coverage and width of intervals on held-out grasps for each stated coverage."""
    data = inputs.data()
    kind = inputs.task_settings.kind
    period = inputs.task_settings.period_deg
    x = data.feature
    y = data.value
    group = data.group
    scores = []
    rows = []
    spent = 0.0
    with threadpool_limits(limits=1):
        parts = grouped_folds(y, group, kind, inputs.fold_count(group), inputs.seed)
        for fold, (train, test) in enumerate(parts):
            begun = time.process_time()
            residual = held_out_residuals(
                x[train], y[train], group[train], model=model, seed=inputs.seed, period=period
            )
            fitted = fit_named_model(
                model,
                kind,
                x[train],
                y[train],
                group[train],
                seed=inputs.seed,
                period=period,
            )
            distance = np.abs(wrapped(y[test] - fitted.predict(x[test]), period))
            spent += time.process_time() - begun
            for coverage in settings.coverages:
                half = half_width(residual, group[train], coverage, period)
                held = float(np.mean(distance <= half))
                width = 2 * half
                key = ScoreKey(
                    model, *part_columns(GROUPED, inputs.dataset), condition=f"{100 * coverage:g} %"
                )
                scores.append(ScoreRow("coverage", fold_statistic(fold), held, key))
                scores.append(ScoreRow("width", fold_statistic(fold), width, key))
                rows.append({"coverage": coverage, "fold": fold, "held": held, "width": width})
    columns = COVERAGE_COLUMNS | {"width": column_title("Width", inputs.task_settings.unit)}
    cost = [ScoreRow("train_cpu_s", COST, spent, ScoreKey(model))]
    return Outcome(
        (score_table(scores, TITLE), table_of("intervals", TITLE, rows, **columns)),
        (score_table(cost, TITLE),),
    )


COVERAGE_PLOT = Plot(
    "lines",
    "intervals",
    "share of held-out grasps inside prediction ± half width, as a model in use states it",
    value="held",
    x="coverage",
    percent=("held", "coverage"),
    ideal=True,
)
WIDTH_PLOT = Plot(
    "lines",
    "intervals",
    "width of the intervals against their stated coverage",
    value="width",
    x="coverage",
    name="width",
)


EXPERIMENT = Experiment(
    BUILT_IN["conformal_intervals"],
    measure=measure,
    plots=(COVERAGE_PLOT, WIDTH_PLOT),
)
