"""Figures and rows of an experiment, from the roles of the columns of its tables.

An experiment declares each figure as a `Plot`. A plot that is bound to the results of a task
(`BoundPlot`) has points, axes, conclusion, caption, figure and rows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import pandas as pd

from ajgdata.report.format import (
    MAX_LISTED,
    Caption,
    Score,
    mean_sd,
    number,
    sentence,
    with_unit,
    words,
)
from ajgdata.report.report_data import Illustration, ResultRow
from ajgdata.types.registry import model_label
from ajgdata.types.table import Column, Table, Value

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ajgdata.experiments.base import TaskResults
    from ajgdata.report.marks import FigureContent, MarkName, Point

#: Percentiles that are given of a histogram.
PERCENTILES = (5, 50, 95)
#: More places on an x axis than this are put into bins.
MAX_VALUES = 30
#: Column with the label of the model, which the joined rows of a stored table get.
MODEL_COLUMN = Column("model", "Model")
#: What the cells of a column are: labels for people, names of models, or names of data sets.
CellRole = Literal["label", "model", "data set"]


@dataclass(frozen=True)
class Plot:
    """A mark that draws one table of an experiment, and the role of each column that it uses.

    Columns are given by their keys. `table` is a function that returns a table of the results, or
    the name of a stored table. The rows of a stored table are those of all models. The column
    `model` with the label of the model is added, unless the table has a column of this name.

    - Rows that agree in `panel`, `series` and `x` are one point: the mean of the column `value`,
      with the standard deviation over `over` (empty: no deviation) or with the ends in the columns
      `interval`.
    - `cells` says what the texts of a column are. A label is shown unchanged, the name of a model
      by its label, and the name of a data set by its title. Other texts, for example classes, are
      shown as words.
    - `metric` is the column with the metric of a row. Only rows of the first metric of the task are
      plotted, in the unit of the task.
    - `percent` lists the columns that are shares, shown in %.
    - `chance` is the column with the chance level; the caption introduces it by `chance_label`.
    - `ideal`: x and value are the same quantity, so the line on which they are equal is drawn.
    - `published`: the value of the paper is drawn, or (`count`) its number of successes, or
      (`point`) its place and value.
    - `title` returns the conclusion. The default is the first series over x of lines, otherwise the
      range of all points.
    - `about` describes the rows in the caption, `name` is the end of the file name, and the points
      of a `listed` plot are rows in the table of results.
    """

    mark: MarkName
    table: str | Callable[[TaskResults], Table]
    about: str
    value: str = "value"
    x: str = ""
    series: tuple[str, ...] = (MODEL_COLUMN.key,)
    panel: str = ""
    over: str = "folds"
    interval: tuple[str, str] | None = None
    cells: Mapping[str, CellRole] = field(default_factory=dict)
    metric: str = ""
    percent: tuple[str, ...] = ()
    chance: str = ""
    chance_label: str = "Chance level:"
    ideal: bool = False
    published: Literal["", "value", "count", "point"] = ""
    title: Callable[[TaskResults], str] | None = None
    listed: bool = False
    name: str = ""

    def bind(self, results: TaskResults) -> BoundPlot:
        """Return this plot of the results of a task."""
        return BoundPlot(self, results)


class PlotAxis(NamedTuple):
    """Title and unit of an axis; both are empty if there is no axis."""

    title: str
    unit: str = ""


@dataclass(frozen=True, eq=False)
class BoundPlot:
    """A plot of the results of one task. Numbers are in the units in which they are shown."""

    plot: Plot
    results: TaskResults

    # Table, axes and points

    @cached_property
    def table(self) -> Table:
        """Rows of all models; if the rows have a metric, only those of the first of the task."""
        source = self.plot.table
        if isinstance(source, str):
            table = _joined_table(self.results, source)
        else:
            table = source(self.results)
        if self.plot.metric:
            table = table.where(**{self.plot.metric: self.results.metric})
        return table

    @cached_property
    def columns(self) -> dict[str, Column]:
        """Columns of the table by key."""
        return {column.key: column for column in self.table.columns}

    @property
    def axis(self) -> PlotAxis:
        """Title and unit of the values."""
        if self.plot.metric:
            return PlotAxis(self.results.metric_title, self.results.shown_unit)
        return self._axis_of(self.plot.value)

    @property
    def place(self) -> PlotAxis:
        """Title and unit of the x axis."""
        return self._axis_of(self.plot.x)

    def _axis_of(self, key: str) -> PlotAxis:
        column = self.columns.get(key)
        if column is None:
            return PlotAxis("")
        return PlotAxis(_lowered(column.title), "%" if key in self.plot.percent else column.unit)

    @property
    def scale(self) -> float:
        """Factor from the values of the table to shown values."""
        if self.plot.value in self.plot.percent:
            return 100.0
        return float(self.results.scale) if self.plot.metric else 1.0

    @property
    def limits(self) -> tuple[float, float]:
        """Lowest and highest possible value: shares and errors are not negative, accuracies are
        between 0 and 100 %."""
        if self.plot.metric and self.results.task_settings.kind == "classification":
            return 0.0, 100.0
        if self.plot.metric or self.plot.value in self.plot.percent:
            return 0.0, math.inf
        return -math.inf, math.inf

    @cached_property
    def points(self) -> list[Point]:
        """Points of all rows."""
        return self.points_with()

    @property
    def has_points(self) -> bool:
        """Whether a point has a finite value, so that there is something to draw."""
        return any(math.isfinite(point.score.mean) for point in self.points)

    def points_with(self, **values: Value) -> list[Point]:
        """Return the points of the rows that have `values` by column key."""
        from ajgdata.report.marks import Point

        plot = self.plot
        groups: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
        for row in self.table.where(**values).rows:
            if row[plot.value] is not None:
                panel = row[plot.panel] if plot.panel else ""
                series = tuple(row[key] for key in plot.series)
                x = row[plot.x] if plot.x else ""
                groups.setdefault((panel, series, x), []).append(row)
        points = []
        for (panel, series, x), rows in groups.items():
            names = map(self._cell_text, plot.series, series)
            point = Point(
                panel=self._cell_text(plot.panel, panel),
                series=", ".join(filter(None, names)),
                x=self._place_of(x),
                score=self._score(rows),
            )
            points.append(point)
        return points

    def _score(self, rows: Sequence[dict[str, Any]]) -> Score:
        """Return the mean of rows with their standard deviation, or with the ends in the first."""
        part = Table(self.table.name, "", "", self.table.columns, tuple(rows))
        values = self.scale * part.numbers(self.plot.value)
        mean = float(values.mean())
        if self.plot.interval:
            low, high = (self.scale * float(part.numbers(key)[0]) for key in self.plot.interval)
            return Score(mean, math.nan, (), low, high)
        has_sd = len(values) > 1 and np.isfinite(values).all()
        return Score(mean, float(values.std(ddof=1)) if has_sd else math.nan)

    def _place_of(self, x: Value) -> float | str:
        """Return where a cell of the column `x` is on the x axis: a number, or a text."""
        if x is None or isinstance(x, str):
            return self._cell_text(self.plot.x, x)
        return 100 * float(x) if self.plot.x in self.plot.percent else float(x)

    def _cell_text(self, key: str, cell: Value) -> str:
        """Return a cell of the column `key` for people; see `Plot.cells`."""
        if isinstance(cell, (int, float)) and not isinstance(cell, bool):
            return number(float(cell))
        text = str(cell or "")
        match self._cells.get(key):
            case "label":
                return text
            case "model":
                return model_label(text, self.results.task_settings.kind)
            case "data set":
                return self.results.title_of(text)
        return words(text)

    @cached_property
    def _cells(self) -> Mapping[str, CellRole]:
        """What the cells of a column are: the column `model` of a stored table has labels."""
        if isinstance(self.plot.table, str):
            return {MODEL_COLUMN.key: "label", **self.plot.cells}
        return self.plot.cells

    @cached_property
    def chance(self) -> dict[str, float]:
        """Mean chance level of each panel; empty without a column `chance`."""
        plot = self.plot
        if not plot.chance:
            return {}
        panels = self.table.split_by(plot.panel) if plot.panel else {"": self.table}
        levels = {}
        for panel, rows in panels.items():
            level = float(np.nanmean(rows.numbers(plot.chance)))
            levels[self._cell_text(plot.panel, panel)] = self.scale * level
        return levels

    @property
    def published(self) -> tuple[float, ...]:
        """Value of the paper, or its place and value; empty if it is not drawn."""
        paper = self.results.paper
        if not self.plot.published or paper is None or paper.value is None:
            return ()
        if self.plot.published == "value":
            return (float(paper.value),)
        if self.plot.published == "count":
            return () if paper.correct is None else (float(paper.correct),)
        return () if paper.reached is None else (float(paper.value), float(paper.reached))

    # Words

    @cached_property
    def listed_points(self) -> list[Point]:
        """Points that are listed in words: of a histogram, the median with percentiles."""
        if self.plot.mark != "histogram":
            return self.points
        groups: dict[tuple[str, str], list[Point]] = {}
        for point in self.points:
            groups.setdefault((point.panel, point.series), []).append(point)
        listed = []
        for points in groups.values():
            values = [point.score.mean for point in points]
            low, middle, high = map(float, np.percentile(values, PERCENTILES))
            score = Score(middle, math.nan, (), low, high)
            listed.append(points[0]._replace(x="", score=score))
        return listed

    @cached_property
    def conclusion(self) -> str:
        """Title of the figure."""
        return self.plot.title(self.results) if self.plot.title else self.default_title

    @property
    def default_title(self) -> str:
        """First series at both ends of the x axis of lines, else the range of all points."""
        points = self.listed_points
        if self.plot.mark == "lines":
            return self._trend(points)
        spread = value_range([point.score.mean for point in points], self.axis.unit)
        if len(points) == 1:
            return f"{self._case(points[0])}: {self.axis.title} {spread}"
        return f"{sentence(self.axis.title)}: {spread} in {len(points)} cases"

    def _trend(self, points: Sequence[Point]) -> str:
        """Return the values of the first series at its first and last place, over panels."""
        name = points[0].series
        panels: dict[str, list[Point]] = {}
        for point in sorted(points, key=lambda point: float(point.x)):
            if point.series == name:
                panels.setdefault(point.panel, []).append(point)
        lines = list(panels.values())
        ends = []
        for index in (0, -1):
            values = value_range([line[index].score.mean for line in lines], self.axis.unit)
            ends.append(f"{values} ({self._place_text(lines[0][index])})")
        trend = f"{self.axis.title} {', '.join(ends)}"
        if name:
            trend = f"{name}: {trend}"
        if len(lines) > 1:
            panel_title = _lowered(self.columns[self.plot.panel].title)
            trend += f" (range over {len(lines)} {panel_title}s)"
        return trend

    def _case(self, point: Point) -> str:
        """Return panel, series and place of a point in words."""
        return ", ".join(filter(None, (point.panel, point.series, self._place_text(point))))

    def _place_text(self, point: Point) -> str:
        """Return the place of a point in words, with the title of the x axis before a number."""
        from ajgdata.report.marks import place_text

        if not self.place.title or isinstance(point.x, str):
            return str(point.x or "")
        return f"{self.place.title} {place_text(point.x, self.place.unit)}"

    @property
    def _spread(self) -> str:
        """Description of the points and their bars."""
        over = self.plot.over
        if self.plot.mark == "histogram":
            return f"median, 5th to 95th percentile of {over}"
        if self.plot.mark == "matrix":
            return f"share of {over}"
        if self.plot.interval:
            return "with intervals"
        return f"mean ± sd over {over}" if over else ""

    @cached_property
    def caption(self) -> Caption:
        """Caption, and the alternative text, which lists the conclusion and the points."""
        results = self.results
        unit = self.axis.unit
        about = "; ".join(filter(None, (sentence(self.plot.about), self._spread)))
        text = f"{results.title}, {results.source}. {about}."
        if self.chance:
            levels = [with_unit(number(level), unit) for level in self.chance.values()]
            text += f" {self.plot.chance_label} {', '.join(dict.fromkeys(levels))}."
        if self.plot.published and results.paper:
            text += f" The paper, on its real gripper: {results.paper.text}."
        listed = [
            f"{self._case(point)}: {mean_sd(point.score, unit)}"
            for point in self.listed_points[:MAX_LISTED]
        ]
        return Caption(text, f"{self.conclusion}. {'; '.join(listed)}.")

    # Figure and rows

    @cached_property
    def content(self) -> FigureContent:
        """Points and words that the mark draws."""
        from ajgdata.report.marks import FigureContent

        axis = self.axis
        if self.plot.mark == "matrix":  # its columns are the series, its cells have no axis
            axis = PlotAxis(_lowered(self.columns[self.plot.series[0]].title))
        return FigureContent(
            title=self.conclusion,
            subtitle=f"{self.results.title}: {self.plot.about}",
            sources=(self.results.source,),
            points=tuple(point for point in self.points if math.isfinite(point.score.mean)),
            axis=axis,
            place=self.place,
            chance=tuple(self.chance.items()),
            published=self.published,
            ideal=self.plot.ideal,
            limits=self.limits,
        )

    def draw(self) -> Figure:
        """Return the figure."""
        from ajgdata.report.marks import draw

        return draw(self.plot.mark, self.content)

    @property
    def illustration(self) -> Illustration:
        """Figure with its words, not drawn yet."""
        name = self.results.named(*filter(None, [self.plot.name]))
        return Illustration(name, self.caption, self.draw, self.conclusion)

    def rows(self) -> Iterator[ResultRow]:
        """Yield a row of the table of results for each point."""
        axis = self.axis
        for point in self.points:
            guess = self.chance.get(point.panel, math.nan)
            text = mean_sd(point.score, axis.unit)
            chance = ""
            if math.isfinite(guess):
                text = self.results.with_chance_note(text, point.score.mean, guess)
                chance = with_unit(number(guess), axis.unit)
            place = self._place_text(point)
            metric = (axis.title, point.panel, place if point.series else "")
            yield ResultRow(
                label=point.series or place,
                metric=", ".join(filter(None, metric)),
                value=text,
                chance=chance,
                paper=self.results.paper if self.plot.published else None,
            )


def _joined_table(results: TaskResults, name: str) -> Table:
    """Return the rows of a stored table of all models, with a column `model`."""
    tables = [(result, result.tables[name]) for result in results.results if name in result.tables]
    if not tables:
        return Table(name, "", "", (MODEL_COLUMN,), ())
    first = tables[0][1]
    if any(column.key == MODEL_COLUMN.key for column in first.columns):
        columns = first.columns
        rows = [row for _, table in tables for row in table.rows]
    else:
        columns = (MODEL_COLUMN, *first.columns)
        rows = [
            {MODEL_COLUMN.key: result.label, **row}
            for result, table in tables
            for row in table.rows
        ]
    return Table(first.name, first.title, first.note, columns, tuple(rows))


def _lowered(title: str) -> str:
    """Return a title for the middle of a sentence: abbreviations keep their capitals."""
    first = (title.split(maxsplit=1) or [""])[0]
    return title[:1].lower() + title[1:] if first[1:].islower() else title


def value_range(values: Sequence[float], unit: str) -> str:
    """Return `40 to 95 %`: the smallest and the largest value."""
    low = number(min(values))
    high = number(max(values))
    return with_unit(low if low == high else f"{low} to {high}", unit)


def binned(x: np.ndarray, max_values: int = MAX_VALUES) -> np.ndarray:
    """Return places on an x axis (n,); more than `max_values` distinct ones are put into as many
    bins of equal width, and each becomes the mean of its bin."""
    if len(np.unique(x)) <= max_values:
        return x
    numbers = pd.Series(x)
    return numbers.groupby(pd.cut(numbers, max_values), observed=True).transform("mean").to_numpy()
