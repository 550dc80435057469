"""Cross-gripper: a task's models on other grippers, with a few of their grasps to calibrate."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field

from ajgdata.evaluate.agreement import together
from ajgdata.experiments.base import (
    METRIC_NAMES,
    Experiment,
    Inputs,
    Lookup,
    Outcome,
    TaskResults,
    score_table,
)
from ajgdata.experiments.cross_validation.results import PAPER_MODEL
from ajgdata.report.blocks import Illustration, ResultRow
from ajgdata.report.comparison import (
    Mark,
    PaperComparison,
    holds,
    mark_of,
    range_of,
)
from ajgdata.report.format import Caption, Score, mean_sd, number, with_unit, words
from ajgdata.report.panel import Highlight
from ajgdata.types import ModelName, Name, Strict
from ajgdata.types.table import Table, table_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class Settings(Strict):
    """The task on other grippers, with a few of their grasps added to the training."""

    test_on: tuple[Name, ...] = Field(min_length=1, description="data sets of the other grippers")
    grasps: tuple[Annotated[int, Field(ge=0)], ...] = Field(
        (0, 1, 2, 4), min_length=1, description="calibration grasps of each class, or value"
    )
    models: tuple[ModelName, ...] = Field(
        ("cnn", "linear_plain", "knn_plain"),
        min_length=1,
        description="models that are taken there",
    )


def measure(inputs: Inputs, settings: Settings, model: str) -> Outcome:
    """Return the errors of `model` on each other gripper for each number of calibration grasps."""
    from ajgdata.evaluate.cross_gripper import cross_gripper
    from ajgdata.evaluate.crossval import ExtraTestSet

    data = inputs.data()
    own = ExtraTestSet(data.feature, data.value, data.group)
    scores, rows = [], []
    for name in settings.test_on:
        theirs = inputs.data(name)
        other = ExtraTestSet(theirs.feature, theirs.value, theirs.group)
        points = cross_gripper(own, other, model=model, sizes=settings.grasps, **inputs.split)
        for point in points:
            part, fold = f"transfer:{name}:{point.grasps}", f"fold {point.fold}"
            for metric, value in point.scores.items():
                scores.append((model, part, metric, fold, value))
                row = {"other": name, "grasps": point.grasps, "fold": point.fold, "metric": metric}
                row |= {"value": value, "chance": point.chance[metric]}
                rows.append(row | {"home": point.home.get(metric), "recordings": point.recordings})
            for metric, value in point.home.items():
                scores.append((model, f"transfer:home:{name}", metric, fold, value))
    columns = {"other": "Other gripper", "grasps": "Calibration grasps", "fold": "Fold"}
    columns |= {"metric": "Metric", "value": "Value", "chance": "Chance", "home": "At home"}
    columns |= {"recordings": "Recordings"}
    title = "On another gripper"
    return Outcome((score_table(scores, title), table_of("folds", title, rows, **columns)))


class Line(NamedTuple):
    """One model on one other gripper: calibration grasps of each class (n,), mean and sd (n,) of
    the metric over folds; `home` (mean, sd) on the gripper that it was trained on, or NaN."""

    label: str
    dataset: str
    title: str
    grasps: np.ndarray
    mean: np.ndarray
    sd: np.ndarray
    home: Score
    chance: float


def lines_of(results: TaskResults) -> list[Line]:
    """Return every model on every other gripper, as it is shown; shares are in per cent."""
    return [
        _line(results, name, result.label, result.tables["folds"])
        for name in results.settings.test_on
        for result in results.results
    ]


def _line(results: TaskResults, name: str, label: str, table: Table) -> Line:
    chosen = table.where(other=name, metric=results.metric)
    by_size = chosen.parted("grasps")
    score = results.scale * np.array([by_size[size].numbers("value") for size in sorted(by_size)])
    home = results.scale * chosen.numbers("home")
    home = home[np.isfinite(home)]
    return Line(
        label=label,
        dataset=name,
        title=results.others[name].title,
        grasps=np.array(sorted(by_size)),
        mean=score.mean(axis=1),
        sd=score.std(axis=1, ddof=1),
        home=Score(home.mean(), home.std(ddof=1)) if len(home) > 1 else Score(np.nan, np.nan),
        chance=results.scale * float(chosen.numbers("chance").mean()),
    )


def rows(results: TaskResults) -> list[ResultRow]:
    """Return every model on every gripper, with few and many calibration grasps."""
    name = METRIC_NAMES[results.metric]
    return [
        ResultRow(
            line.label, f"{name} on {line.title}, {line.grasps[at]} calibration grasps",
            results.with_chance_note(
                _told(results, line.mean[at], line.sd[at]), line.mean[at], line.chance
            ),
            with_unit(number(line.chance), results.shown_unit), paper=results.paper,
        )
        for line in lines_of(results)
        for at in sorted({0, len(line.grasps) - 1})
    ]  # fmt: skip


def _told(results: TaskResults, mean: float, sd: float) -> str:
    return mean_sd(Score(mean, sd), results.shown_unit)


def finding(results: TaskResults) -> str:
    """Return the range over all grippers of the first model, without and with their grasps."""
    lines = [line for line in lines_of(results) if line.label == results.results[0].label]
    homes = [line.home.mean for line in lines if np.isfinite(line.home.mean)]
    home = f"{_about(results, float(np.mean(homes)))} at home, " if homes else ""
    few, most = lines[0].grasps[[0, -1]].tolist()
    first = _range(results, [line.mean[0] for line in lines])
    name = METRIC_NAMES[results.metric]
    grasps = f" with {few} grasps" if few else ""
    count = f"{len(lines)} other gripper{'s' * (len(lines) > 1)}"
    text = f"{lines[0].label}: {name} {home}{first} on {count}{grasps}"
    if few == most:
        return text
    last = _range(results, [line.mean[-1] for line in lines])
    return f"{text}, {last} with {most} of their grasps of each class"


def _range(results: TaskResults, values: list[float]) -> str:
    low, high = number(min(values), 2), number(max(values), 2)
    return with_unit(low if low == high else f"{low} to {high}", results.shown_unit)


def _about(results: TaskResults, value: float) -> str:
    return with_unit(number(value, 2), results.shown_unit)


def figure(results: TaskResults) -> Figure:
    """Return the metric against calibration grasps, a panel for each gripper; hollow: at home."""
    from ajgdata.report.canvas import WIDTH_IN, new_figure

    folds = len(set(results.results[0].tables["folds"].column("fold")))
    drawn = new_figure(
        (WIDTH_IN, 3.4),
        finding(results),
        f"{results.title}: mean ± sd over {folds} folds; hollow: on the gripper of the training",
        [results.source],
    )
    every = lines_of(results)
    panels = drawn.subplots(1, len(results.settings.test_on), sharey=True, squeeze=False)[0]
    for axes, name in zip(panels, results.settings.test_on, strict=True):
        _panel(axes, [line for line in every if line.dataset == name], axes is panels[-1])
    panels[0].set_ylim(bottom=0)  # of all panels, once all is drawn
    panels[0].set_ylabel(f"{METRIC_NAMES[results.metric]} ({results.shown_unit})")
    return drawn


def _panel(axes: Axes, lines: list[Line], last: bool) -> None:
    """Draw the models on one gripper; those of the `last` panel are named at their ends."""
    from ajgdata.report.canvas import model_line
    from ajgdata.report.labels import REFERENCES, label_end, reference_line

    grasps = lines[0].grasps
    home = float(grasps.min()) - max(1.0, 0.25 * float(np.ptp(grasps)))
    for i, line in enumerate(lines):
        style: dict[str, Any] = {**model_line(i), "capsize": 2.5}
        axes.errorbar(line.grasps, line.mean, line.sd, label=line.label, **style)
        if np.isfinite(line.home.mean):
            there = {**style, "ls": "", "mfc": "white"}
            axes.errorbar(home, line.home.mean, np.nan_to_num(line.home.sd), **there)
            ends = [line.home.mean, line.mean[0]]
            axes.plot([home, line.grasps[0]], ends, color=style["color"], lw=0.6, alpha=0.6)
        if last:
            label_end(
                axes, float(line.grasps[-1]), float(line.mean[-1]), line.label, style["color"]
            )
    if last:
        reference_line(axes, "chance", lines[0].chance, "chance")
    else:
        axes.axhline(lines[0].chance, label="chance", **REFERENCES["chance"])
    axes.set_title(lines[0].title)
    axes.set_xlabel("calibration grasps of each class")
    axes.set_xticks([home, *grasps], ["home", *map(str, grasps)])


def caption(results: TaskResults) -> Caption:
    """Return the caption of `figure`."""
    listed = "; ".join(_sentence(results, line) for line in lines_of(results))
    paper = f" The paper: {results.paper.text}." if results.paper else ""
    return Caption(
        f"Models of {results.title}, {results.source}, on recordings of another "
        f"gripper, and with a few of its grasps added to the training. What is tested is trained "
        f"on in neither gripper.{paper}",
        f"{finding(results)}. {listed}.",
    )


def _sentence(results: TaskResults, line: Line) -> str:
    reached = ", ".join(
        f"{_told(results, mean, sd)} with {count}"
        for count, mean, sd in zip(line.grasps, line.mean, line.sd, strict=True)
    )
    known = np.isfinite(line.home.mean)
    home = f"; at home {mean_sd(line.home, results.shown_unit)}" if known else ""
    return f"{line.label} on {line.title}: {reached}{home}"


def figures(results: TaskResults) -> list[Illustration]:
    """Return the figure of all models on all grippers."""
    return [Illustration(results.named(), caption(results), lambda: figure(results))]


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield the paper's model at home, and on each other gripper without calibration."""
    named = {result.label for result in results.results if result.model == PAPER_MODEL}
    lines = [line for line in lines_of(results) if not named or line.label in named]
    if results.paper is None or not lines:
        return
    sign = 1 if results.kind == "classification" else -1
    gaps = [Score(sign * (line.home.mean - line.mean[0]), line.home.sd) for line in lines]
    verdicts = {holds(gap) for gap in gaps}
    told = [f"{_told(results, line.mean[0], line.sd[0])} on {line.title}" for line in lines]
    home = mean_sd(lines[0].home, results.shown_unit)
    yield PaperComparison(
        results.paper, results.dataset, results.task, results.source,
        f"{home} where it was trained, {', '.join(told)}", lines[0].label, together(verdicts),
        marks=_marks(lines), label=words(results.dataset), shown_unit=results.shown_unit,
    )  # fmt: skip


