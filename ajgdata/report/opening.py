"""The opening picture: sweep in, gripper over an object, sound moving, spectrum out, decision.

With few words and hardly an axis: it shows what all of this is about, by one recording's numbers.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch
from numpy.typing import NDArray

from ajgdata.gripper.pressure_slices import Film
from ajgdata.gripper.scene import Scene
from ajgdata.report.canvas import COLOURS, GREY, SOURCE_COLOURS, styled
from ajgdata.report.format import Caption, number, words
from ajgdata.report.scenes import draw_pressure, draw_section, section

Real = NDArray[np.floating]
BAR, TRUE_BAR = "#b9c1c9", COLOURS[0]
#: As many classes as are shown of a decision.
CLASSES = 5
#: Of what is played, and of what is heard.
LOWEST_PLAYED_HZ, LOWEST_HZ, HIGHEST_HZ = 20.0, 100.0, 20_000.0
#: What the moments of the field are called.
MOMENTS = ("sound leaves", "meets object", "comes back")


class Decision(NamedTuple):
    """What a model that never heard the grasp says: probability by class, and the true class."""

    model: str
    probabilities: Mapping[str, float]
    true: str

    @property
    def likeliest(self) -> list[tuple[str, float]]:
        """Return the CLASSES likeliest classes, the true one among them, and probabilities."""
        ordered = sorted(self.probabilities.items(), key=lambda one: (-one[1], one[0]))
        shown = ordered[:CLASSES]
        if self.true not in dict(shown):
            shown[-1] = (self.true, self.probabilities[self.true])
        return shown


@dataclass(frozen=True, eq=False)
class Opening:
    """One recording of one grasp: its scene, what was played, what was heard, what was decided.

    The frames (n, up, across) of `film`, in the plane xz, are `moments_ms` (n,) after the pulse
    left. `sweep` (samples,) was played at `sample_rate_hz`; `level_db` (bins,) is the recording's
    feature at `frequency_hz` (bins,), in dB.
    """

    object: str
    scene: Scene
    film: Film
    moments_ms: tuple[float, ...]
    sweep: Real
    sample_rate_hz: int
    frequency_hz: Real
    level_db: Real
    decision: Decision | None = None


class Place(NamedTuple):
    """Lower left corner and size of a part of the picture, in inches."""

    left: float
    bottom: float
    width: float
    height: float


class Layout(NamedTuple):
    """Size of the picture, places of its parts, and arrows from (x, y) to (x, y), in inches."""

    size: tuple[float, float]
    font_pt: float
    sweep: Place
    gripper: Place
    fields: tuple[Place, ...]
    spectrum: Place
    decision: Place
    arrows: tuple[tuple[float, float, float, float], ...]
    badge: tuple[float, float]


#: All parts in a row, the head of a page; and below one another, for a phone.
WIDE = Layout(
    (11.6, 2.35),
    10.5,
    sweep=Place(0.3, 0.48, 1.0, 1.45),
    gripper=Place(1.6, 0.1, 1.9, 2.05),
    fields=tuple(Place(3.78 + 1.36 * i, 0.48, 1.33, 1.45) for i in range(len(MOMENTS))),
    spectrum=Place(8.3, 0.48, 1.15, 1.45),
    decision=Place(10.68, 0.48, 0.34, 1.45),
    arrows=tuple((x, 1.15, x + 0.24, 1.15) for x in (1.36, 3.52, 7.84, 9.49)),
    badge=(0.12, 0.14),
)
NARROW = Layout(
    (3.6, 5.4),
    8.5,
    sweep=Place(0.25, 3.95, 0.95, 1.15),
    gripper=Place(1.5, 3.62, 2.0, 1.76),
    fields=tuple(Place(0.06 + 1.17 * i, 2.05, 1.14, 1.22) for i in range(len(MOMENTS))),
    spectrum=Place(0.25, 0.5, 1.15, 1.1),
    decision=Place(2.58, 0.5, 0.5, 1.1),
    arrows=(
        (1.24, 4.5, 1.48, 4.5), (2.5, 3.64, 2.5, 3.44),
        (1.21, 2.0, 1.21, 1.8), (1.48, 1.0, 1.68, 1.0),
    ),
    badge=(2.9, 0.12),
)  # fmt: skip


@styled
def opening_figure(opening: Opening, layout: Layout = WIDE) -> Figure:
    """Return the picture; without a decision its place stays empty."""
    figure = Figure(figsize=layout.size)
    width, height = layout.size

    def axes(place: Place) -> Axes:
        left, bottom, wide, high = place
        return figure.add_axes((left / width, bottom / height, wide / width, high / height))

    pt, cut = layout.font_pt, section(opening.scene)
    _draw_sweep(axes(layout.sweep), opening, pt)
    gripper = axes(layout.gripper)
    draw_section(gripper, opening.scene, cut, opening.object, pt)
    _bare(gripper, "", "", pt)
    for index, place in enumerate(map(axes, layout.fields)):
        draw_pressure(place, opening.scene, cut, opening.film, index)
        _bare(place, MOMENTS[index], f"{opening.moments_ms[index]:.2f} ms", pt)
    _draw_spectrum(axes(layout.spectrum), opening, pt)
    if opening.decision is not None:
        _draw_decision(axes(layout.decision), opening.decision, pt)
    for x, y, to_x, to_y in layout.arrows:
        ends = (x / width, y / height), (to_x / width, to_y / height)
        style: dict[str, Any] = {"arrowstyle": "-|>", "mutation_scale": 1.3 * pt, "lw": 1.8}
        figure.add_artist(FancyArrowPatch(*ends, color=GREY, shrinkA=0, shrinkB=0, **style))
    badge = {"boxstyle": "round,pad=0.3", "color": SOURCE_COLOURS["simulated"]}
    bold: dict[str, Any] = {"fontsize": 0.75 * pt, "fontweight": "bold", "color": "white"}
    left, middle = layout.badge
    figure.text(left / width, middle / height, "simulated", va="center", bbox=badge, **bold)
    return figure


def _bare(axes: Axes, title: str, below: str, pt: float) -> None:
    """Take away what an axis has, and write a title and what stands below."""
    axes.grid(False)
    axes.minorticks_off()
    axes.set(xticks=[], yticks=[])
    axes.spines[:].set_visible(False)
    axes.set_title(title, fontsize=pt, fontweight="bold", pad=5)
    axes.set_xlabel(below, fontsize=0.85 * pt, color=GREY, labelpad=3)


def _draw_sweep(axes: Axes, opening: Opening, pt: float) -> None:
    """Draw time from left to right, frequency upwards, logarithmic."""
    level = scalogram_db(opening.sweep, opening.sample_rate_hz)
    axes.imshow(level, origin="lower", aspect="auto", cmap="Blues", vmin=-30, vmax=0,
                interpolation="none")  # fmt: skip
    seconds = len(opening.sweep) / opening.sample_rate_hz
    _bare(axes, "sweep in", f"{number(seconds, 2)} s", pt)
    axes.set_ylabel("frequency", fontsize=0.85 * pt, color=GREY, labelpad=2)
    axes.spines[["left", "bottom"]].set_visible(True)


def scalogram_db(samples: Real, sample_rate_hz: int, size: tuple[int, int] = (128, 160)) -> Real:
    """Return the level of `samples` (n,) in dB of the largest, (frequencies, times) of `size`.

    Frequencies from LOWEST_PLAYED_HZ to HIGHEST_HZ, or half the rate, in equal ratios. The filters
    are Gaussian in the logarithm of frequency.
    """
    rows, columns = size
    top = min(HIGHEST_HZ, sample_rate_hz / 2)
    centres = np.geomspace(LOWEST_PLAYED_HZ, top, rows)
    frequency = np.fft.fftfreq(2 * len(samples), 1 / sample_rate_hz)
    octaves = np.log2(np.maximum(frequency, 1e-3))
    spectrum = np.fft.fft(samples, 2 * len(samples))  # silence after it: its end is not its begin
    edges = np.linspace(0, len(samples), columns + 1).astype(int)
    power = np.empty(size)
    for row, centre in enumerate(np.log2(centres)):
        passed = np.fft.ifft(spectrum * np.exp(-0.5 * ((octaves - centre) / 0.12) ** 2))
        passed = passed[: len(samples)]
        power[row] = np.add.reduceat(np.abs(passed) ** 2, edges[:-1]) / np.diff(edges)
    return 10 * np.log10(np.maximum(power / (power.max() or 1), 1e-9))


def _draw_spectrum(axes: Axes, opening: Opening, pt: float) -> None:
    """Draw the recording's feature over the logarithm of frequency."""
    heard = (opening.frequency_hz >= LOWEST_HZ) & (opening.frequency_hz <= HIGHEST_HZ)
    frequency, level = opening.frequency_hz[heard], opening.level_db[heard]
    floor = level.min() - 3
    corners = [frequency[-1], frequency[0]], [floor, floor]
    under = (np.concatenate(pair) for pair in zip((frequency, level), corners, strict=True))
    axes.fill(*under, color=COLOURS[4], alpha=0.35, lw=0)
    axes.plot(frequency, level, color=COLOURS[0], lw=1.0)
    _bare(axes, "spectrum out", "", pt)
    axes.set(xscale="log", xlim=(LOWEST_HZ, HIGHEST_HZ), ylim=(floor, level.max() + 3))
    axes.minorticks_off()
    axes.set_xticks([100, 1000, 10_000], ["0.1", "1", "10 kHz"], color=GREY, fontsize=0.85 * pt)
    axes.tick_params(axis="x", length=3, color=GREY)
    axes.set_ylabel("level", fontsize=0.85 * pt, color=GREY, labelpad=2)
    axes.spines[["left", "bottom"]].set_visible(True)


