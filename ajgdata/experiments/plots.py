"""Figures and rows of an experiment, from the roles of the columns of its tables.

An experiment names its plots; caption, alternative text and conclusion follow.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ajgdata.report.format import Caption, Score, mean_sd, number, sentence, with_unit, words
from ajgdata.report.report_data import Illustration, ResultRow
from ajgdata.types import MODELS
from ajgdata.types.table import Column, Table, Value

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ajgdata.experiments.base import TaskResults
    from ajgdata.report.marks import MarkName, Picture, Point

#: Percentiles that are given of a histogram.
PERCENTILES = (5, 50, 95)
#: Points that an alternative text lists.
MAX_LISTED = 60
#: More places on an x axis than this are put into bins.
MAX_VALUES = 30
MODEL = Column("model", "Model")
#: Columns whose cells are names of data sets, which are shown by their titles.
DATA_SET_COLUMNS = ("data_set", "dataset", "other", "tested")


@dataclass(frozen=True)
class Plot:
    """A mark that draws one table of an experiment; the other fields are keys of its columns.

    `table` is the name of a table, or a function that makes one of the results. Rows that agree in
    `panel`, `series` and `x` are one point: their mean and standard deviation over `over`, or the
    ends in the columns `interval`. A column `metric` selects the metric of the task; its values
    are shown in the unit of the task. Only rows with the values `where` are plotted, which the
    sentence `about` describes. The default title is the first series over x of lines, otherwise the
    range of all points. With `published`, the value of the paper is drawn, or (`point`) its place
    and value. `listed`: the points are rows in the table of results.
    """

    mark: MarkName
    table: str | Callable[[TaskResults], Table]
    about: str
    value: str = "value"
    x: str = ""
    series: tuple[str, ...] = (MODEL.key,)
    panel: str = ""
    over: str = "folds"
    interval: tuple[str, str] | None = None
    chance: str = ""
    where: Mapping[str, Value] = field(default_factory=dict)
    title: Callable[[TaskResults], str] | None = None
    published: Literal["", "value", "point"] = ""
    percent: bool = False
    ideal: bool = False
    listed: bool = False
    name: str = ""


def table_for(results: TaskResults, plot: Plot) -> Table:
    """Return the rows of all models that a plot is about, with the column `model`."""
    if not isinstance(plot.table, str):
        table = plot.table(results)
    else:
        tables = [result.tables.get(plot.table) for result in results.results]
        first = next((table for table in tables if table), Table(plot.table, "", "", (MODEL,), ()))
        joined = [
            row if MODEL.key in row else {MODEL.key: result.label, **row}
            for result, table in zip(results.results, tables, strict=True)
            for row in (table.rows if table else ())
        ]
        own = {column.key for column in first.columns}
        columns = first.columns if MODEL.key in own else (MODEL, *first.columns)
        table = Table(first.name, first.title, first.note, columns, tuple(joined))
    metric = {"metric": results.metric} if _is_metric(table, plot) else {}
    return table.where(**plot.where, **metric)


def _is_metric(table: Table, plot: Plot) -> bool:
    """Return whether the values are those of the metric that the task reads first."""
    keys = {column.key for column in table.columns}
    return plot.value == "value" and "metric" in keys


def points_for(results: TaskResults, plot: Plot, **where: Value) -> list[Point]:
    """Return the points of a plot as they are shown, of rows with the values `where`."""
    from ajgdata.report.marks import Point

    table = table_for(results, plot)
    scale, groups = _scale(results, table, plot), _grouped(table.where(**where), plot)
    points = []
    for (panel, series, x), rows in groups.items():
        part = Table(table.name, "", "", table.columns, tuple(rows))
        values = scale * part.numbers(plot.value)
        known = len(values) > 1 and np.isfinite(values).all()
        sd = float(values.std(ddof=1)) if known else math.nan
        ends = [scale * float(part.numbers(key)[0]) for key in plot.interval or ()]
        score = Score(float(values.mean()), math.nan if ends else sd, (), *ends)
        parts = zip(plot.series, series, strict=True)
        label = ", ".join(filter(None, (value_name(results, *part) for part in parts)))
        factor = 100 if plot.ideal and plot.percent else 1
        place = x if isinstance(x, str) or x is None else float(x) * factor
        if isinstance(place, str) or place is None:
            place = value_name(results, plot.x, place)
        points.append(Point(value_name(results, plot.panel, panel), label, place, score))
    return points


def listed_points(results: TaskResults, plot: Plot) -> list[Point]:
    """Return the points that are listed in words: of a histogram, median and percentiles."""
    points = points_for(results, plot)
    if plot.mark != "histogram":
        return points
    groups: dict[tuple[str, str], list[float]] = {}
    for point in points:
        groups.setdefault((point.panel, point.series), []).append(point.score.mean)
    listed = []
    for (panel, series), values in groups.items():
        low, middle, high = map(float, np.percentile(values, PERCENTILES))
        score = Score(middle, math.nan, (), low, high)
        listed.append(points[0]._replace(panel=panel, series=series, x="", score=score))
    return listed


def _grouped(table: Table, plot: Plot) -> dict[tuple[Any, ...], list[dict[str, Any]]]:
    """Return the rows of each point that have a value, by panel, series and place."""
    groups: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
    for row in table.rows:
        if row[plot.value] is not None:
            panel = row[plot.panel] if plot.panel else ""
            series = tuple(row[key] for key in plot.series)
            groups.setdefault((panel, series, row[plot.x] if plot.x else ""), []).append(row)
    return groups


def binned(x: np.ndarray, max_values: int = MAX_VALUES) -> np.ndarray:
    """Return places on an x axis (n,); more than `max_values` distinct ones are put into as many
    bins of equal width, and each becomes the mean of its bin."""
    import pandas as pd

    if len(np.unique(x)) <= max_values:
        return x
    numbers = pd.Series(x)
    return numbers.groupby(pd.cut(numbers, max_values), observed=True).transform("mean").to_numpy()


def value_name(results: TaskResults, column: str, value: Value) -> str:
    """Return a value of a category for people.

    The column with the key `column` decides the meaning of a text: a data set or a model is shown
    by its title there; elsewhere, a class may have the same name.
    """
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return number(float(value))
    text = str(value or "")
    if column in DATA_SET_COLUMNS and text in results.other_sets:
        return results.other_sets[text].title
    if column == MODEL.key and text in MODELS:
        from ajgdata.models import model_label

        return model_label(text, results.kind)
    return words(text)


def _scale(results: TaskResults, table: Table, plot: Plot) -> float:
    if plot.percent:
        return 100.0
    return float(results.scale) if _is_metric(table, plot) else 1.0


def axis_of(results: TaskResults, plot: Plot) -> tuple[str, str]:
    """Return title and unit of the values."""
    table = table_for(results, plot)
    column = next((column for column in table.columns if column.key == plot.value), Column("", ""))
    if _is_metric(table, plot):
        return results.metric_title, results.shown_unit
    return _lowered(column.title), "%" if plot.percent else column.unit


def _place_of(results: TaskResults, plot: Plot) -> tuple[str, str]:
    """Return title and unit of the x axis."""
    columns = {column.key: column for column in table_for(results, plot).columns}
    if plot.x not in columns:
        return "", ""
    unit = "%" if plot.ideal and plot.percent else columns[plot.x].unit
    return _lowered(columns[plot.x].title), unit


def _series_of(results: TaskResults, plot: Plot) -> tuple[str, str]:
    """Return the title of the series, which are the columns of a matrix."""
    columns = {column.key: column.title for column in table_for(results, plot).columns}
    return _lowered(columns[plot.series[0]]), ""


def _lowered(title: str) -> str:
    first = (title.split(maxsplit=1) or [""])[0]
    return title[:1].lower() + title[1:] if first[1:].islower() else title


def chance_for(results: TaskResults, plot: Plot) -> dict[str, float]:
    """Return the mean chance level of each panel, as shown; none without a column."""
    if not plot.chance:
        return {}
    table = table_for(results, plot)
    parts = table.split_by(plot.panel) if plot.panel else {"": table}
    scale = _scale(results, table, plot)
    return {
        value_name(results, plot.panel, panel): scale * float(np.nanmean(part.numbers(plot.chance)))
        for panel, part in parts.items()
    }


# Conclusions


def conclusion(results: TaskResults, plot: Plot) -> str:
    """Return the conclusion of a plot: the title of its figure."""
    if plot.title:
        return plot.title(results)
    points, (axis, unit) = listed_points(results, plot), axis_of(results, plot)
    if plot.mark == "lines":
        return _trend(results, plot, points)
    spread = value_range([point.score.mean for point in points], unit)
    if len(points) == 1:
        return f"{_case(_place_of(results, plot), points[0])}: {axis} {spread}"
    return f"{sentence(axis)}: {spread} in {len(points)} cases"


def _trend(results: TaskResults, plot: Plot, points: Sequence[Point]) -> str:
    """Return the values of the first series at its first and last place, over panels."""
    (axis, unit), place = axis_of(results, plot), _place_of(results, plot)
    name = points[0].series
    panels: dict[str, list[Point]] = {}
    for point in sorted(points, key=lambda point: float(point.x)):
        if point.series == name:
            panels.setdefault(point.panel, []).append(point)
    lines = list(panels.values())
    ends = []
    for index in (0, -1):
        values = value_range([line[index].score.mean for line in lines], unit)
        ends.append(f"{values} ({_place_text(place, lines[0][index])})")
    columns = {column.key: column.title for column in table_for(results, plot).columns}
    count = f" (range over {len(lines)} {_lowered(columns[plot.panel])}s)" if len(lines) > 1 else ""
    return f"{f'{name}: ' if name else ''}{axis} {', '.join(ends)}{count}"


def value_range(values: Sequence[float], unit: str) -> str:
    """Return `40 to 95 %`: the smallest and the largest value."""
    low, high = number(min(values)), number(max(values))
    return with_unit(low if low == high else f"{low} to {high}", unit)


def _case(place: tuple[str, str], point: Point) -> str:
    """Return panel, series and place of a point in words."""
    return ", ".join(filter(None, (point.panel, point.series, _place_text(place, point))))


def _place_text(place: tuple[str, str], point: Point) -> str:
    from ajgdata.report.marks import place_text

    title, unit = place
    if not title or isinstance(point.x, str):
        return str(point.x or "")
    return f"{title} {place_text(point.x, unit)}"


# Figures, tables and rows


def picture_for(results: TaskResults, plot: Plot) -> Picture:
    """Return what the mark of a plot draws."""
    from ajgdata.report.marks import Picture

    paper = results.paper
    published: tuple[float, ...] = ()
    if plot.published and paper is not None and paper.value is not None:
        if plot.published == "value":
            published = (float(paper.value),)
        elif paper.reached is not None:
            published = (float(paper.value), float(paper.reached))
    return Picture(
        title=conclusion(results, plot),
        subtitle=f"{results.title}: {plot.about}",
        sources=(results.source,),
        points=tuple(p for p in points_for(results, plot) if math.isfinite(p.score.mean)),
        axis=_series_of(results, plot) if plot.mark == "matrix" else axis_of(results, plot),
        place=_place_of(results, plot),
        chance=tuple(chance_for(results, plot).items()),
        published=published,
        ideal=plot.ideal,
        limits=_limits(results, plot),
    )


def _limits(results: TaskResults, plot: Plot) -> tuple[float, float]:
    """Return the lowest and the highest possible value of a plot: shares and errors are not
    negative, accuracies are between 0 and 100 %."""
    is_metric = _is_metric(table_for(results, plot), plot)
    if is_metric and results.kind == "classification":
        return 0.0, 100.0
    return 0.0 if is_metric or plot.percent else -math.inf, math.inf


def illustrations(results: TaskResults, plots: Sequence[Plot]) -> Iterator[Illustration]:
    """Yield the figure of each plot that has finite points."""
    for plot in plots:
        if any(math.isfinite(point.score.mean) for point in points_for(results, plot)):
            yield Illustration(
                results.named(*filter(None, [plot.name])),
                _caption(results, plot),
                partial(_figure, results, plot),
                conclusion(results, plot),
            )


def _figure(results: TaskResults, plot: Plot) -> Figure:
    from ajgdata.report.marks import draw

    return draw(plot.mark, picture_for(results, plot))


def _spread(plot: Plot) -> str:
    if plot.mark == "histogram":
        return f"median, 5th to 95th percentile of {plot.over}"
    if plot.mark == "matrix":
        return f"share of {plot.over}"
    return "with intervals" if plot.interval else f"mean ± sd over {plot.over}"


def _caption(results: TaskResults, plot: Plot) -> Caption:
    unit, place = axis_of(results, plot)[1], _place_of(results, plot)
    listed = [
        f"{_case(place, point)}: {mean_sd(point.score, unit)}"
        for point in listed_points(results, plot)
    ]
    levels = (with_unit(number(v), unit) for v in chance_for(results, plot).values())
    chance = ", ".join(dict.fromkeys(levels))
    meaning = "Chance level:"
    if plot.ideal:
        meaning = "A guess predicts"
    elif plot.value == "error":  # 1 - accuracy, of which the chance level is another number
        meaning = "Error of a guess:"
    guess = f" {meaning} {chance}." if chance else ""
    paper = results.paper if plot.published else None
    paper_text = f" The paper, on its real gripper: {paper.text}." if paper else ""
    said = sentence(plot.about)
    return Caption(
        f"{results.title}, {results.source}. {said}; {_spread(plot)}.{guess}{paper_text}",
        f"{conclusion(results, plot)}. {'; '.join(listed[:MAX_LISTED])}.",
    )


def result_rows(results: TaskResults, plots: Sequence[Plot]) -> Iterator[ResultRow]:
    """Yield the points of plots that are `listed`."""
    for plot in (plot for plot in plots if plot.listed):
        axis, unit = axis_of(results, plot)
        chance, at = chance_for(results, plot), _place_of(results, plot)
        for point in points_for(results, plot):
            guess = chance.get(point.panel, math.nan)
            text = mean_sd(point.score, unit)
            if math.isfinite(guess):
                text = results.with_chance_note(text, point.score.mean, guess)
            place = _place_text(at, point)
            yield ResultRow(
                point.series or place,
                ", ".join(filter(None, (axis, point.panel, place if point.series else ""))),
                text,
                with_unit(number(guess), unit) if math.isfinite(guess) else "",
                paper=results.paper if plot.published else None,
            )