def _marks(lines: list[Line]) -> tuple[Mark, ...]:
    """Return a model on the other grippers (mean and range of them), at home, and chance."""
    return (
        range_of("ours", "elsewhere", [line.mean[0] for line in lines]),
        mark_of("other", "at home", lines[0].home),
        mark_of("chance", "chance", Score(float(np.mean([line.chance for line in lines])), 0.0)),
    )


def highlights(results: TaskResults) -> list[Highlight]:
    """Return the first model on all other grippers, with the most and with the fewest grasps."""
    lines = [line for line in lines_of(results) if line.label == results.results[0].label]
    few, most = lines[0].grasps[[0, -1]].tolist()
    if few == most:
        return []
    marks = (
        range_of("ours", f"{most} grasps", [line.mean[-1] for line in lines]),
        range_of("other", f"{few} grasps" if few else "none", [line.mean[0] for line in lines]),
    )
    text = f"{lines[0].label}, {words(results.dataset)}, mean and range of {len(lines)} grippers"
    return [Highlight("Calibrated there", text, results.shown_unit, marks)]


EXPERIMENT = Experiment(
    name="cross_gripper",
    order=60,
    title="On other grippers",
    settings=Settings,
    measure=measure,
    figures=figures,
    rows=rows,
    highlights=highlights,
    paper_comparison=paper_comparison,
    by_model=True,
)