def _draw_decision(axes: Axes, decision: Decision, pt: float) -> None:
    """Draw the likeliest classes as bars; the true one in colour, with a tick."""
    shown = decision.likeliest
    most = max(p for _, p in shown)
    for y, (name, p) in enumerate(shown):
        right = name == decision.true
        axes.barh(y, p, 0.72, color=TRUE_BAR if right else BAR)
        style: dict[str, Any] = {"va": "center", "fontsize": 0.95 * pt}
        style["fontweight"] = "bold" if right else "normal"
        axes.text(-0.06 * most, y, words(name), ha="right", **style)
        axes.text(p + 0.06 * most, y, f"{p:.2f}{' ✓' if right else ''}", **style)
    axes.set(xlim=(0, most), ylim=(CLASSES - 0.5, -0.5))
    _bare(axes, "decision", "", pt)
    axes.set_xlabel(f"{decision.model}, new grasp", fontsize=0.85 * pt, color=GREY, labelpad=3)


def opening_caption(opening: Opening) -> Caption:
    """Return words below the picture, and those for a person who cannot see it."""
    moments = [f"{ms:.2f}" for ms in opening.moments_ms]
    seconds = number(len(opening.sweep) / opening.sample_rate_hz, 2)
    alt = (
        f"Simulated section of a jamming gripper that holds a {opening.object}: speaker and "
        f"microphone in the roof, air, grains in a membrane. A sweep of {seconds} s goes in; "
        f"the sound leaves the speaker ({moments[0]} ms), meets the {opening.object} "
        f"({moments[1]} ms) and comes back ({moments[2]} ms); a spectrum comes out."
    )
    if opening.decision is not None:
        said = ", ".join(f"{words(name)} {p:.2f}" for name, p in opening.decision.likeliest)
        alt += (
            f" {opening.decision.model}, which never heard this grasp, says: {said}. It was a "
            f"{words(opening.decision.true)}."
        )
    return Caption(
        "What this is about, by one simulated grasp: what is played, the gripper cut through its "
        "axis, the pressure of a short pulse at three moments (red above rest, blue below), the "
        "spectrum of the recording, and the decision of a model that never heard this grasp.",
        alt,
    )
