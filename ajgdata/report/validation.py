"""Figure of the validation: resonances and attenuation, measured, simulated and in theory."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.report.canvas import GREY, WIDTH_IN, line_style, new_figure, plain_ticks
from ajgdata.report.format import Caption, number
from ajgdata.report.report_data import Illustration
from ajgdata.types.table import Table

HEIGHT_IN = 4.9
#: Series of both panels by the prefix of their columns, with the index of the line style.
SERIES = {"measured": 1, "simulated": 0}
#: Ticks of the axes of frequency (Hz) and attenuation (dB/m).
FREQUENCY_TICKS = (200, 400, 800, 1600)
ATTENUATION_TICKS = (0.05, 0.1, 0.2, 0.4, 0.8)
TEXT = (
    "Left: deviation of each resonance from the theory of rigid walls; tubes by their fundamental."
    " Right: attenuation of a plane wave in an empty square tube of 100 mm; simulated with the"
    " default wall_admittance, theory for a smooth wall (thermoviscous)."
    " Bars: standard uncertainty of the measurement, and error of the simulation grid."
    " Grains, membrane and objects are not covered."
)


def validation(resonances: Table, attenuation: Table) -> Illustration:
    """Return the figure of both tables, named like the first."""
    measured, _ = deviation(resonances, "measured")
    simulated, _ = deviation(resonances, "simulated")
    title = (
        f"Resonances: measured within {upper_bound(measured)} %,"
        f" simulated {upper_bound(simulated)} % of theory"
    )
    ratio = attenuation.numbers("measured_db_m") / attenuation.numbers("theory_db_m")
    about = (
        f"measured attenuation {number(ratio.min(), 2)} to {number(ratio.max(), 2)} times"
        " thermoviscous theory"
    )
    names = resonances.column("resonance")
    points = "; ".join(
        f"{name}: measured {number(first, 2)} %, simulated {number(second, 2)} %"
        for name, first, second in zip(names, measured, simulated, strict=True)
    )
    caption = Caption(TEXT, f"{title}. {about}. {points}.")
    draw = partial(_draw, title, about, resonances, attenuation)
    return Illustration(resonances.name, caption, draw, title)


def upper_bound(values: np.ndarray) -> str:
    """Return the largest absolute value, rounded up to one decimal; rounding errors do not count.

    >>> upper_bound(np.array([-2.04, 0.5])), upper_bound(np.array([2.0]))
    ('2.1', '2.0')
    """
    tenths = 10 * np.abs(values).max()
    return f"{np.ceil(tenths - 1e-9) / 10:.1f}"


def deviation(resonances: Table, series: str) -> tuple[np.ndarray, np.ndarray]:
    """Return relative deviations from theory and their uncertainties in per cent, each (rows,)."""
    theory = resonances.numbers("theory_hz")
    value = resonances.numbers(f"{series}_hz")
    uncertainty = resonances.numbers(f"{series}_sd_hz")
    return 100 * (value / theory - 1), 100 * uncertainty / theory


def _draw(title: str, about: str, resonances: Table, attenuation: Table) -> Figure:
    figure = new_figure((WIDTH_IN, HEIGHT_IN), title, about, ("simulated", "recorded"))
    left, right = figure.subplots(1, 2, width_ratios=(1.15, 1))
    _draw_resonances(left, resonances)
    _draw_attenuation(right, attenuation)
    handles, labels = right.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


def _draw_resonances(axes: Axes, table: Table) -> None:
    names = table.column("resonance")
    place = np.arange(len(names))
    axes.axvline(0, color=GREY, ls=":", lw=1.2)
    for shift, (series, index) in zip((-0.13, 0.13), SERIES.items(), strict=True):
        value, uncertainty = deviation(table, series)
        style = {**line_style(index), "ls": ""}
        axes.errorbar(value, place + shift, xerr=uncertainty, capsize=2.0, **style)
    axes.set_yticks(place, names)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.grid(False, axis="y")
    axes.set_title("Resonances")
    axes.set_xlabel("deviation from theory (%)")


def _draw_attenuation(axes: Axes, table: Table) -> None:
    frequency = table.numbers("frequency_hz")
    for series, index in SERIES.items():
        value = table.numbers(f"{series}_db_m")
        uncertainty = table.numbers(f"{series}_sd_db_m")
        style = {**line_style(index), "ls": ""}
        axes.errorbar(frequency, value, uncertainty, label=series, capsize=2.0, **style)
    theory = table.numbers("theory_db_m")
    axes.plot(frequency, theory, label="theory", color=GREY, ls=":", lw=1.2)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(FREQUENCY_TICKS[0], 1.1 * FREQUENCY_TICKS[-1])
    axes.set_ylim(ATTENUATION_TICKS[0], ATTENUATION_TICKS[-1])
    plain_ticks(axes.xaxis, FREQUENCY_TICKS)
    plain_ticks(axes.yaxis, ATTENUATION_TICKS)
    axes.set_title("Attenuation in a tube")
    axes.set_xlabel("frequency (Hz)")
    axes.set_ylabel("attenuation (dB/m)")
