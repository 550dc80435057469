"""Results of live sorting: read back, and as figures, tables and words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ajgdata.evaluate.agreement import verdict_on_count
from ajgdata.experiments.base import Lookup, Result, TaskResults
from ajgdata.report.blocks import Illustration, ShownTable
from ajgdata.report.comparison import Mark, PaperComparison
from ajgdata.report.format import Caption, number, sentence, with_unit
from ajgdata.types.table import Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: What is told of a distribution of lengths.
PERCENTILES = (5, 50, 95)
PARTS = ("plain", "scaled")  #: probabilities as they are, and scaled by a temperature
PART_NAMES = {"plain": "probabilities as they are", "scaled": "scaled probabilities"}
#: Another look is had where it is needed, or at each object.
NEEDED, ALWAYS = "as needed", "always"
#: Of pairs that could not be told apart, so many are named.
MOST_PAIRS = 3


class Condition(NamedTuple):
    """Sorting with one model, kind of probabilities and rule of looks: shares of all placements in
    0..1, seconds that looks add to a sort, and sorts in a row of each run (runs,)."""

    grasps: int
    policy: str
    looks: int
    accepted: float
    wrong: float
    accuracy: float
    added_s: float
    sorts: np.ndarray
    before_mistake: np.ndarray
    sort_s: np.ndarray


class Expected(NamedTuple):
    """Sorts in a row that recordings held out let one expect: median, 5th and 95th percentile."""

    low: float
    middle: float
    high: float
    accepted: float


def conditions_of(result: Result, part: str) -> list[Condition]:
    """Return every condition with one kind of probabilities, the best trained model first."""
    runs = result.tables["runs"].where(part=part)
    found = []
    for row in result.tables["conditions"].where(part=part).rows:
        runs_of = runs.where(**{key: row[key] for key in ("grasps", "policy", "looks")})
        fields: dict[str, Any] = {key: row[key] for key in Condition._fields if key in row}
        fields |= {key: runs_of.numbers(key) for key in ("sorts", "before_mistake", "sort_s")}
        found.append(Condition(**fields))
    return found


def expected_of(result: Result, part: str) -> dict[int, Expected]:
    """Return what is expected of a run with one look, by the number of training grasps."""
    rows = result.tables["offline"].where(part=part).rows
    return {
        row["grasps"]: Expected(row["low"], row["middle"], row["high"], row["accepted"])
        for row in rows
    }


def needed_of(result: Result, part: str) -> dict[int, list[Condition]]:
    """Return conditions in which looks are had as needed, by training grasps, 1 look first."""
    found: dict[int, list[Condition]] = {}
    for one in conditions_of(result, part):
        if one.policy == NEEDED:
            found.setdefault(one.grasps, []).append(one)
    return found


def spread(values: np.ndarray) -> str:
    """Return `12 (3 to 40)`: median, and the 5th and 95th percentile."""
    low, middle, high = np.percentile(values, PERCENTILES)
    return f"{number(middle)} ({number(low)} to {number(high)})"


def stops(result: Result, **which: str | int) -> str:
    """Return why the runs of a condition ended: the two classes that could not be told apart."""
    runs = result.tables["runs"].where(**which)
    pairs = Counter(" or ".join(sorted((r["first"], r["second"]))) for r in runs.rows if r["held"])
    shown = pairs.most_common(MOST_PAIRS)
    counts = dict(shown)
    counts["another doubt"] = pairs.total() - sum(counts.values())
    counts["all sorted"] = len(runs.rows) - pairs.total()
    return "; ".join(f"{n} × {text}" for text, n in counts.items() if n)


def finding(results: TaskResults, result: Result, part: str = PARTS[0]) -> str:
    """Return how many new grasps are sorted in a row, and what further looks do for the model that
    was trained on the fewest."""
    sizes = needed_of(result, part)
    best, least = sizes[max(sizes)], sizes[min(sizes)]
    longest = result.about["placements"]
    middle = np.median(best[0].sorts)
    many = f"all {longest}" if middle >= longest else number(middle)
    told = f"{result.label} sorts {many} new grasps in a row in the middle run"
    paper = results.paper
    if paper is not None and paper.value is not None:
        told += f", the paper {number(paper.value)}"
    if len(least) > 1:
        one, more = (number(np.median(c.sorts)) for c in (least[0], least[-1]))
        told += f"; trained on {least[0].grasps} grasps an object, {one}"
        told += f", and {more} with {least[-1].looks} looks"
    return told


def figure(results: TaskResults, result: Result, part: str) -> Figure:
    """Return sorts in a row, and what is not or wrongly sorted against the time of looks."""
    from ajgdata.report.canvas import WIDTH_IN, new_figure

    settings = results.settings
    drawn = new_figure(
        (WIDTH_IN, 3.8),
        finding(results, result, part),
        f"{results.title}: {settings.runs} runs, each until no class has "
        f"{100 * settings.threshold:g} %; {PART_NAMES[part]}",
        [results.source],
    )
    left, right = drawn.subplots(1, 2)
    _rows(left, results, result, part)
    _curves(right, result, part)
    return drawn


def _rows(axes: Axes, results: TaskResults, result: Result, part: str) -> None:
    """Draw each run, medians by the number of looks, and what was expected of one look."""
    from matplotlib.ticker import FuncFormatter

    from ajgdata.report.canvas import line_style
    from ajgdata.report.labels import label_end, reference_line

    sizes, expected = needed_of(result, part), expected_of(result, part)
    for n, (grasps, conditions) in enumerate(sizes.items()):
        style, aside = line_style(n), 0.11 * (n - (len(sizes) - 1) / 2)
        x = [one.looks + aside for one in conditions]
        y = [float(np.median(one.sorts)) for one in conditions]
        for at, one in zip(x, conditions, strict=True):
            faint = {"color": style["color"], "alpha": 0.25, "ms": 3, "lw": 0}
            axes.plot(np.full(len(one.sorts), at), one.sorts, "o", **faint)
        axes.plot(x, y, **style)
        label_end(axes, x[-1], y[-1], f"{grasps} grasps", str(style["color"]))
        told, place = expected[grasps], 0.55 + aside
        hollow = {"color": style["color"], "mfc": "white", "ms": 6, "lw": 1}
        axes.plot([place, place], [told.low, told.high], color=style["color"], lw=1)
        axes.plot(place, told.middle, "D", **hollow)
    if (paper := results.paper) is not None and paper.value is not None:
        reference_line(axes, "paper", paper.value, f"the paper: {number(paper.value)}")
    most = max(one.looks for one in conditions)
    axes.set_yscale("symlog", linthresh=1)
    axes.set_ylim(0, 1.5 * result.about["placements"])
    axes.set_xticks(
        [0.55, *range(1, most + 1)], ["expected\nof one", *map(str, range(1, most + 1))]
    )
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: number(value)))
    axes.set(xlabel="looks at an object, at most", ylabel="sorts in a row")


def _curves(axes: Axes, result: Result, part: str) -> None:
    """Draw shares that stop a run, and that go into a wrong bin, against added time."""
    from matplotlib.ticker import FuncFormatter

    from ajgdata.report.canvas import line_style
    from ajgdata.report.labels import label_point

    ends = []
    for n, (grasps, conditions) in enumerate(needed_of(result, part).items()):
        style = line_style(n)
        x = [one.added_s for one in conditions]
        stopped = [100 * (1 - one.accepted) for one in conditions]
        wrong = [100 * one.wrong for one in conditions]
        axes.plot(x, stopped, **(style | {"ls": "-"}))
        axes.plot(x, wrong, **(style | {"ls": (0, (2, 1.5)), "mfc": "white"}))
        ends.append((grasps, x, stopped, wrong, str(style["color"])))
    grasps, x, stopped, wrong, colour = ends[-1]  # the one that stops most often
    label_point(axes, x[0], stopped[0], f"nothing sure enough ({grasps} grasps)", colour)
    label_point(axes, x[-1], wrong[-1], "into a wrong bin", colour)
    axes.set_yscale("symlog", linthresh=1)
    axes.set_ylim(-0.1, 100)
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: number(value)))
    axes.set(xlabel="seconds that looks add to a sort", ylabel="share of objects (%)")
    axes.margins(x=0.12)


def caption(results: TaskResults, result: Result, part: str) -> Caption:
    """Return the caption of `figure`."""
    settings, sizes = results.settings, needed_of(result, part)
    expected = expected_of(result, part)
    listed = "; ".join(
        f"{grasps} grasps: "
        + ", ".join(f"{spread(one.sorts)} with {_looks(one.looks)}" for one in conditions)
        + f" (expected {number(expected[grasps].middle)} with one)"
        for grasps, conditions in sizes.items()
    )
    best = sizes[max(sizes)]
    why = stops(result, part=part, policy=NEEDED, looks=1, grasps=best[0].grasps)
    count = result.about["placements"]
    look_s, sort_s = number(settings.look_s), number(settings.sort_s)
    return Caption(
        f"{result.label} trained on all grasps of an object or on fewer ({results.source}), and "
        f"{count} new placements that it has never met, in {settings.runs} random orders; a run "
        f"ends where no class is {100 * settings.threshold:g} % sure, or when all are sorted. "
        "Left: sorts in a row, each run and the median; diamonds: what is expected of recordings "
        "held out of the training, median and 5th to 95th percentile. Where nothing is sure enough "
        "the object is grasped again, and the probabilities are multiplied. Right: share of "
        "placements that stop a run (solid) and that go into a wrong bin (hollow, dashed), from "
        f"one look on. A look adds {look_s} s to a sort of {sort_s} s, the paper's times. Sorts in "
        f"a row, median, 5th to 95th percentile: {listed}. Runs with one look, all grasps: {why}.",
        f"{sentence(finding(results, result, part))}. Sorts in a row: {listed}.",
    )


def _looks(count: int) -> str:
    return "1 look" if count == 1 else f"{count} looks"


def figures(results: TaskResults) -> list[Illustration]:
    """Return a figure for each model, of probabilities as they are, and scaled (on request)."""
    return [
        Illustration(
            results.named(one.model, *([part] if folded else [])),
            caption(results, one, part),
            partial(figure, results, one, part),
            folded,
        )
        for one in results.results
        for part, folded in zip(PARTS, ("", "With scaled probabilities"), strict=True)
    ]


def tables(results: TaskResults) -> list[ShownTable]:
    """Return every condition of each model, and the times of its stages."""
    heads = (
        "Trained on", "Probabilities", "Looks", "Accuracy|", "Not sure|", "Wrong bin|",
        "Sorts in a row|", "Before a mistake|", "Added, s|", "A sort, s|", "Runs ended by",
    )  # fmt: skip
    shown = []
    for result in results.results:
        rows = tuple(
            _line(result, part, one) for part in PARTS for one in conditions_of(result, part)
        )
        told = (
            f"{result.label}: shares of {result.about['placements']} new placements; sorts in a "
            f"row of {results.settings.runs} runs, median, 5th to 95th percentile. "
            f"{_expectation(result)} {_measured(result.cost['scores'])}"
        )
        shown.append(ShownTable(told, heads, rows, folded="Every condition, and why runs ended"))
    return shown


def _line(result: Result, part: str, one: Condition) -> tuple[str, ...]:
    which: dict[str, Any] = {"part": part, "policy": one.policy, "looks": one.looks}
    looks = "1" if one.looks == 1 else f"{one.looks}, {one.policy}"
    shares = (one.accuracy, 1 - one.accepted, one.wrong)
    return (
        f"{one.grasps} grasps", "as they are" if part == "plain" else "scaled", looks,
        *(f"{number(100 * share)} %" for share in shares),
        spread(one.sorts), spread(one.before_mistake), number(one.added_s),
        number(float(np.median(one.sort_s))), stops(result, grasps=one.grasps, **which),
    )  # fmt: skip


def _expectation(result: Result) -> str:
    """Return what was expected offline, in a sentence."""
    told = [
        f"{number(one.middle)} ({number(one.low)} to {number(one.high)}) of {grasps} grasps, "
        f"{number(100 * one.accepted)} % of whose recordings are accepted"
        for grasps, one in expected_of(result, PARTS[0]).items()
    ]
    return f"Expected with one look, of probabilities as they are: {'; '.join(told)}."


def _measured(cost: Table) -> str:
    """Return the times of the stages from a sound to a decision, in a sentence."""

    def ms(stage: str, statistic: str) -> str:
        value = cost.where(metric=f"{stage}_s", statistic=statistic).numbers("value")[0]
        return number(1e3 * float(value), 2)

    stages = ("feature", "model", "decide")
    told = ", ".join(f"{s} {ms(s, 'median')} ({ms(s, 'p99')})" for s in stages)
    return f"From a recording to a decision, ms, median (99 %): {told}."


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield sorts in a row of new grasps with one look, by the first model, of all grasps.

    With probabilities as they are, as the paper's; see that of `sorting`, which is of recordings
    held out.
    """
    paper = results.paper
    if paper is None or paper.value is None:
        return
    for result in results.results[:1]:
        sizes, longest = needed_of(result, PARTS[0]), float(result.about["placements"])
        sorts = sizes[max(sizes)][0].sorts
        low, middle, high = map(float, np.percentile(sorts, PERCENTILES))
        agrees = verdict_on_count(middle, low, high, paper.value)
        text = with_unit(spread(sorts), paper.unit)
        mark = Mark("ours", result.label, middle, low, high)
        if middle >= longest:  # nothing was left to sort: how far it would get is not known
            text, mark = f"all {number(longest)}", mark._replace(value=np.inf, low=longest)
        yield PaperComparison(
            paper,
            results.dataset,
            results.task,
            results.source,
            text,
            result.label,
            agrees,
            marks=(mark,),
            label="new grasps",
        )
