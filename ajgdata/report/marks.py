"""Five kinds of figures, each of which draws any points.

- `lines`: a value over a numeric axis, one line per series
- `rows`: one row per place, with its interval
- `scatter`: a value over its cost, with the Pareto front
- `matrix`: shares of predicted classes per true class
- `histogram`: the distribution of values per series

All except `matrix` show the chance level and the published value.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from textwrap import fill
from typing import Any, Literal, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.report.canvas import GREY, WIDTH_IN, line_style, new_figure, plain_ticks
from ajgdata.report.format import MAX_LISTED, Caption, Score, Source, number, with_unit
from ajgdata.report.format import value as value_text
from ajgdata.report.report_data import Illustration

MarkName = Literal["lines", "rows", "scatter", "matrix", "histogram"]
#: Panels side by side.
PANELS_PER_ROW = 3
#: Figures of more panels have small panels.
FEW_PANELS = 6
#: Height of the only panel of a figure, of a panel, of a small panel, and of a row (inches).
SINGLE_PANEL_IN = 3.0
PANEL_IN = 2.6
SMALL_PANEL_IN = 1.9
ROW_IN = 0.32
#: Axes with more places have ticks at round numbers.
MAX_TICKS = 8
#: Longer titles of axes and panels are wrapped.
TITLE_LETTERS = 32
#: Ratio of the largest to the smallest x above which the axis is logarithmic.
LOG_RATIO = 15
#: Lines with more points have no markers and no bars.
MAX_MARKERS = 100
#: Matrices with more classes have no numbers in their cells.
MAX_NUMBERED = 16
#: Shares below this value are written as 0 %, so no number is written.
SMALLEST_SHARE = 0.005
#: Matrices with more predicted classes have turned labels.
MAX_LEVEL_LABELS = 4
#: Cells of larger shares are dark, so their numbers are white.
DARK = 0.55
#: Letters in a row of a legend.
LEGEND_LETTERS = 90
CHANCE_STYLE: dict[str, Any] = {"color": GREY, "ls": ":", "lw": 1.0}
PUBLISHED_STYLE: dict[str, Any] = {"color": "black", "ls": "--", "lw": 1.0}
IDEAL_STYLE: dict[str, Any] = {"color": GREY, "ls": (0, (4, 3)), "lw": 0.9}


class Point(NamedTuple):
    """A value of a series at a place, in the unit of the figure."""

    panel: str
    series: str
    x: float | str
    score: Score


@dataclass(frozen=True)
class FigureContent:
    """Points and texts of a figure.

    - `axis`, `place`: title and unit of the value and of the x axis
    - `chance`: chance level of each panel; with `ideal`, the value that a guess predicts
    - `published`: a value of the paper, or pairs of x and value in one sequence
    - `ideal`: whether to draw the line on which x and value are equal
    - `log`: whether the axis of the value is logarithmic
    - `limits`: lowest and highest possible value, at which bars end
    """

    title: str
    subtitle: str
    sources: tuple[Source, ...]
    points: tuple[Point, ...]
    axis: tuple[str, str]
    place: tuple[str, str] = ("", "")
    chance: tuple[tuple[str, float], ...] = ()
    published: tuple[float, ...] = ()
    ideal: bool = False
    log: bool = False
    limits: tuple[float, float] = (-math.inf, math.inf)

    @property
    def panels(self) -> list[str]:
        """Panels in order of first appearance."""
        return list(dict.fromkeys(point.panel for point in self.points))

    @property
    def series(self) -> list[str]:
        """Series in order of first appearance."""
        return list(dict.fromkeys(point.series for point in self.points))

    def of(self, panel: str, series: str) -> list[Point]:
        """Return the points of one series in one panel."""
        return [point for point in self.points if point.panel == panel and point.series == series]


def illustration(name: str, mark: MarkName, content: FigureContent, text: str) -> Illustration:
    """Return a figure with a caption; its alternative text lists title and points."""
    listed = "; ".join(_point_text(point) for point in content.points[:MAX_LISTED])
    if len(content.points) > MAX_LISTED:
        listed += " and more"
    alt = f"{content.title}. {listed}."
    return Illustration(name, Caption(text, alt), partial(draw, mark, content), content.title)


def _point_text(point: Point) -> str:
    """Return panel, series, place and value of a point."""
    names = [place_text(part, "") for part in (point.panel, point.series, point.x) if part != ""]
    return f"{', '.join(names)}: {value_text(point.score.mean)}"


def draw(mark: MarkName, content: FigureContent) -> Figure:
    """Return the figure of a mark. Raises ValueError for an unknown mark or without points."""
    if mark not in MARKS:
        raise ValueError(f"there is no mark {mark!r}: use one of {', '.join(MARKS)}")
    if not content.points:
        raise ValueError(f"{content.title}: there are no points to draw")
    return MARKS[mark](content)


def lines(content: FigureContent) -> Figure:
    """Return one line per series over the x axis, with bars."""
    figure, grid = _grid(content)
    for axes, panel in zip(grid, content.panels, strict=True):
        for index, name in enumerate(content.series):
            points = sorted(content.of(panel, name), key=lambda point: point.x)
            x, mean, bars = _arrays(points, content.limits)
            style = line_style(index)
            if len(points) > MAX_MARKERS:
                axes.plot(x, mean, label=name, **style | {"marker": "", "lw": 0.9})
            elif points:
                axes.errorbar(x, mean, bars, label=name, capsize=2.0, elinewidth=0.7, **style)
        _references(axes, content, panel, "y")
        _numeric_x(axes, content, panel)
    return _finished(figure, grid, content)


def scatter(content: FigureContent) -> Figure:
    """Return points over their cost, with a line along their Pareto front.

    No point has a lower value at the same or a lower cost than a point of the front.
    """
    figure, grid = _grid(content)
    for axes, panel in zip(grid, content.panels, strict=True):
        own = [point for point in content.points if point.panel == panel]
        cost, value, _ = _arrays(own, content.limits)
        front = np.flatnonzero(pareto_front(cost, value))
        front = front[np.argsort(cost[front], kind="stable")]
        axes.plot(cost[front], value[front], color=GREY, lw=0.8, zorder=1)
        for index, name in enumerate(content.series):
            points = content.of(panel, name)
            if points:
                style = {**line_style(index), "ls": "", "elinewidth": 0.7}
                axes.errorbar(*_arrays(points, content.limits), label=name, **style)
        _references(axes, content, panel, "y")
        _numeric_x(axes, content, panel)
        axes.margins(x=0.12)
    return _finished(figure, grid, content)


def pareto_front(cost: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Return whether each of n points is on the Pareto front: boolean (n,).

    A point is not on the front if another point is no worse in cost and value, and better in one.
    Equal points are both on the front.
    """
    cost = np.asarray(cost, float)
    value = np.asarray(value, float)
    no_worse = (cost[:, None] <= cost) & (value[:, None] <= value)
    better = (cost[:, None] < cost) | (value[:, None] < value)
    return ~np.any(no_worse & better, axis=0)


