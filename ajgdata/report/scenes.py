"""A scene -> pictures: the cross-section of the cavity, and the response with its spectrum."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray
from scipy.ndimage import binary_closing

from ajgdata.gripper.geometry import cavity
from ajgdata.gripper.relief import RASTER_M, relief
from ajgdata.gripper.scene import SAMPLE_RATE_HZ, Numerics, Scene
from ajgdata.gripper.simulation import ImpulseResponse
from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, new_figure, styled
from ajgdata.report.format import number

Real = NDArray[np.floating]
AIR, GRAINS, OBJECT = "#eaf3fa", "#dcc9a3", "#9aa3ad"
MEMBRANE, TOUCHING = "#D55E00", "#7a2f00"
#: Objects that look the same upside down; the others are drawn as the membrane meets them, from
#: above, with what hangs over filled below.
UPSIDE_DOWN = ("rod", "sphere", "ellipsoid")
#: How far below the membrane a drawing goes.
DEEPEST_MM = 40.0
#: By scheme: the grid (mm) on which the features of a 20 mm cube and an 80 mm sphere were compared
#: with those of the wide scheme at 1.6 mm, the frequencies (Hz) below which each 1 kHz of them
#: erred by less than 10 % (trusted) and 20 % (with care; relative L2), and by what power of the
#: spacing they move: a mode errs by f (k dx)^n of a scheme of order n.
BANDS: dict[str, tuple[float, float, float, float]] = {
    "wide": (4.2, 6_000.0, 12_000.0, 4 / 5),
    "second": (2.5, 6_000.0, 8_000.0, 2 / 3),
}


@dataclass(frozen=True)
class Section:
    """The cut y = 0 through a cavity, in mm: heights (n,) over `x` (n,), the height of the table
    (None without an object), upper and lower side of the object, and its footprint (n,)."""

    x: Real
    floor: Real
    roof: Real
    surface: Real
    contact: Real
    table: float | None
    top: Real
    below: Real
    inside: NDArray[np.bool_]


def section(scene: Scene) -> Section:
    """Return the cut through the axis of the cavity. Raises SceneError if there is none."""
    shape = cavity(scene)
    row = int(np.argmin(np.abs(shape.axis)))
    x = shape.axis
    floor, roof, surface = (1e3 * field[row] for field in (shape.floor, shape.roof, shape.surface))
    table, inside = None, np.zeros(x.shape, bool)
    top = below = np.zeros_like(x)
    if scene.object is not None and shape.table_m is not None:
        seen = relief(scene, *np.meshgrid(x, x))
        table, inside = (
            1e3 * shape.table_m,
            binary_closing(seen.inside[row] > 0.5, iterations=round(2e-3 / RASTER_M)),
        )  # notches between parts are filled by the membrane
        top, below = table + 1e3 * np.maximum(seen.height[row], 0), np.full(x.shape, table)
        if scene.object.kind in UPSIDE_DOWN:
            below = 2 * table + scene.object.size_mm[2] - top
    contact = shape.contact[row]
    return Section(1e3 * x, floor, roof, surface, contact, table, top, below, inside)


@styled
def cross_section_figure(scene: Scene, title: str, left_out: Sequence[str] = ()) -> Figure:
    """Return a drawing of the plane y = 0: housing, bed, membrane, transducers, port and object.

    `left_out` are the parts that the plan does not solve; they are listed below the drawing.
    """
    lines = textwrap.wrap("Left out: " + "; ".join(left_out), 110) if left_out else []
    size = WIDTH_IN, 4.9 + 0.16 * len(lines)
    figure = new_figure(size, title, _grasp_line(scene), ["simulated"])
    draw_cross_section(figure.subplots(), scene)
    if lines:
        figure.supxlabel("\n".join(lines), x=0.02, ha="left", fontsize=8, color=GREY)
    return figure


@styled
def exhibit_figure(scene: Scene, title: str) -> Figure:
    """Return the drawing without names and numbers, small enough to stand beside others."""
    figure = new_figure((3.5, 3.4), title, "", ["simulated"])
    axes = figure.subplots()
    draw_cross_section(axes, scene, named=False)
    axes.set(xlabel="", ylabel="")
    return figure


def draw_cross_section(axes: Axes, scene: Scene, named: bool = True) -> None:
    """Draw the cut in mm; with `named` its parts are labelled."""
    cut, gripper = section(scene), scene.gripper
    rim, roof, height = gripper.rim_radius_mm, gripper.roof_radius_mm, gripper.height_mm
    open_ = cut.roof > cut.floor
    x, floor, surface = cut.x[open_], cut.floor[open_], cut.surface[open_]
    axes.fill_between(x, floor, cut.roof[open_], color=AIR, lw=0)
    axes.fill_between(x, floor, surface, where=(surface > floor).tolist(), color=GRAINS, lw=0)
    low = lowest = float(np.min(cut.floor))
    if cut.table is not None:
        # The rest of a tall object tells nothing: the table may lie below the drawing.
        low = max(min(lowest, cut.table), lowest - DEEPEST_MM)
        axes.fill_between(cut.x, cut.below, cut.top, where=cut.inside.tolist(), color=OBJECT, lw=0)
        axes.axhline(cut.table, color=GREY, lw=1.2)
    wall = [-rim, -roof, roof, rim], [0, height, height, 0]
    axes.plot(*wall, color="#333333", lw=2.6, solid_capstyle="round")
    axes.plot(x, np.where(cut.contact[open_] < 0.5, floor, np.nan), color=MEMBRANE, lw=1.8)
    axes.plot(x, np.where(cut.contact[open_] >= 0.5, floor, np.nan), color=TOUCHING, lw=2.8)
    _transducers(axes, scene, named)
    if named:
        _names(axes, scene, cut)
    axes.set(xlim=(-1.32 * rim, 1.32 * rim), ylim=(low - 7, height + 13), aspect="equal")
    axes.set(xlabel="x (mm), cut at y = 0", ylabel="height over the rim (mm)")
    axes.grid(False)


def _transducers(axes: Axes, scene: Scene, named: bool) -> None:
    gripper = scene.gripper
    marks = (
        ("speaker", gripper.speaker_mm, "v", COLOURS[0]),
        ("microphone", gripper.microphone_mm, "o", COLOURS[2]),
        ("port", gripper.port_mm, "s", GREY),
    )
    for name, (x, y), marker, colour in marks:
        top = gripper.height_mm
        axes.plot([x], [top], marker, color=colour, ms=7, mec="white", mew=0.8, zorder=5)
        if named:
            text = f"{name}\ny = {number(y)}".replace("-", "−")
            axes.text(x, top + 2.5, text, ha="center", va="bottom", fontsize=7, color=colour)


def _names(axes: Axes, scene: Scene, cut: Section) -> None:
    """Write names beside the parts, so that no legend has to be learnt."""
    rim = scene.gripper.rim_radius_mm
    style: dict[str, Any] = {"fontsize": 8, "va": "center"}
    side = int(np.argmin(np.abs(cut.x - 0.72 * rim)))
    axes.annotate(
        "membrane",
        (cut.x[side], cut.floor[side]),
        (0.98 * rim, float(np.min(cut.floor)) * 0.55),
        color=MEMBRANE,
        arrowprops={"arrowstyle": "-", "color": MEMBRANE, "lw": 0.8},
        **style,
    )
    middle = int(np.argmin(np.abs(cut.x + 0.45 * rim)))
    if scene.medium.kind != "air" and cut.surface[middle] - cut.floor[middle] > 6:
        depth = (cut.surface[middle] + cut.floor[middle]) / 2
        axes.text(cut.x[middle], depth, f"{scene.medium.kind} grains", ha="center", **style)
    axes.text(0, (cut.surface.max() + scene.gripper.height_mm) / 2, "air", ha="center", **style)
    if cut.table is not None:
        low = float(np.min(cut.floor)) - DEEPEST_MM
        said = "table" if cut.table >= low else f"table at\n−{number(-cut.table)} mm"
        axes.text(-1.3 * rim, max(cut.table, low) - 2.2, said, color=GREY, **style)
        if scene.object is not None and np.any(cut.inside):
            x, top = cut.x[cut.inside], cut.top[cut.inside]
            place = float(np.mean(x)), (max(cut.table, low) + float(np.max(top))) / 2
            room = np.ptp(x) > 18 and np.ptp((cut.table, float(np.max(top)))) > 5
            axes.text(*place, scene.object.kind if room else "", ha="center", **style)


def _grasp_line(scene: Scene) -> str:
    grasp, numerics = scene.grasp, scene.numerics
    parts = [f"{scene.medium.kind}, bed {number(scene.gripper.bed_depth_mm)} mm"]
    if scene.medium.kind == "air":
        parts = ["no grains"]
    if scene.object is not None:
        parts.append(f"{number(grasp.force_n)} N, {number(grasp.angle_deg)}°")
    return "   ".join([*parts, f"seed {grasp.seed}", f"grid {number(numerics.dx_mm)} mm"])


def trusted_bands_hz(numerics: Numerics) -> tuple[float, float]:
    """Return up to which frequency (Hz) a spectrum can be trusted, and up to which with care.

    What was measured on one grid, moved to another: equal errors in Hz have equal f^(n+1) dx^n.
    """
    dx_mm, trusted, careful, power = BANDS[numerics.scheme]
    factor = (dx_mm / numerics.dx_mm) ** power
    return trusted * factor, careful * factor


@styled
def response_figure(ir: ImpulseResponse, title: str, numerics: Numerics) -> Figure:
    """Return impulse response, decay of its energy, and its spectrum with the trusted band."""
    samples = ir.samples[ir.latency_samples :]
    milliseconds = 1e3 * np.arange(len(samples)) / SAMPLE_RATE_HZ
    fall = number(_fall_db(samples), 2)
    subtitle = f"{number(milliseconds[-1])} ms; its last tenth lies {fall} dB below its first"
    figure = new_figure((WIDTH_IN, 5.4), title, subtitle, ["simulated"])
    upper, lower = figure.subplots(2, 1, height_ratios=[1, 1.25])
    upper.plot(milliseconds, samples / np.abs(samples).max(), color=COLOURS[0], lw=0.9)
    upper.set(xlabel="time (ms)", ylabel="pressure (of its peak)", ylim=(-1.05, 1.05))
    decay = upper.twinx()
    decay.plot(milliseconds, _decay_db(samples), color=COLOURS[1], lw=1.2)
    decay.set(ylim=(-80, 4))
    decay.set_ylabel("energy still to come (dB)", color=COLOURS[1])
    decay.grid(False)
    frequency, level = spectrum_db(samples, ir.static)
    lower.plot(frequency, level, color=COLOURS[0], lw=1.0)
    _mark_bands(lower, numerics)
    lower.set(xscale="log", xlim=(100, 20_000), ylim=(level.max() - 80, level.max() + 12))
    lower.set(xlabel="frequency (Hz)", ylabel="level (dB re 1 Pa s/m³)")
    lower.xaxis.set_major_formatter(FuncFormatter(lambda hz, _: number(hz)))
    return figure


def _mark_bands(axes: Axes, numerics: Numerics) -> None:
    trusted, careful = (min(hz, 20_000.0) for hz in trusted_bands_hz(numerics))
    spans = ((100, trusted, "#009E73", "trusted"), (trusted, careful, "#E69F00", "with care"))
    for low, high, colour, name in (*spans, (careful, 20_000, GREY, "the grid's")):
        if low >= 20_000:
            continue
        axes.axvspan(low, high, color=colour, alpha=0.10, lw=0)
        middle = np.sqrt(low * high)
        place: dict[str, Any] = {
            "transform": axes.get_xaxis_transform(),
            "ha": "center",
            "va": "top",
        }
        # The last name stands lower: its band is narrow on a logarithmic axis.
        axes.text(middle, 0.98 if high < 20_000 else 0.92, name, fontsize=8, color=colour, **place)


def spectrum_db(samples: Real, static: float) -> tuple[Real, Real]:
    """Return frequencies (Hz, 100 to 20,000) and 20 log10 |H| (dB); bins are 2.7 Hz wide at most.

    `static` is what remains for ever, Σ static z^-n beside the samples.
    """
    length = max(1 << 14, len(samples))
    frequency = np.fft.rfftfreq(length, 1 / SAMPLE_RATE_HZ)
    heard = (frequency >= 100) & (frequency <= 20_000)
    remaining = static / -np.expm1(-2j * np.pi * frequency[heard] / SAMPLE_RATE_HZ)
    magnitude = np.abs(np.fft.rfft(samples, length)[heard] + remaining)
    return frequency[heard], 20 * np.log10(np.maximum(magnitude, 1e-6 * magnitude.max()))


def _decay_db(samples: Real) -> Real:
    """Return the energy after each sample (n,) relative to all of it, in dB (Schroeder 1965)."""
    left = np.cumsum(samples[::-1] ** 2)[::-1]
    return 10 * np.log10(np.maximum(left / left[0], 1e-12))


def _fall_db(samples: Real) -> float:
    """Return how far the last tenth lies below the first, in dB of their mean squares."""
    tenth = max(1, len(samples) // 10)
    first, last = (float(np.mean(part**2)) for part in (samples[:tenth], samples[-tenth:]))
    return 10 * np.log10(first / max(last, 1e-30 * first))
