"""Prediction intervals: coverage and width on held-out grasps of the interval that is shipped.

The interval is prediction ± half width, exactly as a model in use states it (`evaluate.in_use`):
the half width is a quantile of residuals on inner folds of the training part. Grasps, not
recordings, are exchangeable, so each grasp has the same weight (Lee, Barber, Willett 2023, arXiv
2306.06342).
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import Field

from ajgdata.experiments.base import (
    SCORES,
    Experiment,
    Inputs,
    Outcome,
    Result,
    TaskResults,
    score_table,
)
from ajgdata.report.blocks import Illustration, ShownTable
from ajgdata.report.comparison import mark_of
from ajgdata.report.format import Caption, Score, mean_sd, number, with_unit
from ajgdata.report.panel import Highlight
from ajgdata.types import ModelName, Strict
from ajgdata.types.table import table_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


#: Stated coverage that intervals are usually made for.
USUAL = 0.9


class Settings(Strict):
    """Prediction intervals of stated coverage for a number."""

    coverages: tuple[Annotated[float, Field(gt=0, lt=1)], ...] = Field(
        (0.5, 0.8, 0.9, 0.95),
        min_length=1,
        description="shares of true values that intervals must contain",
    )
    models: tuple[ModelName, ...] = Field(
        ("linear", "knn"), min_length=1, description="models that get intervals"
    )


def measure(inputs: Inputs, settings: Settings, model: str) -> Outcome:
    """Return coverage and width of intervals on held-out grasps for each stated coverage."""
    from threadpoolctl import threadpool_limits

    from ajgdata.evaluate.in_use import FOLDS, half_width, held_out_residuals
    from ajgdata.evaluate.metrics import wrapped
    from ajgdata.evaluate.splits import grouped_folds
    from ajgdata.models import fit_named_model

    data, period = inputs.data(), inputs.period_deg
    x, y, group = data.feature, data.value, data.group
    folds = min(inputs.folds, len(np.unique(group)))
    scores, rows, spent = [], [], 0.0
    with threadpool_limits(limits=1):
        parts = grouped_folds(y, group, inputs.kind, folds, inputs.seed)
        for fold, (train, test) in enumerate(parts):
            begun = time.process_time()
            residual = held_out_residuals(
                x[train], y[train], group[train], model=model, seed=inputs.seed, period=period,
                folds=min(FOLDS, len(np.unique(group[train]))), limits=inputs.most_recordings,
            )  # fmt: skip
            fitted = fit_named_model(
                model, inputs.kind, x[train], y[train], group[train],
                seed=inputs.seed, period=period, limits=inputs.most_recordings,
            )  # fmt: skip
            away = np.abs(wrapped(y[test] - fitted.predict(x[test]), period))
            spent += time.process_time() - begun
            for coverage in settings.coverages:
                half = half_width(residual, group[train], coverage, period)
                held, width = float(np.mean(away <= half)), 2 * half
                part = f"intervals:{100 * coverage:g} %"
                scores += [(model, part, "coverage", f"fold {fold}", held)]
                scores += [(model, part, "width", f"fold {fold}", width)]
                rows.append({"coverage": coverage, "fold": fold, "held": held, "width": width})
    width_title = f"Width, {inputs.unit}" if inputs.unit else "Width"
    columns = {"coverage": "Stated", "fold": "Fold", "held": "Held", "width": width_title}
    title = "Conformal intervals"
    cost = [(model, "cost of intervals", "train_cpu_s", "measured", spent)]
    return Outcome(
        (score_table(scores, title), table_of("intervals", title, rows, **columns)),
        (score_table(cost, title),),
    )


def _scores(result: Result, key: str) -> list[Score]:
    """Return mean and sd over folds of `held` or `width` for each stated coverage.

    An interval without an end has an infinite width, and no spread.
    """
    parts = result.tables["intervals"].parted("coverage").values()
    values = [part.numbers(key) for part in parts]
    spread = [v.std(ddof=1) if len(v) > 1 and np.isfinite(v).all() else np.nan for v in values]
    return [Score(v.mean(), sd) for v, sd in zip(values, spread, strict=True)]


def finding(results: TaskResults) -> str:
    """Return what the intervals nearest to 90 % hold, and how wide they are."""
    at = int(np.argmin(np.abs(np.array(results.settings.coverages) - 0.9)))
    told = "; ".join(
        f"{result.label} {number(100 * _scores(result, 'held')[at].mean)} %, "
        f"{with_unit(number(_scores(result, 'width')[at].mean), results.unit)} wide"
        for result in results.results
    )
    return f"Intervals that shall hold {100 * results.settings.coverages[at]:g} % of truths: {told}"


def figure(results: TaskResults) -> Figure:
    """Return the share of truths held, and the width of intervals, against what was stated."""
    from ajgdata.report.canvas import WIDTH_IN, model_line, new_figure
    from ajgdata.report.labels import REFERENCES, label_end, label_point

    drawn = new_figure(
        (WIDTH_IN, 3.4),
        finding(results),
        f"{results.title}: shipped procedure, on held-out grasps; mean ± sd over folds",
        [results.source],
    )
    left, right = drawn.subplots(1, 2)
    stated = 100 * np.array(results.settings.coverages)
    left.plot([0, 100], [0, 100], label="as stated", **REFERENCES["ideal"])
    label_point(left, 30, 30, "as stated", REFERENCES["ideal"]["color"])
    for i, result in enumerate(results.results):
        style: dict[str, Any] = {**model_line(i), "capsize": 2.5}
        held, width = (np.array([s[:2] for s in _scores(result, k)]).T for k in ("held", "width"))
        left.errorbar(stated, 100 * held[0], 100 * held[1], label=result.label, **style)
        right.errorbar(stated, width[0], width[1], **style)
        last = int(np.argmax(stated))
        if np.isfinite(width[0][last]):
            label_end(right, stated[last], width[0][last], result.label, style["color"])
    left.set(xlabel="stated coverage (%)", ylabel="truths held (%)", xlim=(0, 102), ylim=(0, 104))
    right.set(xlabel="stated coverage (%)", ylabel=f"width of the interval ({results.unit})")
    right.set_ylim(bottom=0)
    return drawn


def caption(results: TaskResults) -> Caption:
    """Return the caption of `figure`."""
    listed = "; ".join(
        f"{result.label}: {_sentence(results, result)}" for result in results.results
    )
    return Caption(
        f"{results.title}, {results.source}: coverage and width of stated intervals on held-out "
        "grasps. The interval is prediction ± half width, exactly as a model in use states it; the "
        f"half width comes from inner folds of the training part. {listed}.",
        f"{finding(results)}. Truths held and width against stated coverage: {listed}.",
    )


def _sentence(results: TaskResults, result: Result) -> str:
    pairs = zip(
        results.settings.coverages, _scores(result, "held"), _scores(result, "width"), strict=True
    )
    return ", ".join(
        f"stated {100 * c:g} %, held {number(100 * held.mean)} %, "
        f"width {mean_sd(width, results.unit)}"
        for c, held, width in pairs
    )


def figures(results: TaskResults) -> list[Illustration]:
    """Return the one figure of all models."""
    return [Illustration(results.named(), caption(results), lambda: figure(results))]


def tables(results: TaskResults) -> list[ShownTable]:
    """Return coverage, width and run time of every model."""
    heads = ("Model", "Stated|", "Held|", "Width|", "Processor, s|")
    rows = []
    for result in results.results:
        spent = result.cost[SCORES].numbers("value")[0]
        each = zip(
            results.settings.coverages, _scores(result, "held"), _scores(result, "width"),
            strict=True,
        )  # fmt: skip
        rows += [
            (
                result.label, f"{100 * coverage:g} %", mean_sd(held, "%", 100),
                mean_sd(width, results.unit), number(spent),
            )
            for coverage, held, width in each
        ]  # fmt: skip
    told = "Truths held and width, mean ± sd over folds; time of all folds and coverages together."
    return [ShownTable(told, heads, tuple(rows))]


def highlights(results: TaskResults) -> list[Highlight]:
    """Return what intervals of the first model hold, where they are to hold as much as is usual."""
    place = int(np.argmin(np.abs(np.array(results.settings.coverages) - USUAL)))
    stated = 100 * results.settings.coverages[place]
    first = results.results[0]
    marks = (
        mark_of("ours", first.label, _scores(first, "held")[place], 100),
        mark_of("other", "stated", Score(stated, 0.0)),
    )
    said = f"truths held, {first.label}"
    return [Highlight("Coverage", said, "%", marks)]


EXPERIMENT = Experiment(
    name="conformal_intervals",
    order=35,
    title="Conformal intervals",
    settings=Settings,
    measure=measure,
    figures=figures,
    tables=tables,
    highlights=highlights,
    own_page=True,
    by_model=True,
    kinds=("regression",),
)