def rows(content: FigureContent) -> Figure:
    """Return one row per place, with the interval of each series."""
    places = list(dict.fromkeys(str(point.x) for point in content.points))
    count = len(content.panels)
    series = content.series
    height = 1.5 + max(ROW_IN, 0.16 * len(series)) * len(places)
    figure = new_figure((WIDTH_IN, height), content.title, content.subtitle, content.sources)
    grid = figure.subplots(1, count, sharey=True, squeeze=False)[0]
    for axes, panel in zip(grid, content.panels, strict=True):
        for index, name in enumerate(series):
            points = content.of(panel, name)
            if points:
                _, mean, bars = _arrays(points, content.limits)
                shift = 0.14 * (index - (len(series) - 1) / 2)
                y = np.array([places.index(str(point.x)) for point in points]) + shift
                style = {**line_style(index), "ls": "", "capsize": 2.0}
                axes.errorbar(mean, y, xerr=bars, label=name, **style)
        _references(axes, content, panel, "x")
        axes.set_yticks(range(len(places)), places)
        axes.set_ylim(len(places) - 0.5, -0.5)
        if content.log:
            axes.set_xscale("log")
            plain_ticks(axes.xaxis)
        axes.grid(False, axis="y")
        axes.set_title(fill(panel, 60 // count), fontsize=9)
        axes.set_xlabel(_axis_label(content.axis, 60 // count))
    return _legend(figure, grid)


def histogram(content: FigureContent) -> Figure:
    """Return the share of the points of each series that are at least as large as the value."""
    figure, grid = _grid(content)
    for axes, panel in zip(grid, content.panels, strict=True):
        for index, name in enumerate(content.series):
            values = np.sort([point.score.mean for point in content.of(panel, name)])
            if len(values):
                share = np.append(1, 1 - np.arange(len(values)) / len(values))
                style = line_style(index)
                look = {"color": style["color"], "ls": style["ls"]}
                axes.step(np.append(values[0], values), share, label=name, **look)
        _references(axes, content, panel, "x")
        axes.set(ylim=(0, 1.02), xlabel=_axis_label(content.axis))
    grid[0].set_ylabel("share at least as large")
    return _legend(figure, grid)


def matrix(content: FigureContent) -> Figure:
    """Return shares (score) of predicted classes (series) per true class (x)."""
    predicted = content.series
    true = list(dict.fromkeys(str(point.x) for point in content.points))
    shares = np.zeros((len(true), len(predicted)))
    for point in content.points:
        shares[true.index(str(point.x)), predicted.index(point.series)] = point.score.mean
    size = (WIDTH_IN, 1.9 + min(0.34 * len(true), 5.0))
    figure = new_figure(size, content.title, content.subtitle, content.sources)
    axes = figure.subplots()
    axes.imshow(shares, cmap="Blues", vmin=0, vmax=1, aspect="equal")
    axes.grid(False)
    axes.spines[:].set_visible(False)
    if len(predicted) > MAX_LEVEL_LABELS:
        axes.set_xticks(range(len(predicted)), predicted, rotation=45, rotation_mode="xtick")
    else:
        axes.set_xticks(range(len(predicted)), predicted)
    axes.set_yticks(range(len(true)), true)
    axes.tick_params(length=0)
    axes.set(xlabel=_axis_label(content.axis), ylabel=_axis_label(content.place))
    if len(true) <= MAX_NUMBERED:
        _write_shares(axes, shares)
    return figure


def _write_shares(axes: Axes, shares: np.ndarray) -> None:
    """Write the shares of a matrix into its cells, in per cent; cells of 0 % stay empty."""
    style: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 8}
    for row, column in np.argwhere(shares >= SMALLEST_SHARE):
        share = shares[row, column]
        colour = "white" if share > DARK else "#222222"
        axes.text(column, row, f"{100 * share:.0f}", color=colour, **style)


def _grid(content: FigureContent) -> tuple[Figure, list[Axes]]:
    """Return a figure with one panel per panel of the content; the axes of the value are equal."""
    count = len(content.panels)
    columns = min(PANELS_PER_ROW, count)
    n_rows = math.ceil(count / columns)
    if count == 1:
        panel_in = SINGLE_PANEL_IN
    elif count <= FEW_PANELS:
        panel_in = PANEL_IN
    else:
        panel_in = SMALL_PANEL_IN
    size = (WIDTH_IN, 0.8 + panel_in * n_rows)
    figure = new_figure(size, content.title, content.subtitle, content.sources)
    grid = figure.subplots(n_rows, columns, sharey=True, squeeze=False).ravel().tolist()
    for axes in grid[count:]:
        axes.set_visible(False)
    for axes, panel in zip(grid, content.panels, strict=False):
        axes.set_title(fill(panel, TITLE_LETTERS), fontsize=9)
    return figure, grid[:count]


def _arrays(
    points: Sequence[Point], limits: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return places (n,), means (n,), and bars (2, n) that end at `limits`; a text has place 0."""
    numeric = all(not isinstance(point.x, str) for point in points)
    x = np.array([point.x if numeric else 0 for point in points], float)
    mean = np.array([point.score.mean for point in points])
    bars = np.hstack([np.array(point.score.bars()) for point in points])
    lowest, highest = limits
    below = np.minimum(bars[0], np.maximum(mean - lowest, 0))
    above = np.minimum(bars[1], np.maximum(highest - mean, 0))
    return x, mean, np.stack([below, above])


def _numeric_x(axes: Axes, content: FigureContent, panel: str) -> None:
    """Set scale, ticks and title of the x axis; a wide range of places is logarithmic."""
    x = sorted({float(p.x) for p in content.points if p.panel == panel})
    if x[0] > 0 and x[-1] / x[0] >= LOG_RATIO:
        axes.set_xscale("log")
        plain_ticks(axes.xaxis, x if len(x) <= MAX_TICKS else ())
    elif len(x) <= MAX_TICKS:
        axes.set_xticks(x, [number(place) for place in x])
    axes.set_xlabel(_axis_label(content.place))


def _references(axes: Axes, content: FigureContent, panel: str, axis: Literal["x", "y"]) -> None:
    """Draw the chance level, the published value, and the line of equal x and value."""
    line = axes.axhline if axis == "y" else axes.axvline
    for name, value in content.chance:
        if name == panel and math.isfinite(value):
            label = "guess" if content.ideal else "chance"
            line(value, label=label, **CHANCE_STYLE)
    if len(content.published) == 1:
        line(content.published[0], label="the paper", **PUBLISHED_STYLE)
    elif content.published:
        places = content.published[::2]
        values = content.published[1::2]
        axes.plot(places, values, "*", color="black", ms=9, ls="", label="the paper")
    if content.ideal:
        x = [float(point.x) for point in content.points]
        ends = [min(x), max(x)]
        axes.plot(ends, ends, label="ideal", **IDEAL_STYLE)


def _finished(figure: Figure, grid: Sequence[Axes], content: FigureContent) -> Figure:
    """Set the axes of the value, add the legend, and return the figure."""
    if content.log:
        grid[0].set_yscale("log")
        plain_ticks(grid[0].yaxis)
    else:
        grid[0].locator_params(axis="y", nbins=6)  # independent of the layout
    for axes in grid[:: min(PANELS_PER_ROW, len(grid))]:
        axes.set_ylabel(_axis_label(content.axis))
    return _legend(figure, grid)


def _legend(figure: Figure, grid: Sequence[Axes]) -> Figure:
    """Add a legend below the panels, with each series and reference once, and return the figure."""
    named: dict[str, Any] = {}
    for axes in grid:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            named.setdefault(label, handle)
    named.pop("", None)
    if named:
        longest = max(len(label) for label in named)
        columns = max(1, min(4, LEGEND_LETTERS // longest))
        figure.legend(list(named.values()), list(named), loc="outside lower center", ncols=columns)
    return figure


def _axis_label(axis: tuple[str, str], letters: int = TITLE_LETTERS) -> str:
    title, unit = axis
    return fill(f"{title} ({unit})" if unit else title, letters)


def place_text(x: float | str, unit: str) -> str:
    """Return a place on the x axis as text, with its unit if it is a number."""
    return x if isinstance(x, str) else with_unit(number(float(x)), unit)


MARKS: dict[MarkName, Callable[[FigureContent], Figure]] = {
    "lines": lines,
    "rows": rows,
    "scatter": scatter,
    "matrix": matrix,
    "histogram": histogram,
}
