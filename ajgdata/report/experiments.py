"""Learning curves, tests against chance and sorting -> figures and words."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from ajgdata.evaluate.sorting import LONGEST_RUN
from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, new_figure, styled
from ajgdata.report.format import Caption, number, with_unit
from ajgdata.report.further import ChanceTest, Curves, SortingPart, SortingResult

METRIC_NAMES = {"accuracy": "accuracy", "rmse": "RMSE"}
#: Of a distribution, what is told: the 5th, 50th and 95th percentile.
PERCENTILES = (5, 50, 95)


def chance_text(test: ChanceTest) -> str:
    """The result of a permutation test in a sentence."""
    scale, unit = _scale(test)
    value, null = (with_unit(number(scale * x), unit) for x in (test.value, test.null.mean()))
    verdict = "differs" if test.differs else "cannot be told"
    return (
        f"Permutation test: {METRIC_NAMES[test.metric]} of {test.model_label}, all held-out "
        f"predictions together, is {value}; with labels exchanged between groups it is {null} on "
        f"average of {len(test.null)}; p = {number(test.p, 2)}: it {verdict} from chance at 5 %."
    )


def _scale(test: ChanceTest) -> tuple[float, str]:
    """What a metric is multiplied with to be shown, and its unit then."""
    return (100, "%") if test.metric == "accuracy" else (1, test.unit)


@styled
def chance_figure(test: ChanceTest) -> Figure:
    """What the model reaches, among what it reaches with labels exchanged between groups."""
    scale, unit = _scale(test)
    verdict = "differs from chance" if test.differs else "cannot be told from chance"
    figure = new_figure(
        (WIDTH_IN, 2.6),
        f"{test.about.title} · test against chance",
        f"{test.model_label}, {len(test.null)} permutations: p = {number(test.p, 2)}, {verdict}",
        [test.about.source],
    )
    axes = figure.subplots()
    axes.hist(scale * test.null, bins="fd", color=COLOURS[4], label="labels exchanged")
    axes.axvline(scale * test.null.mean(), color=GREY, ls=(0, (5, 3)), lw=1.1, label="their mean")
    axes.axvline(scale * test.value, color=COLOURS[1], lw=2, label="true labels")
    axes.set_xlabel(f"{METRIC_NAMES[test.metric]} ({unit})")
    axes.set_ylabel("permutations")
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure


def chance_caption(test: ChanceTest) -> Caption:
    """Caption of `chance_figure`."""
    text = chance_text(test)
    return Caption(
        f"{test.about.title}, {test.about.source}: whole groups (grasps) exchange their labels, "
        f"folds are made anew and the model is trained and tested again. {text}",
        f"Histogram of {METRIC_NAMES[test.metric]} under permuted labels. {text}",
    )


def spread(values: np.ndarray) -> str:
    """`12 (3 to 40)`: median, and the 5th and 95th percentile."""
    low, middle, high = np.percentile(values, PERCENTILES)
    return f"{number(middle)} ({number(low)} to {number(high)})"


@styled
def curve_figure(curves: Curves) -> Figure:
    """Metric against the number of training groups of each class, mean ± sd over draws."""
    figure = new_figure(
        (WIDTH_IN, 3.4),
        f"{curves.about.title} · training grasps",
        f"{METRIC_NAMES[curves.metric]} on the same validation grasps, {curves.repeats} draws",
        [curves.about.source],
    )
    axes = figure.subplots()
    for i, line in enumerate(curves.lines):
        style: dict[str, Any] = {"color": COLOURS[i], "marker": "os^DvPX"[i], "capsize": 2.5}
        axes.errorbar(line.groups, line.mean, line.sd, label=line.model_label, **style)
    axes.axhline(curves.chance, color=GREY, ls=":", lw=1.1, label="chance")
    axes.set_xlabel("training grasps per class")
    axes.set_ylabel(f"{METRIC_NAMES[curves.metric]} ({curves.unit})")
    axes.set_xticks(sorted({int(n) for line in curves.lines for n in line.groups}))
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure


def curve_caption(curves: Curves) -> Caption:
    """Caption of `curve_figure`."""
    paper = f" The paper, on its real gripper: {curves.paper.text}." if curves.paper else ""
    listed = "; ".join(
        f"{line.model_label}: "
        + ", ".join(
            f"{with_unit(number(m), curves.unit)} of {n}"
            for n, m in zip(line.groups, line.mean, strict=True)
        )
        for line in curves.lines
    )
    return Caption(
        f"{curves.about.title}, {curves.about.source}: models trained on some grasps of each class "
        f"and tested on grasps that are always the same. Bars: one standard deviation over "
        f"{curves.repeats} draws of training grasps and seeds (of seeds alone where a draw takes "
        f"them all); other validation grasps would differ by more.{paper}",
        f"{METRIC_NAMES[curves.metric]} against training grasps per class. {listed}.",
    )


@styled
def sorting_figure(result: SortingResult) -> Figure:
    """Reliability diagram, and how many objects are sorted in a row."""
    figure = new_figure(
        (WIDTH_IN, 3.5),
        f"{result.about.title} · sorting by {result.model_label}",
        f"{len(result.objects)} objects; stops below {100 * result.threshold:g} %",
        [result.about.source],
    )
    left, right = figure.subplots(1, 2)
    left.plot([0, 1], [0, 1], color=GREY, ls=(0, (5, 3)), lw=1.1, label="as it should be")
    left.axvline(result.threshold, color=GREY, ls=":", lw=1.1)
    for i, part in enumerate(result.parts):
        left.plot(part.confidence, part.right, "os"[i] + "-", color=COLOURS[i], label=part.label)
        _share_of_runs(right, part, COLOURS[i])
    left.set(xlabel="probability of the predicted class", ylabel="share that is right")
    left.set(xlim=(0, 1.02), ylim=(0, 1.02))
    left.legend(loc="lower right")
    right.set(xlabel="sorts in a row", ylabel="share of runs as long", xscale="symlog")
    right.xaxis.set_major_formatter(FuncFormatter(lambda n, _: number(n)))
    right.set_ylim(0, 1.02)
    right.set_xlim(left=0)
    return figure


def _share_of_runs(axes: Axes, part: SortingPart, colour: str) -> None:
    """Share of the runs that reached each length."""
    lengths = np.sort(part.sorts)
    share = 1 - np.arange(len(lengths)) / len(lengths)
    axes.step(np.append(0, lengths), np.append(1, share), color=colour, label=part.label)


def sorting_caption(result: SortingResult) -> Caption:
    """Caption of `sorting_figure`."""
    listed = "; ".join(
        f"{part.label}: {spread(part.sorts)} sorts in a row, calibration error "
        f"{number(part.calibration_error, 2)}, {number(100 * part.accepted_share)} % accepted"
        for part in result.parts
    )
    paper = f" The paper, live: {result.paper.text}." if result.paper else ""
    runs = len(result.parts[0].sorts)
    ended = [int(np.sum(part.sorts >= LONGEST_RUN)) for part in result.parts]
    return Caption(
        f"{result.model_label} trained on {', '.join(result.objects)} alone "
        f"({result.about.source}). Left: are predictions right as often as they are sure? The "
        f"temperature is found on grasps held out of each fold's training part. Right: {runs} "
        f"simulated runs in which held-out grasps come in random order until none is "
        f"{100 * result.threshold:g} % sure; a run of {LONGEST_RUN:,} is ended there "
        f"({' and '.join(map(str, ended))} were).{paper}",
        f"Reliability diagram and lengths of runs. {listed}.",
    )
