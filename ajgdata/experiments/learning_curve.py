"""Learning curve: how many training grasps a model needs (paper: accuracy against poses)."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ajgdata.evaluate.agreement import Estimate, Interval, compare_with_published
from ajgdata.evaluate.few_grasps import grasps_needed, learning_curve
from ajgdata.evaluate.parts import GROUPED, part_columns
from ajgdata.experiments.base import Experiment, Inputs, Lookup, Outcome, Result, TaskResults
from ajgdata.experiments.built_in import BUILT_IN
from ajgdata.experiments.plots import Plot
from ajgdata.experiments.scores import ScoreKey, ScoreRow, score_table
from ajgdata.experiments.settings import LearningCurveSettings
from ajgdata.report.comparison import Mark, PaperComparison
from ajgdata.report.format import mean_sd, number, with_unit
from ajgdata.report.marks import Point
from ajgdata.types.table import table_of

#: Name of the table of correct recordings by held-out grasp.
HELD_OUT = "held_out"
CURVE_COLUMNS = {
    "groups": "Training grasps per class",
    "draw": "Draw",
    "recordings": "Recordings",
    "metric": "Metric",
    "value": "Value",
    "chance": "Chance",
}
GRASP_COLUMNS = {
    "groups": "Training grasps per class",
    "draw": "Draw",
    "grasp": "Held-out grasp",
    "correct": "Share of correct recordings",
}


def measure(inputs: Inputs, settings: LearningCurveSettings, model: str) -> Outcome:
    """Return the errors of `model` on the same grasps for each number of training grasps.

    `others` of the metadata are the numbers that failed, as text, with the reason.
    """
    curve = learning_curve(
        inputs.data(),
        kind=inputs.task_settings.kind,
        model=model,
        sizes=settings.groups,
        folds=inputs.task_settings.folds,
        repeats=settings.repeats,
        seed=inputs.seed,
        period=inputs.task_settings.period_deg,
    )
    points = curve.points
    key = ScoreKey(model, *part_columns(GROUPED, inputs.dataset))
    scores = (
        ScoreRow(metric, f"draw {point.repeat}", value, key._replace(grasps=point.groups))
        for point in points
        for metric, value in point.scores.items()
    )
    table_rows = (
        {
            "groups": point.groups,
            "draw": point.repeat,
            "recordings": point.recordings,
            "metric": metric,
            "value": value,
            "chance": point.chance[metric],
        }
        for point in points
        for metric, value in point.scores.items()
    )
    held_out = (
        {"groups": point.groups, "draw": point.repeat, "grasp": grasp, "correct": share}
        for point in points
        for grasp, share in point.correct.items()
    )
    title = "Learning curve"
    return Outcome(
        (
            score_table(scores, title),
            table_of("curve", title, table_rows, **CURVE_COLUMNS),
            table_of(HELD_OUT, "Held-out grasps", held_out, **GRASP_COLUMNS),
        ),
        about={"others": {str(size): why for size, why in curve.skipped.items()}},
    )


def missing(results: TaskResults) -> str:
    """Return which points of which curves failed, and why; "" if none did."""
    failed = [
        f"{result.label} with {size} ({why})"
        for result in results.results
        for size, why in result.about.get("others", {}).items()
    ]
    if not failed:
        return ""
    return f"Training grasps per class that failed: {'; '.join(failed)}."


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield the number of grasps that reach the published accuracy, with its interval.

    A number of grasps has no chance level. The interval is narrow if it is below a quarter of the
    published number.
    """
    paper = results.paper
    first = results.results[0]
    if paper is None or paper.value is None or paper.reached is None:
        return
    if results.task_settings.kind != "classification":
        return
    sizes, correct = correct_recordings(first)
    needed, interval = grasps_needed(sizes, correct, paper.reached / results.scale)
    tried = max(sizes)
    last = _points(results, first.label)[-1]
    best = f"{mean_sd(last.score, results.shown_unit)} with {number(tried)}"
    ends = f"{_count(interval.low, tried)} to {_count(interval.high, tried)}"
    text = f"{_count(needed, tried)} ({ends}); {best}"
    # A curve that does not reach the accuracy needs more grasps than were tried.
    known = Interval(min(interval.low, tried), interval.high)
    grasps = Estimate(needed, known, chance=paper.value, perfect=0.0)
    verdict = compare_with_published(grasps, paper.value)
    marks = (Mark("ours", needed, known.low, known.high),)
    yield results.compared(paper, text, first.label, verdict, marks=marks)


def correct_recordings(result: Result) -> tuple[list[int], np.ndarray]:
    """Return numbers of training grasps, and shares of correct recordings (sizes, draws, grasps).

    The shares are those of the held-out grasps, which are the same for all numbers and draws.
    """
    shares = {
        (row["groups"], row["draw"], row["grasp"]): row["correct"]
        for row in result.tables[HELD_OUT].rows
    }
    sizes, draws, grasps = (sorted({key[axis] for key in shares}) for axis in range(3))
    correct = [[[shares[s, d, g] for g in grasps] for d in draws] for s in sizes]
    return sizes, np.array(correct)


def _count(grasps: float, tried: int) -> str:
    """Return a number of grasps; one that was not reached is more than the largest number."""
    return number(grasps) if math.isfinite(grasps) else f"more than {number(tried)}"


CURVE_PLOT = Plot(
    "lines",
    "curve",
    "the same held-out grasps are predicted from more and more training grasps",
    x="groups",
    over="draws of training grasps and seeds",
    metric="metric",
    chance="chance",
    published="point",
)


def _points(results: TaskResults, label: str) -> list[Point]:
    """Return the curve of a model, from few to many training grasps."""
    return sorted(CURVE_PLOT.bind(results).points_with(model=label), key=lambda point: point.x)


def advice(results: TaskResults) -> Iterator[str]:
    """Yield what the last step of the first model's curve gained."""
    label = results.results[0].label
    curve = _points(results, label)
    if len(curve) > 1:
        before, after = curve[-2:]
        few = number(float(before.x))
        many = number(float(after.x))
        last = with_unit(number(after.score.mean), results.shown_unit)
        values = f"{number(before.score.mean)} to {last}"
        grasps = f"With {many} instead of {few} training grasps per class"
        yield f"{grasps}, the {results.metric_title} of {label} changed from {values}."


EXPERIMENT = Experiment(
    BUILT_IN["learning_curve"],
    measure=measure,
    plots=(CURVE_PLOT,),
    paper_comparison=paper_comparison,
    summary=missing,
    advice=advice,
)
