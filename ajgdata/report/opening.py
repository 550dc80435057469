"""Opening picture of the report: sweep, gripper with an object, sound field, spectrum, decision.

All numbers are those of one recording.
"""

from __future__ import annotations

from dataclasses import dataclass
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch
from numpy.typing import NDArray
from scipy.signal import spectrogram

from ajgdata.gripper.pressure_frames import PressureFrames
from ajgdata.gripper.scene import Scene
from ajgdata.report.canvas import COLOURS, GREY, SOURCE_COLOURS, styled
from ajgdata.report.format import number, words
from ajgdata.report.scenes import draw_pressure, draw_section, section

Real = NDArray[np.floating]
LOWEST_HZ = 100.0
HIGHEST_HZ = 20_000.0
#: Titles of the frames of the sound field.
MOMENTS = ("sound leaves", "meets object", "comes back")


@dataclass(frozen=True, eq=False)
class Opening:
    """One recording of one grasp: scene, played sound, spectrum, and prediction.

    - `film`: pressure in the plane xz; its times start when the pulse leaves the speaker
    - `sweep`: the played sound (samples,) at `sample_rate_hz`
    - `level_db`: feature of the recording (bins,) at `frequency_hz` (bins,), in dB
    - `object`: the true class
    - `model`: the model, trained without this grasp, that `predicted` a class with a `probability`
    """

    recording: str
    object: str
    scene: Scene
    film: PressureFrames
    sweep: Real
    sample_rate_hz: int
    frequency_hz: Real
    level_db: Real
    model: str
    predicted: str
    probability: float


#: Size of the picture (inches), and of its text.
OPENING_SIZE_IN = (11.6, 2.35)
FONT_PT = 10.5
#: Left, bottom, width and height of the parts (inches).
SWEEP_BOX = (0.3, 0.48, 1.0, 1.45)
GRIPPER_BOX = (1.6, 0.1, 1.9, 2.05)
FIELD_BOXES = [(3.78 + 1.36 * i, 0.48, 1.33, 1.45) for i in range(len(MOMENTS))]
SPECTRUM_BOX = (8.3, 0.48, 1.15, 1.45)
DECISION_BOX = (9.9, 0.48, 1.6, 1.45)
#: Starts, height and length of the arrows between the parts (inches).
ARROWS_X = (1.36, 3.52, 7.84, 9.6)
ARROW_Y = 1.15
ARROW_LENGTH = 0.24


@styled
def opening_figure(opening: Opening) -> Figure:
    """Return the opening picture."""
    figure = Figure(figsize=OPENING_SIZE_IN)
    width, height = OPENING_SIZE_IN

    def axes(place: tuple[float, float, float, float]) -> Axes:
        left, bottom, wide, high = place
        return figure.add_axes((left / width, bottom / height, wide / width, high / height))

    pt = FONT_PT
    cut = section(opening.scene)
    _draw_sweep(axes(SWEEP_BOX), opening, pt)
    gripper = axes(GRIPPER_BOX)
    draw_section(gripper, opening.scene, cut, words(opening.object), pt)
    _bare(gripper, "", "", pt)
    for index, moment in enumerate(MOMENTS):
        field = axes(FIELD_BOXES[index])
        draw_pressure(field, opening.scene, cut, opening.film, index)
        _bare(field, moment, f"{1e3 * opening.film.times_s[index]:.2f} ms", pt)
    _draw_spectrum(axes(SPECTRUM_BOX), opening, pt)
    _draw_decision(axes(DECISION_BOX), opening, pt)
    for x in ARROWS_X:
        start = (x / width, ARROW_Y / height)
        end = ((x + ARROW_LENGTH) / width, ARROW_Y / height)
        style: dict[str, Any] = {"arrowstyle": "-|>", "mutation_scale": 1.3 * pt, "lw": 1.8}
        figure.add_artist(FancyArrowPatch(start, end, color=GREY, shrinkA=0, shrinkB=0, **style))
    badge = {"boxstyle": "round,pad=0.3", "color": SOURCE_COLOURS["simulated"]}
    bold: dict[str, Any] = {"fontsize": 0.75 * pt, "fontweight": "bold", "color": "white"}
    figure.text(0.12 / width, 0.14 / height, "simulated", va="center", bbox=badge, **bold)
    return figure


