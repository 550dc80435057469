"""Settings of the STFT, drawn: error of each over the time to make one feature."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.experiments.base import (
    SCORES,
    TaskResults,
)
from ajgdata.experiments.stft_settings import (
    TICKS_MS,
    Point,
    error_name,
    error_of,
    error_range,
    labels_of,
    models_of,
    points_of,
)
from ajgdata.report.canvas import GREY, WIDTH_IN, line_style, new_figure, pareto_front, plain_ticks
from ajgdata.report.format import Caption, number, sentence, with_unit
from ajgdata.report.labels import label_point


def finding(results: TaskResults) -> str:
    """Return the range of the first model's errors with all settings."""
    points, label = points_of(results), labels_of(results)[0]
    wrong = "wrong" if results.kind == "classification" else error_name(results)
    return (
        f"Exploratory: {label} {error_range(results, 0)} {wrong} with {len(points) - 1} settings, "
        f"{_told(results, points[0].errors[0][0])} with the data set's own"
    )


def _told(results: TaskResults, error: float) -> str:
    return with_unit(number(error), results.shown_unit)


def figure(results: TaskResults) -> Figure:
    """Return a panel for each model: its error over the time to make one feature."""
    drawn = new_figure(
        (WIDTH_IN, 4.1),
        finding(results),
        f"{results.title}: mean ± sd over folds; labels: window/hop in samples, band in kHz",
        [results.source],
    )
    labels = labels_of(results)
    panels = drawn.subplots(1, len(labels), sharex=True, sharey=True, squeeze=False)[0]
    for model, axes in enumerate(panels):
        _panel(axes, points_of(results), model, labels[model])
    unit = f" ({results.shown_unit})" if results.shown_unit else ""
    panels[0].set_ylabel(f"{error_name(results)}{unit}")
    handles, names = panels[0].get_legend_handles_labels()
    drawn.legend(handles, names, loc="outside lower center", ncols=4)
    return drawn


def _panel(axes: Axes, points: list[Point], model: int, title: str) -> None:

    windows = sorted({point.window for point in points})
    for point in points:
        style = {**line_style(windows.index(point.window)), "ls": ""}
        style["mfc"] = style["color"] if point.band == "all" else "white"
        axes.errorbar(point.feature_ms, *point.errors[model], **style, elinewidth=0.6)
    for window in windows:
        style = {**line_style(windows.index(window)), "ls": ""}
        axes.plot([], [], label=f"window {window}", **style)
    if any(point.band != "all" for point in points):
        axes.plot([], [], "o", mfc="white", color="black", label="part of the band")
    _named(axes, points, model)
    axes.set(xscale="log", xlabel="ms to make one feature", title=title)
    axes.margins(x=0.15)
    plain_ticks(axes.xaxis, TICKS_MS)


def _named(axes: Axes, points: list[Point], model: int) -> None:
    """Draw the Pareto front, and name what lies on it and the data set's own setting."""
    time_ms = np.array([point.feature_ms for point in points])
    error, sd = np.array([point.errors[model] for point in points]).T
    front = np.flatnonzero(pareto_front(time_ms, error))
    front = front[np.argsort(time_ms[front])]
    axes.step(time_ms[front], error[front], where="post", color=GREY, lw=1, label="Pareto front")
    own: dict[str, Any] = {"mfc": "none", "mec": "black", "ms": 9, "ls": ""}
    axes.plot(time_ms[0], error[0], "s", label="the data set's own", **own)
    for index in dict.fromkeys([*front.tolist(), 0]):
        name = points[index].label if index else f"own: {points[0].label}"
        reach = float(np.nan_to_num(sd[index]))
        label_point(axes, time_ms[index], error[index], name, "black", reach)


def caption(results: TaskResults) -> Caption:
    """Return the caption of `figure`."""
    points, lines, unit = points_of(results), [], results.shown_unit
    for model, label in enumerate(labels_of(results)):
        own = _told(results, points[0].errors[model][0])
        lines.append(
            f"{label}: {own} with its own settings, {error_range(results, model)} with the "
            f"{len(points) - 1} others"
        )
    scores = results.results[0].tables[SCORES]
    part = results.results[0].tables["settings"].rows[0]["part"]
    first = scores.where(part=part, model=models_of(results)[0])
    listed, chance = (
        "; ".join(lines),
        with_unit(number(error_of(results, first, "chance")[0]), unit),
    )
    return Caption(
        f"{results.title}, {results.source}: the same recordings and folds, features "
        f"made with other windows, hops and bands. {listed}; chance: {chance}. Time: of one core, "
        "median over recordings. Exploratory: the range is reported, because the best of many "
        "settings that is chosen on these folds would be optimistically biased.",
        f"{sentence(finding(results))}. {error_name(results).capitalize()} over the feature's run "
        f"time. {listed}.",
    )
