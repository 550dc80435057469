"""Learning curve: how many training grasps a model needs (paper: accuracy against poses)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import Field

from ajgdata.evaluate.agreement import Verdict
from ajgdata.experiments.base import (
    METRIC_NAMES,
    Experiment,
    Inputs,
    Lookup,
    Outcome,
    Result,
    TaskResults,
    score_table,
)
from ajgdata.report.blocks import Illustration
from ajgdata.report.comparison import Mark, PaperComparison
from ajgdata.report.format import Caption, Score, mean_sd, number, sentence, with_unit
from ajgdata.types import ModelName, Strict
from ajgdata.types.table import Table, table_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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

    `others` of what is told of the tables are the numbers that failed, as text, with the reason.
    """
    from ajgdata.evaluate.curves import learning_curve

    data = inputs.data()
    found = learning_curve(
        data.feature, data.value, data.group,
        model=model, sizes=settings.groups, repeats=settings.repeats, **inputs.split,
    )  # fmt: skip
    points = found.points
    scores = (
        (model, f"curve:{point.groups}", metric, f"draw {point.repeat}", value)
        for point in points
        for metric, value in point.scores.items()
    )
    curve = (
        {"groups": p.groups, "draw": p.repeat, "recordings": p.recordings, "metric": metric}
        | {"value": value, "chance": p.chance[metric]}
        for p in points
        for metric, value in p.scores.items()
    )
    columns = {"groups": "Training grasps per class", "draw": "Draw", "recordings": "Recordings"}
    columns |= {"metric": "Metric", "value": "Value", "chance": "Chance"}
    title = "Learning curve"
    return Outcome(
        (score_table(scores, title), table_of("curve", title, curve, **columns)),
        about={"others": {str(size): why for size, why in found.others.items()}},
    )


def curve_of(results: TaskResults, result: Result) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return training grasps per class (n,), and mean and sd (n,) over draws as they are shown."""
    by_size = result.tables["curve"].where(metric=results.metric).parted("groups")
    drawn = [results.scale * table.numbers("value") for table in by_size.values()]
    mean, sd = (np.array([f(values) for values in drawn]) for f in (np.mean, _deviation))
    return np.array(list(by_size)), mean, sd


def _deviation(values: np.ndarray) -> float:
    return float(values.std(ddof=1))


def _chance(results: TaskResults, table: Table) -> float:
    return results.scale * float(table.where(metric=results.metric).numbers("chance").mean())


def finding(results: TaskResults) -> str:
    """Return what the most grasps that all models were trained on reach with the best of them, and
    what its fewest did."""
    curves = [(result.label, *curve_of(results, result)[:2]) for result in results.results]
    end = min(groups[-1] for _, groups, _ in curves)
    reached = {label: mean[groups <= end] for label, groups, mean in curves}
    better = max if results.kind == "classification" else min
    label, groups, _ = better(curves, key=lambda curve: reached[curve[0]][-1])
    first, last = reached[label][0], reached[label][-1]
    few, most = (with_unit(number(value), results.shown_unit) for value in (first, last))
    falls = "rises" if last > first else "falls"
    return (
        f"{METRIC_NAMES[results.metric]} of {label} {falls} from {few} with {groups[0]} to {most} "
        f"with {groups[groups <= end][-1]} training grasps of each class"
    )


def figure(results: TaskResults) -> Figure:
    """Return the metric against the number of training grasps, mean ± sd over draws."""
    from ajgdata.report.canvas import WIDTH_IN, model_line, new_figure
    from ajgdata.report.labels import label_end, label_point, reference_line

    drawn = new_figure(
        (WIDTH_IN, 3.4),
        finding(results),
        f"{results.title}: mean ± sd over {results.settings.repeats} draws, on the same validation "
        "grasps",
        [results.source],
    )
    axes = drawn.subplots()
    for i, result in enumerate(results.results):
        groups, mean, sd = curve_of(results, result)
        style: dict[str, Any] = {**model_line(i), "capsize": 2.5}
        axes.errorbar(groups, mean, sd, label=result.label, **style)
        label_end(axes, groups[-1], mean[-1], result.label, style["color"])
    chance = _chance(results, results.results[0].tables["curve"])
    reference_line(axes, "chance", chance, "chance")
    paper = results.paper
    if paper is not None and paper.value is not None and paper.reached is not None:
        axes.plot(paper.value, paper.reached, "*", color="black", ms=9, ls="", label="paper")
        label_point(axes, paper.value, paper.reached, "the paper", "black")
    axes.set_xlabel("training grasps per class")
    axes.set_ylabel(f"{METRIC_NAMES[results.metric]} ({results.shown_unit})")
    axes.set_xticks(sorted(results.settings.groups))
    return drawn


def caption(results: TaskResults) -> Caption:
    """Return the caption of `figure`."""
    paper = f" The paper, on its real gripper: {results.paper.text}." if results.paper else ""
    listed = []
    for result in results.results:
        points = zip(*curve_of(results, result)[:2], strict=True)
        told = (f"{with_unit(number(m), results.shown_unit)} of {n}" for n, m in points)
        listed.append(f"{result.label}: {', '.join(told)}")
    return Caption(
        f"{results.title}, {results.source}: models trained on some grasps of each class "
        f"and tested on grasps that are always the same. Bars: one standard deviation over "
        f"{results.settings.repeats} draws of training grasps and seeds (of seeds alone where a "
        f"draw takes them all); other validation grasps would differ by more.{paper}",
        f"{sentence(finding(results))}. {'; '.join(listed)}.",
    )


def missing(results: TaskResults) -> str:
    """Return which points of which curves failed, and why; "" if none did."""
    failed = [
        f"{result.label} with {size} ({why})"
        for result in results.results
        for size, why in result.about.get("others", {}).items()
    ]
    return f"Training grasps per class that failed: {'; '.join(failed)}." if failed else ""


def figures(results: TaskResults) -> list[Illustration]:
    """Return the one figure of all models."""
    return [Illustration(results.named(), caption(results), lambda: figure(results))]


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield how many grasps reach the accuracy that the paper names."""
    paper, first = results.paper, results.results[0]
    if paper is None or paper.value is None or paper.reached is None:
        return
    groups, mean, sd = curve_of(results, first)
    enough = np.flatnonzero(mean >= paper.reached)
    needed = int(groups[enough[0]]) if len(enough) else math.inf  # more than any that was tried
    most = f"{mean_sd(Score(mean[-1], sd[-1]), results.shown_unit)} with {groups[-1]}"
    agrees: Verdict
    if len(enough):
        text = f"{needed} ({most})"
        agrees = "agrees" if needed >= paper.value else "better"  # at least so many
    else:  # more than any that was tried, or never
        text = f"more than {groups[-1]} ({most})"
        agrees = "inconclusive"
    yield PaperComparison(
        paper,
        results.dataset,
        results.task,
        results.source,
        text,
        first.label,
        agrees,
        marks=(Mark("ours", first.label, needed, min(needed, float(groups[-1])), needed),),
    )


EXPERIMENT = Experiment(
    name="learning_curve",
    order=30,
    title="Learning curve",
    settings=Settings,
    measure=measure,
    figures=figures,
    paper_comparison=paper_comparison,
    summary=missing,
    by_model=True,
)
