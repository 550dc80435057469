"""Results of live sorting: read back, and as figures, tables and words."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ajgdata.experiments.base import Lookup, Result, TaskResults
from ajgdata.experiments.sorting import (
    BEFORE_ERROR,
    PAPERS_RULE,
    agreement_of_runs,
    run_marks,
    spread,
    two_results,
)
from ajgdata.report.blocks import Illustration, ShownTable
from ajgdata.report.comparison import Mark, PaperComparison
from ajgdata.report.format import Caption, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PARTS = ("plain", "scaled")  #: probabilities as they are, and scaled by a temperature
#: Another look is had where it is needed, or at each object.
NEEDED, ALWAYS = "as needed", "always"


class Condition(NamedTuple):
    """Sorting with one model, kind of probabilities and rule of looks: shares of all placements in
    0..1, seconds that looks add to a sort, and of each run (runs,) how many objects were sorted
    before the first error, and by the paper's rule."""

    grasps: int
    policy: str
    looks: int
    accepted: float
    wrong: float
    accuracy: float
    added_s: float
    before_error: np.ndarray
    sorts: np.ndarray
    sort_s: np.ndarray

    @property
    def wrong_share(self) -> float:
        """Return the share of sorted objects that are in a wrong bin, 0 if none is sorted."""
        return self.wrong / self.accepted if self.accepted else 0.0


def conditions_of(result: Result, part: str) -> list[Condition]:
    """Return every condition with one kind of probabilities, the best trained model first."""
    runs = result.tables["runs"].where(part=part)
    found = []
    for row in result.tables["conditions"].where(part=part).rows:
        runs_of = runs.where(**{key: row[key] for key in ("grasps", "policy", "looks")})
        fields: dict[str, Any] = {key: row[key] for key in Condition._fields if key in row}
        fields |= {key: runs_of.numbers(key) for key in ("before_error", "sorts", "sort_s")}
        found.append(Condition(**fields))
    return found


def needed_of(result: Result, part: str) -> dict[int, list[Condition]]:
    """Return conditions in which looks are had as needed, by training grasps, 1 look first."""
    found: dict[int, list[Condition]] = {}
    for one in conditions_of(result, part):
        if one.policy == NEEDED:
            found.setdefault(one.grasps, []).append(one)
    return found


def finding(results: TaskResults, result: Result) -> str:
    """Return the median of both results of a run with one look, next to the published value."""
    sizes = needed_of(result, PARTS[0])
    best = sizes[max(sizes)][0]
    before, ruled = (number(float(np.median(one))) for one in (best.before_error, best.sorts))
    paper = results.paper
    published = f" (paper: {number(paper.value)})" if paper and paper.value is not None else ""
    return (
        f"{result.label} sorts {before} of {result.about['placements']} new grasps {BEFORE_ERROR}"
        f"{published}; {PAPERS_RULE} {ruled}, {number(100 * best.wrong_share, 2)} % in a wrong bin"
    )


def figure(results: TaskResults, result: Result) -> Figure:
    """Return each run and the median of sorts before the first error, by the number of looks."""
    from matplotlib.ticker import FuncFormatter

    from ajgdata.report.canvas import WIDTH_IN, line_style, new_figure
    from ajgdata.report.labels import label_end, reference_line

    settings = results.settings
    subtitle = (
        f"{results.title}: {settings.runs} runs, each until no class has "
        f"{100 * settings.threshold:g} %"
    )
    drawn = new_figure((WIDTH_IN, 3.8), finding(results, result), subtitle, [results.source])
    axes = drawn.subplots()
    sizes = needed_of(result, PARTS[0])
    for n, (grasps, conditions) in enumerate(sizes.items()):
        style, aside = line_style(n), 0.11 * (n - (len(sizes) - 1) / 2)
        x = [one.looks + aside for one in conditions]
        y = [float(np.median(one.before_error)) for one in conditions]
        for at, one in zip(x, conditions, strict=True):
            faint = {"color": style["color"], "alpha": 0.25, "ms": 3, "lw": 0}
            axes.plot(np.full(len(one.before_error), at), one.before_error, "o", **faint)
        axes.plot(x, y, **style)
        label_end(axes, x[-1], y[-1], f"{grasps} grasps", str(style["color"]))
    if (paper := results.paper) is not None and paper.value is not None:
        reference_line(axes, "paper", paper.value, f"the paper: {number(paper.value)}")
    axes.set_yscale("symlog", linthresh=1)
    axes.set_ylim(0, 1.5 * result.about["placements"])
    axes.set_xticks(range(1, settings.looks + 1))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: number(value)))
    axes.set(xlabel="attempts per object, at most", ylabel=f"objects sorted {BEFORE_ERROR}")
    return drawn


def figures(results: TaskResults) -> list[Illustration]:
    """Return a figure for each model."""
    text = (
        "Objects sorted before the first error: each run and the median, for models trained on "
        "all grasps of an object or on fewer. If no class is probable enough, the object is "
        "grasped again, and the probabilities are multiplied."
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
    """Return every condition of each model."""
    heads = (
        "Trained on", "Probabilities", "Attempts", "Accuracy|", "Not sure|", "Wrong bin|",
        f"Sorted {BEFORE_ERROR}|", f"Sorted {PAPERS_RULE}|", "Added, s|", "A sort, s|",
    )  # fmt: skip
    return [
        ShownTable(
            f"{result.label}: shares of {result.about['placements']} new placements; objects "
            f"sorted in {results.settings.runs} runs, median, 5th to 95th percentile.",
            heads,
            tuple(_line(part, one) for part in PARTS for one in conditions_of(result, part)),
            folded="Every condition",
        )
        for result in results.results
    ]


def _line(part: str, one: Condition) -> tuple[str, ...]:
    shares = (one.accuracy, 1 - one.accepted, one.wrong)
    return (
        f"{one.grasps} grasps", "as they are" if part == "plain" else part,
        "1" if one.looks == 1 else f"{one.looks}, {one.policy}",
        *(f"{number(100 * share)} %" for share in shares),
        spread(one.before_error), spread(one.sorts), number(one.added_s),
        number(float(np.median(one.sort_s))),
    )  # fmt: skip


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield both results of runs on new grasps with one look, by the first model, of all grasps.

    Of probabilities as they are, as the paper's; `sorting` does the same on held-out recordings.
    """
    paper = results.paper
    if paper is None or paper.value is None:
        return
    for result in results.results[:1]:
        sizes, longest = needed_of(result, PARTS[0]), result.about["placements"]
        best = sizes[max(sizes)][0]
        marks = run_marks(result.label, paper.value, best.before_error, best.sorts)
        yield PaperComparison(
            paper,
            results.dataset,
            results.task,
            results.source,
            two_results(paper, best.before_error, best.sorts, best.wrong_share, longest),
            result.label,
            agreement_of_runs(best.before_error, paper.value),
            marks=tuple(_unbounded(mark, float(longest)) for mark in marks),
            label="new grasps",
        )


def _unbounded(mark: Mark, longest: float) -> Mark:
    """Return a mark beyond the scale if nothing was left to sort: a longer run was not tried."""
    if mark.role == "ours" and mark.value >= longest:
        return mark._replace(value=np.inf, low=longest)
    return mark
