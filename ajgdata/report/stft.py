"""Settings of the STFT: error of cheap models against the run time of the feature."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.report.canvas import GREY, WIDTH_IN, new_figure, styled
from ajgdata.report.content import pareto_front
from ajgdata.report.format import Caption, number, with_unit
from ajgdata.report.further import StftResult
from ajgdata.report.plots import look, plain_ticks

TICKS_MS = (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50)


@styled
def stft_figure(result: StftResult) -> Figure:
    """One panel a model: its error over the time to make one feature; what nothing beats joined."""
    figure = new_figure(
        (WIDTH_IN, 3.8),
        f"{result.about.title} · settings of the STFT",
        "error against the feature's run time; labels: window/hop in samples, band in kHz",
        [result.about.source],
    )
    panels = figure.subplots(1, len(result.model_labels), sharex=True, sharey=True, squeeze=False)
    for model, axes in enumerate(panels[0]):
        _panel(axes, result, model)
    unit = f" ({result.unit})" if result.unit else ""
    panels[0][0].set_ylabel(f"{_error_name(result)}{unit}")
    panels[0][-1].legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure


def _panel(axes: Axes, result: StftResult, model: int) -> None:
    windows = sorted({point.window for point in result.points})
    for point in result.points:
        style = look(windows.index(point.window)) | {"marker": "^" if point.band_hz else "o"}
        mean, sd = point.errors[model]
        axes.errorbar(point.feature_ms, mean, sd, **style, elinewidth=0.6)
    for window in windows:
        axes.plot([], [], "o", color=look(windows.index(window))["color"], label=f"window {window}")
    axes.plot([], [], "^", color=GREY, label="part of the band")
    time_ms = np.array([point.feature_ms for point in result.points])
    error = np.array([point.errors[model][0] for point in result.points])
    front = np.flatnonzero(pareto_front(time_ms, error))
    front = front[np.argsort(time_ms[front])]
    axes.step(time_ms[front], error[front], where="post", color=GREY, lw=1, label="front")
    axes.plot(time_ms[0], error[0], "s", mfc="none", mec="black", ms=9, label="the data set's own")
    near: dict[str, Any] = {"textcoords": "offset points", "fontsize": 7, "ha": "center"}
    for n, index in enumerate(front):
        place = time_ms[index], error[index]
        axes.annotate(result.points[index].label, place, (0, -11 - 8 * (n % 2)), **near)
    axes.set(xscale="log", xlabel="ms to make one feature", title=result.model_labels[model])
    plain_ticks(axes.xaxis, TICKS_MS)


def _error_name(result: StftResult) -> str:
    return "share that is wrong" if result.metric == "accuracy" else "RMSE"


def stft_caption(result: StftResult) -> Caption:
    """Caption of `stft_figure`."""
    lines = []
    for model, label in enumerate(result.model_labels):
        errors = [point.errors[model][0] for point in result.points]
        best = result.points[int(np.argmin(errors))]
        own, least = (with_unit(number(e), result.unit) for e in (errors[0], min(errors)))
        lines.append(f"{label}: {own} with its own settings, least with {best.label}: {least}")
    listed, chance = "; ".join(lines), with_unit(number(result.chance), result.unit)
    return Caption(
        f"{result.about.title}, {result.about.source}: the same recordings and folds, features "
        f"made with other windows, hops and bands. {listed}; chance: {chance}. Time: of one core, "
        "median over recordings. To choose the best of many settings on these folds would flatter "
        "it: nothing was changed for it.",
        f"{_error_name(result).capitalize()} over the feature's run time. {listed}.",
    )
