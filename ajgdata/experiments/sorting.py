"""Sorting by sound, offline: objects in random order until none is probable enough."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from pydantic import Field

from ajgdata.evaluate.agreement import Verdict, verdict_on_count
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
from ajgdata.report.format import Caption, Score, number, with_unit
from ajgdata.report.panel import Highlight
from ajgdata.report.paper import PaperFigure
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
#: Metrics of a run, the main result first, by the field of `Run` that has them.
RUN_METRICS = {"sorted_before_error": "before_error", "sorts_in_a_row": "sorts"}
BEFORE_ERROR, PAPERS_RULE = "before the first error", "by the paper's rule"


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
        data.feature,
        data.value,
        data.group,
        model=model,
        folds=inputs.folds,
        seed=inputs.seed,
        limits=inputs.most_recordings,
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
            lengths = dataclasses.asdict(run)
            scores += [(model, part, m, f"run {n}", lengths[key]) for m, key in RUN_METRICS.items()]
            runs.append({"part": name, "run": n, **lengths})
    title = "Sorting"
    fields = {field.name: field.name.replace("_", " ") for field in dataclasses.fields(reliable[0])}
    columns = {"part": "Part", "run": "Run", "before_error": f"Sorted {BEFORE_ERROR}"}
    columns |= {"sorts": f"Sorted {PAPERS_RULE}", "mistakes": "In a wrong bin"}
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
    """Sorting with one kind of probabilities: bins (n,), and objects sorted in each run (runs,)
    before the first error, and by the paper's rule."""

    label: str
    confidence: np.ndarray
    right: np.ndarray
    accuracy: float
    calibration_error: float
    accepted_share: float
    accepted_accuracy: float
    before_error: np.ndarray
    sorts: np.ndarray

    @property
    def wrong_share(self) -> float:
        """Return the share of accepted recordings that are in a wrong bin, 0 if none is."""
        return 1 - self.accepted_accuracy if self.accepted_share else 0.0


def parts_of(result: Result) -> list[SortingPart]:
    """Return sorting with probabilities as they are, and scaled by a temperature."""
    return [_part(result, name) for name in PARTS]


def _part(result: Result, name: str) -> SortingPart:
    scores, bins = result.tables["scores"], result.tables["reliability"].where(part=name)
    runs = result.tables["runs"].where(part=name)

    def score(part: str, metric: str) -> float:
        return float(scores.where(part=part, metric=metric).numbers("value")[0])

    return SortingPart(
        label="as they are" if name == "plain" else name,
        confidence=bins.numbers("confidence"),
        right=bins.numbers("accuracy"),
        accuracy=score(f"sorting, {name}", "accuracy"),
        calibration_error=score(f"sorting, {name}", "calibration_error"),
        accepted_share=score(f"sorting, {name}, accepted", "share"),
        accepted_accuracy=score(f"sorting, {name}, accepted", "accuracy"),
        before_error=runs.numbers("before_error"),
        sorts=runs.numbers("sorts"),
    )


def spread(values: np.ndarray) -> str:
    """Return `12 (3 to 40)`: median, and the 5th and 95th percentile."""
    low, middle, high = np.percentile(values, PERCENTILES)
    return f"{number(middle)} ({number(low)} to {number(high)})"


def finding(results: TaskResults, result: Result) -> str:
    """Return the median of both results of a run, next to the published value."""
    plain = parts_of(result)[0]
    before, ruled = (float(np.median(one)) for one in (plain.before_error, plain.sorts))
    paper = results.paper
    published = f" (paper: {number(paper.value)})" if paper and paper.value is not None else ""
    more = " or more" if ruled >= LONGEST_RUN else ""
    return (
        f"{result.label} sorts {number(before)} objects {BEFORE_ERROR}{published}; {PAPERS_RULE} "
        f"{number(ruled)}{more}, {number(100 * plain.wrong_share, 2)} % in a wrong bin"
    )


