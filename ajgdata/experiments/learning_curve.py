"""Learning curve: how many training grasps a model needs (paper: accuracy against poses)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from ajgdata.evaluate.agreement import Verdict
from ajgdata.evaluate.parts import GROUPED, part_columns
from ajgdata.experiments.base import Experiment, Inputs, Lookup, Outcome, TaskResults
from ajgdata.experiments.plots import Plot
from ajgdata.experiments.scores import ScoreKey, ScoreRow, score_table
from ajgdata.report.comparison import Mark, PaperComparison
from ajgdata.report.format import mean_sd, number, with_unit
from ajgdata.types import ModelName, Strict
from ajgdata.types.table import table_of

if TYPE_CHECKING:
    from ajgdata.report.marks import Point


class Settings(Strict):
    """Learning curve: training grasps per class, each number drawn `repeats` times."""

    groups: tuple[Annotated[int, Field(ge=1)], ...] = Field(
        min_length=2, description="numbers of training grasps per class"
    )
    repeats: int = Field(5, ge=2, description="draws of each number")
    models: tuple[ModelName, ...] = Field(
        ("cnn", "linear_plain", "knn_plain"), min_length=1, description="models that get a curve"
    )


def measure(inputs: Inputs, settings: Settings, model: str) -> Outcome:
    """Return the errors of `model` on the same grasps for each number of training grasps.

    `others` of the metadata are the numbers that failed, as text, with the reason.
    """
    from ajgdata.evaluate.few_grasps import learning_curve

    curve = learning_curve(
        inputs.data(), model=model, sizes=settings.groups, repeats=settings.repeats, **inputs.split,
    )  # fmt: skip
    points = curve.points
    key = ScoreKey(model, *part_columns(GROUPED, inputs.dataset))
    scores = (
        ScoreRow(metric, f"draw {point.repeat}", value, key._replace(grasps=point.groups))
        for point in points
        for metric, value in point.scores.items()
    )
    table_rows = (
        {"groups": p.groups, "draw": p.repeat, "recordings": p.recordings, "metric": metric}
        | {"value": value, "chance": p.chance[metric]}
        for p in points
        for metric, value in p.scores.items()
    )
    columns = {"groups": "Training grasps per class", "draw": "Draw", "recordings": "Recordings"}
    columns |= {"metric": "Metric", "value": "Value", "chance": "Chance"}
    title = "Learning curve"
    return Outcome(
        (score_table(scores, title), table_of("curve", title, table_rows, **columns)),
        about={"others": {str(size): why for size, why in curve.skipped.items()}},
    )


def missing(results: TaskResults) -> str:
    """Return which points of which curves failed, and why; "" if none did."""
    failed = [
        f"{result.label} with {size} ({why})"
        for result in results.results
        for size, why in result.about.get("others", {}).items()
    ]
    return f"Training grasps per class that failed: {'; '.join(failed)}." if failed else ""


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield how many grasps reach the accuracy that the paper names."""
    paper, first = results.paper, results.results[0]
    if paper is None or paper.value is None or paper.reached is None:
        return
    curve = _points(results, first.label)
    enough = [point.x for point in curve if point.score.mean >= paper.reached]
    needed = float(enough[0]) if enough else math.inf  # more than any that was tried
    tried = number(float(curve[-1].x))
    best = f"{mean_sd(curve[-1].score, results.shown_unit)} with {tried}"
    agrees: Verdict
    if enough:
        text = f"{number(needed)} ({best})"
        agrees = "agrees" if needed >= paper.value else "better"  # at least so many
    else:  # more than any that was tried, or never
        text = f"more than {tried} ({best})"
        agrees = "inconclusive"
    marks = (Mark("ours", needed, min(needed, float(curve[-1].x)), needed),)
    yield results.compared(paper, text, first.label, agrees, marks=marks)


CURVE = Plot(
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
    return sorted(CURVE.bind(results).points_with(model=label), key=lambda point: point.x)


def advice(results: TaskResults) -> Iterator[str]:
    """Yield what the last step of the first model's curve gained."""
    label = results.results[0].label
    curve = _points(results, label)
    if len(curve) > 1:
        before, after = curve[-2:]
        few, many = number(float(before.x)), number(float(after.x))
        last = with_unit(number(after.score.mean), results.shown_unit)
        values = f"{number(before.score.mean)} to {last}"
        grasps = f"With {many} instead of {few} training grasps per class"
        yield f"{grasps}, the {results.metric_title} of {label} changed from {values}."


EXPERIMENT = Experiment(
    name="learning_curve",
    order=30,
    title="Learning curve",
    settings=Settings,
    measure=measure,
    plots=(CURVE,),
    paper_comparison=paper_comparison,
    summary=missing,
    advice=advice,
    by_model=True,
)
