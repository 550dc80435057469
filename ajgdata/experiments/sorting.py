"""Sorting by sound, offline: objects in random order until none is probable enough."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from pydantic import Field

from ajgdata.evaluate.agreement import verdict_on_count
from ajgdata.experiments.base import (
    Experiment,
    Inputs,
    Lookup,
    Outcome,
    Result,
    TaskResults,
    score_table,
)
from ajgdata.report.blocks import Illustration, ShownTable
from ajgdata.report.comparison import Mark, PaperComparison, mark_of
from ajgdata.report.format import Caption, Score, number, sentence, with_unit
from ajgdata.report.panel import Highlight
from ajgdata.types import ModelName, Strict
from ajgdata.types.table import table_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RUNS = 500  #: simulated runs of sorting, each with its own seed
LONGEST_RUN = 1000  #: a run that never hesitates is ended here
#: What is told of a distribution: the 5th, 50th and 95th percentile.
PERCENTILES = (5, 50, 95)
PARTS = ("plain", "scaled")  #: probabilities as they are, and scaled by a temperature


class Settings(Strict):
    """Sorting by sound, offline: objects in random order until none is probable enough."""

    threshold: float = Field(0.6, gt=0, le=1, description="probability that is enough (paper)")
    models: tuple[ModelName, ...] = Field(("cnn",), min_length=1, description="models that sort")


def measure(inputs: Inputs, settings: Settings, model: str) -> Outcome:
    """Return the calibration of `model`, and runs of sorting what the task is about."""
    from ajgdata.evaluate.calibration import calibration_error, reliability
    from ajgdata.evaluate.in_use import calibrated
    from ajgdata.evaluate.sorting import accepted, decisions, sort_stream

    data = inputs.data()
    found = calibrated(
        data.feature, data.value, data.group, model=model, folds=inputs.folds, seed=inputs.seed
    )
    label = np.searchsorted(found.classes, data.value)
    scores: list[tuple[str, str, str, str, float]] = []
    bins: list[dict[str, Any]] = []
    runs: list[dict[str, Any]] = []
    for name, probability in zip(PARTS, (found.plain, found.scaled), strict=True):
        right = probability.argmax(axis=1) == label
        reliable = reliability(probability.max(axis=1), right)
        taken = decisions(probability, settings.threshold)
        passed = accepted(taken, label)
        part = f"sorting, {name}"
        scores += [
            (model, part, "accuracy", "pooled", right.mean()),
            (model, part, "calibration_error", "pooled", calibration_error(reliable)),
            (model, f"{part}, accepted", "share", "pooled", passed.share),
            (model, f"{part}, accepted", "accuracy", "pooled", passed.accuracy),
        ]
        bins += [{"part": name, **dataclasses.asdict(one)} for one in reliable]
        streams = (sort_stream(taken, label, inputs.seed + n) for n in range(RUNS))
        for n, run in enumerate(streams):
            scores.append((model, part, "sorts_in_a_row", f"run {n}", run.sorts))
            runs.append({"part": name, "run": n, **dataclasses.asdict(run)})
    title = "Sorting"
    fields = {field.name: field.name.replace("_", " ") for field in dataclasses.fields(reliable[0])}
    columns = {"part": "Part", "run": "Run", "sorts": "Sorts in a row", "mistakes": "Mistakes"}
    columns["before_mistake"] = "Before a mistake"
    return Outcome(
        (
            score_table(scores, title),
            table_of(
                "reliability", "Are predictions right as often as sure", bins, part="Part", **fields
            ),
            table_of("runs", "Simulated runs", runs, **columns),
        ),
        about={
            "temperatures": list(found.temperatures),
            "recordings": len(label),
            "objects": found.classes.tolist(),
        },
    )


class SortingPart(NamedTuple):
    """Sorting with one kind of probabilities: bins (n,), and objects sorted in each run (runs,)."""

    label: str
    confidence: np.ndarray
    right: np.ndarray
    accuracy: float
    calibration_error: float
    accepted_share: float
    accepted_accuracy: float
    sorts: np.ndarray
    before_mistake: np.ndarray


def parts_of(result: Result) -> list[SortingPart]:
    """Return sorting with probabilities as they are, and scaled by a temperature."""
    return [_part(result, name) for name in PARTS]


def _part(result: Result, name: str) -> SortingPart:
    scores, bins = result.tables["scores"], result.tables["reliability"].where(part=name)
    runs = result.tables["runs"].where(part=name)

    def score(part: str, metric: str) -> float:
        return float(scores.where(part=part, metric=metric).numbers("value")[0])

    return SortingPart(
        label="as they are" if name == "plain" else _scaled_label(result),
        confidence=bins.numbers("confidence"),
        right=bins.numbers("accuracy"),
        accuracy=score(f"sorting, {name}", "accuracy"),
        calibration_error=score(f"sorting, {name}", "calibration_error"),
        accepted_share=score(f"sorting, {name}, accepted", "share"),
        accepted_accuracy=score(f"sorting, {name}, accepted", "accuracy"),
        sorts=runs.numbers("sorts"),
        before_mistake=runs.numbers("before_mistake"),
    )


def _scaled_label(result: Result) -> str:
    from ajgdata.evaluate.calibration import TEMPERATURES

    temperatures = result.about["temperatures"]
    middle = float(np.median(temperatures))
    # where all grasps are told apart no temperature is too low
    at_end = sum(any(math.isclose(t, e, rel_tol=1e-3) for e in TEMPERATURES) for t in temperatures)
    ended = f", in {at_end} of {len(temperatures)} folds at the end of the search" if at_end else ""
    return f"scaled, temperature {middle:.2g}{ended}"


def spread(values: np.ndarray) -> str:
    """Return `12 (3 to 40)`: median, and the 5th and 95th percentile."""
    low, middle, high = np.percentile(values, PERCENTILES)
    return f"{number(middle)} ({number(low)} to {number(high)})"


def finding(results: TaskResults, result: Result) -> str:
    """Return how many objects are sorted in a row, and what scaling the probabilities does."""
    plain, scaled = (number(np.median(part.sorts)) for part in parts_of(result))
    paper = results.paper
    told = f"; the paper {number(paper.value)}" if paper and paper.value is not None else ""
    ended = "or more " if np.median(parts_of(result)[1].sorts) >= LONGEST_RUN else ""
    return (
        f"{result.label} sorts {plain} objects in a row in the middle run, {scaled} {ended}with "
        f"scaled probabilities{told}"
    )


def figure(results: TaskResults, result: Result) -> Figure:
    """Return the reliability diagram, and how many objects are sorted in a row."""
    from matplotlib.ticker import FuncFormatter

    from ajgdata.report.canvas import WIDTH_IN, model_line, new_figure
    from ajgdata.report.labels import REFERENCES, label_point, reference_line

    settings = results.settings
    drawn = new_figure(
        (WIDTH_IN, 3.5),
        finding(results, result),
        f"{results.title}: {len(result.about['objects'])} objects; a run stops where no class has "
        f"{100 * settings.threshold:g} %",
        [results.source],
    )
    left, right = drawn.subplots(1, 2)
    left.plot([0, 1], [0, 1], label="as it should be", **REFERENCES["ideal"])
    label_point(left, 0.3, 0.3, "as it should be", REFERENCES["ideal"]["color"])
    stops = f"stops below {100 * settings.threshold:g} %"
    reference_line(left, "chance", settings.threshold, stops, "x")
    for i, part in enumerate(parts_of(result)):
        style = {**model_line(i), "label": part.label}
        left.plot(part.confidence, part.right, **style)
        _share_of_runs(right, part, str(style["color"]), style["ls"])
    paper = results.paper
    if paper is not None and paper.value is not None:
        reference_line(right, "paper", paper.value, f"the paper: {number(paper.value)}", "x")
    left.set(xlabel="probability of the predicted class", ylabel="share that is right")
    left.set(xlim=(0, 1.02), ylim=(0, 1.02))
    right.set(xlabel="sorts in a row", ylabel="share of runs as long", xscale="symlog")
    right.xaxis.set_major_formatter(FuncFormatter(lambda n, _: number(n)))
    right.set_ylim(0, 1.02)
    right.set_xlim(left=0)
    return drawn


def _share_of_runs(axes: Axes, part: SortingPart, colour: str, dashes: Any) -> None:
    """Draw the share of the runs that reached each length, named after a quarter of them."""
    from ajgdata.report.labels import label_point

    lengths = np.sort(part.sorts)
    share = 1 - np.arange(len(lengths)) / len(lengths)
    style = {"color": colour, "ls": dashes, "label": part.label}
    axes.step(np.append(0, lengths), np.append(1, share), **style)
    label_point(axes, float(np.percentile(lengths, 25)), 0.75, part.label.partition(",")[0], colour)


def caption(results: TaskResults, result: Result) -> Caption:
    """Return the caption of `figure`."""
    parts, settings = parts_of(result), results.settings
    listed = "; ".join(
        f"{part.label}: {spread(part.sorts)} sorts in a row, calibration error "
        f"{number(part.calibration_error, 2)}, {number(100 * part.accepted_share)} % accepted"
        for part in parts
    )
    paper = f" The paper, live: {results.paper.text}." if results.paper else ""
    ended = [int(np.sum(part.sorts >= LONGEST_RUN)) for part in parts]
    return Caption(
        f"{result.label} trained on {', '.join(result.about['objects'])} alone "
        f"({results.source}). Left: are predictions right as often as they are sure? The "
        f"temperature is found on grasps held out of each fold's training part. Right: "
        f"{len(parts[0].sorts)} simulated runs in which held-out grasps come in random order until "
        f"none is {100 * settings.threshold:g} % sure; a run of {LONGEST_RUN:,} is ended there "
        f"({' and '.join(map(str, ended))} were).{paper}",
        f"{sentence(finding(results, result))}. Reliability and lengths of runs: {listed}.",
    )


def figures(results: TaskResults) -> list[Illustration]:
    """Return a figure for each model that sorts."""
    return [
        Illustration(results.named(one.model), caption(results, one), partial(figure, results, one))
        for one in results.results
    ]


def tables(results: TaskResults) -> list[ShownTable]:
    """Return calibration and runs of each model that sorts."""
    heads = (
        "Probabilities", "Calibration error|", "Accepted|", "Right of those|", "Sorts in a row|",
        "Before a mistake|",
    )  # fmt: skip
    shown = []
    for result in results.results:
        parts = parts_of(result)
        told = (
            f"{result.label} on {', '.join(result.about['objects'])}: accuracy "
            f"{number(100 * parts[0].accuracy)} % of {result.about['recordings']} held-out "
            "recordings; median of runs, 5th to 95th percentile."
        )
        rows = tuple(
            (
                part.label, number(part.calibration_error),
                f"{number(100 * part.accepted_share)} %",
                f"{number(100 * part.accepted_accuracy)} %",
                spread(part.sorts), spread(part.before_mistake),
            )
            for part in parts
        )  # fmt: skip
        shown.append(ShownTable(told, heads, rows))
    return shown


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield sorts in a row: the paper's run is among the middle 90 % of ours, or beyond them.

    Ours are those with probabilities as they are: the paper says nothing of scaling them.
    """
    paper = results.paper
    if paper is None or paper.value is None:
        return
    for result in results.results:
        sorts = parts_of(result)[0].sorts
        low, middle, high = np.percentile(sorts, PERCENTILES)
        agrees = verdict_on_count(middle, low, high, paper.value)
        text = with_unit(spread(sorts), paper.unit)
        if sorts.max() >= LONGEST_RUN:
            text += f"; runs end at {number(LONGEST_RUN, 4)}"
        yield PaperComparison(
            paper,
            results.dataset,
            results.task,
            results.source,
            text,
            result.label,
            agrees,
            marks=(Mark("ours", result.label, float(middle), float(low), float(high)),),
            label="held-out grasps",
        )


def highlights(results: TaskResults) -> Iterator[Highlight]:
    """Yield how far probabilities are from what they say, before and after scaling."""
    for result in results.results:
        plain, scaled = parts_of(result)
        marks = (
            mark_of("ours", "scaled", Score(100 * scaled.calibration_error, 0.0)),
            mark_of("other", "plain", Score(100 * plain.calibration_error, 0.0)),
        )
        said = "calibration error"
        yield Highlight("Scaled p", said, "points", marks)


EXPERIMENT = Experiment(
    name="sorting",
    order=40,
    title="Sorting",
    settings=Settings,
    measure=measure,
    figures=figures,
    tables=tables,
    highlights=highlights,
    paper_comparison=paper_comparison,
    by_model=True,
    kinds=("classification",),
)