def _bare(axes: Axes, title: str, below: str, pt: float) -> None:
    """Remove ticks, grid and frame, and write a title and a text below."""
    axes.grid(False)
    axes.minorticks_off()
    axes.set(xticks=[], yticks=[])
    axes.spines[:].set_visible(False)
    axes.set_title(title, fontsize=pt, fontweight="bold", pad=5)
    axes.set_xlabel(below, fontsize=0.85 * pt, color=GREY, labelpad=3)


def _draw_sweep(axes: Axes, opening: Opening, pt: float) -> None:
    """Draw the spectrogram of the played sound."""
    frequency, times, power = spectrogram(opening.sweep, opening.sample_rate_hz, nperseg=1024)
    level = 10 * np.log10(np.maximum(power / power.max(), 1e-9))
    colours: dict[str, Any] = {"cmap": "Blues", "vmin": -30, "vmax": 0, "rasterized": True}
    axes.pcolormesh(times, frequency, level, **colours)
    axes.set_ylim(0, HIGHEST_HZ)
    seconds = len(opening.sweep) / opening.sample_rate_hz
    _bare(axes, "sweep in", f"{number(seconds, 2)} s", pt)
    axes.set_ylabel("frequency", fontsize=0.85 * pt, color=GREY, labelpad=2)
    axes.spines[["left", "bottom"]].set_visible(True)


def _draw_spectrum(axes: Axes, opening: Opening, pt: float) -> None:
    """Draw the feature of the recording over a logarithmic frequency axis."""
    is_audible = (opening.frequency_hz >= LOWEST_HZ) & (opening.frequency_hz <= HIGHEST_HZ)
    frequency = opening.frequency_hz[is_audible]
    level = opening.level_db[is_audible]
    floor = level.min() - 3
    outline_hz = [*frequency, frequency[-1], frequency[0]]
    outline_db = [*level, floor, floor]
    axes.fill(outline_hz, outline_db, color=COLOURS[4], alpha=0.35, lw=0)
    axes.plot(frequency, level, color=COLOURS[0], lw=1.0)
    _bare(axes, "spectrum out", "", pt)
    axes.set(xscale="log", xlim=(LOWEST_HZ, HIGHEST_HZ), ylim=(floor, level.max() + 3))
    axes.minorticks_off()
    axes.set_xticks([100, 1000, 10_000], ["0.1", "1", "10 kHz"], color=GREY, fontsize=0.85 * pt)
    axes.tick_params(axis="x", length=3, color=GREY)
    axes.set_ylabel("level", fontsize=0.85 * pt, color=GREY, labelpad=2)
    axes.spines[["left", "bottom"]].set_visible(True)


def _draw_decision(axes: Axes, opening: Opening, pt: float) -> None:
    """Write the predicted class and its probability."""
    sign = "✓"
    if opening.predicted != opening.object:
        sign = f"✗ ({words(opening.object)})"
    place: dict[str, Any] = {"ha": "center", "va": "center", "transform": axes.transAxes}
    text = fill(f"{words(opening.predicted)} {sign}", 16)
    axes.text(0.5, 0.6, text, fontsize=1.3 * pt, fontweight="bold", color=COLOURS[0], **place)
    axes.text(0.5, 0.25, f"probability {opening.probability:.2f}", fontsize=0.95 * pt, **place)
    _bare(axes, "decision", f"{opening.model}, new grasp", pt)


def alt_text(opening: Opening) -> str:
    """Return the alternative text of the picture, for people who cannot see it."""
    moments = [f"{1e3 * seconds:.2f}" for seconds in opening.film.times_s]
    seconds = number(len(opening.sweep) / opening.sample_rate_hz, 2)
    held = words(opening.object)
    return (
        f"Simulated section of a jamming gripper that holds a {held}: speaker and "
        f"microphone in the roof, air, grains in a membrane. A sweep of {seconds} s goes in; "
        f"the sound leaves the speaker ({moments[0]} ms), meets the {held} "
        f"({moments[1]} ms) and comes back ({moments[2]} ms); a spectrum comes out. "
        f"{opening.model}, trained without this grasp, predicts: {words(opening.predicted)}, "
        f"probability {opening.probability:.2f}. It was a {held}."
    )