def figure(results: TaskResults, result: Result) -> Figure:
    """Return the reliability diagram, and how many objects are sorted before the first error."""
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
    right.set(
        xlabel=f"objects sorted {BEFORE_ERROR} (thin: {PAPERS_RULE})",
        ylabel="share of runs as long",
        xscale="symlog",
    )
    right.xaxis.set_major_formatter(FuncFormatter(lambda n, _: number(n)))
    right.set_ylim(0, 1.02)
    right.set_xlim(left=0)
    return drawn


def _share_of_runs(axes: Axes, part: SortingPart, colour: str, dashes: Any) -> None:
    """Draw the share of the runs that reached each length, named after a quarter of them."""
    from ajgdata.report.labels import label_point

    share = np.append(1, 1 - np.arange(len(part.sorts)) / len(part.sorts))
    style = {"color": colour, "ls": dashes}
    axes.step(np.append(0, np.sort(part.before_error)), share, label=part.label, **style)
    axes.step(np.append(0, np.sort(part.sorts)), share, lw=0.7, alpha=0.6, **style)
    quarter = float(np.percentile(part.before_error, 25))
    label_point(axes, quarter, 0.75, part.label.partition(",")[0], colour)


def figures(results: TaskResults) -> list[Illustration]:
    """Return a figure for each model that sorts."""
    text = (
        "Left: share of correct predictions by probability. Right: share of simulated runs on "
        "held-out grasps that reach a length; thick: objects sorted before the first error, thin: "
        f"by the paper's rule. A run ends after {LONGEST_RUN:,} objects."
    )
    return [
        Illustration(
            results.named(one.model),
            Caption(f"{one.label}, {results.source}. {text}", f"{finding(results, one)}."),
            partial(figure, results, one),
        )
        for one in results.results
    ]


def tables(results: TaskResults) -> list[ShownTable]:
    """Return calibration and runs of each model that sorts."""
    heads = (
        "Probabilities", "Calibration error|", "Accepted|", "Right of those|",
        f"Sorted {BEFORE_ERROR}|", f"Sorted {PAPERS_RULE}|",
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
                spread(part.before_error), spread(part.sorts),
            )
            for part in parts
        )  # fmt: skip
        shown.append(ShownTable(told, heads, rows))
    return shown


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield objects sorted before the first error, and by the paper's rule as a second result.

    Of probabilities as they are: the paper does not mention scaling.
    """
    paper = results.paper
    if paper is None or paper.value is None:
        return
    for result in results.results:
        plain = parts_of(result)[0]
        yield PaperComparison(
            paper,
            results.dataset,
            results.task,
            results.source,
            two_results(paper, plain.before_error, plain.sorts, plain.wrong_share, LONGEST_RUN),
            result.label,
            agreement_of_runs(plain.before_error, paper.value),
            marks=run_marks(result.label, paper.value, plain.before_error, plain.sorts),
            label="held-out grasps",
        )


def agreement_of_runs(lengths: np.ndarray, published: float) -> Verdict:
    """Return the verdict on a published length, from the range of `lengths` (runs,)."""
    low, middle, high = map(float, np.percentile(lengths, PERCENTILES))
    return verdict_on_count(middle, low, high, published)


def two_results(
    paper: PaperFigure, before: np.ndarray, ruled: np.ndarray, wrong_share: float, longest: int
) -> str:
    """Return both results of runs (runs,) as text; `longest`: where runs end at the latest."""
    text = (
        f"{with_unit(spread(before), paper.unit)} {BEFORE_ERROR}; {spread(ruled)} {PAPERS_RULE}, "
        f"{number(100 * wrong_share, 2)} % in a wrong bin"
    )
    return f"{text}; runs end at {number(longest, 4)}" if ruled.max() >= longest else text


def run_marks(
    label: str, published: float, before: np.ndarray, ruled: np.ndarray
) -> tuple[Mark, ...]:
    """Return marks of both results of runs (runs,), each next to the published value."""
    marks = []
    for part, lengths in ((BEFORE_ERROR, before), (PAPERS_RULE, ruled)):
        low, middle, high = map(float, np.percentile(lengths, PERCENTILES))
        marks.append(Mark("ours", label, middle, low, high, part))
        marks.append(Mark("paper", "paper", published, published, published, part))
    return tuple(marks)


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
