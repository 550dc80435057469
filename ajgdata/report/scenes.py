"""Drawings of a scene: its cross-section, and the pressure inside."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from numpy.typing import NDArray
from scipy.ndimage import binary_closing, zoom

from ajgdata.gripper.geometry import grasp_cavity
from ajgdata.gripper.pressure_frames import PressureFrames
from ajgdata.gripper.relief import RASTER_M, relief
from ajgdata.gripper.scene import Scene
from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, new_figure, styled
from ajgdata.report.format import number

Real = NDArray[np.floating]
AIR_COLOUR, GRAINS_COLOUR, OBJECT_COLOUR = "#eaf3fa", "#dcc9a3", "#9aa3ad"
MEMBRANE_COLOURS, TOUCHING = "#D55E00", "#7a2f00"
#: Objects that look the same upside down; the others are drawn as the membrane meets them, from
#: above, with what hangs over filled below.
UPSIDE_DOWN = ("rod", "sphere", "ellipsoid")
#: How far below the membrane a drawing goes.
DEEPEST_MM = 40.0
WALL, SPEAKER, MICROPHONE = "#333333", COLOURS[0], COLOURS[2]
ABOVE, BELOW = "#b2182b", "#2166ac"
TEXT_PT = 10.0
#: Pixels of a field between two cells of the grid, so that no viewer shows its squares.
PIXELS_PER_CELL = 3
#: Room around the gripper, mm: beside the rim, below the table, above the roof, and for names.
BESIDE_MM, BELOW_MM, ABOVE_MM, NAMES_MM = 7.0, 4.0, 4.0, 11.0


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
    """Return the cut through the axis of the cavity. Raises SceneError without a cavity."""
    shape = grasp_cavity(scene)
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
def cross_section_figure(scene: Scene, title: str, name: str = "") -> Figure:
    """Return a drawing of the plane y = 0: housing, grains, membrane, transducers and object.

    `name` is the label of the object (default: its kind).
    """
    about = f"{scene.medium.kind}, bed {number(scene.gripper.bed_depth_mm)} mm"
    about += f", {number(scene.grasp.force_n)} N, {number(scene.grasp.angle_deg)}°"
    figure = new_figure((WIDTH_IN, 4.9), title, about, ["simulated"])
    axes = figure.subplots()
    name = name or (scene.object.kind if scene.object is not None else "")
    draw_section(axes, scene, section(scene), name, TEXT_PT)
    axes.set(xlabel="x (mm), cut at y = 0", ylabel="height over the rim (mm)")
    axes.grid(False)
    axes.legend(loc="upper left", bbox_to_anchor=(1, 1))
    return figure


def draw_section(axes: Axes, scene: Scene, cut: Section, held: str, pt: float) -> None:
    """Draw the cut through gripper and object with the names of the parts; `held` is the object."""
    gripper, (low, high) = scene.gripper, _heights(scene, cut)
    _draw_parts(axes, scene, cut, lw=1.2)
    _fit(axes, scene, low, high + NAMES_MM)
    name: dict[str, Any] = {"fontsize": 0.85 * pt, "ha": "center", "va": "center"}
    above = gripper.height_mm + NAMES_MM
    axes.text(gripper.speaker_mm[0] + 6, above, "speaker", color=SPEAKER, **name)
    axes.text(gripper.microphone_mm[0] - 6, above, "microphone", color=MICROPHONE, **name)
    if cut.table is None or not np.any(cut.inside):
        return
    at, top = float(np.mean(cut.x[cut.inside])), float(np.max(cut.top[cut.inside]))
    middle = (max(low, float(np.min(cut.below[cut.inside]))) + top) / 2
    bold: dict[str, Any] = {"color": "white", "fontweight": "bold", "linespacing": 0.95}
    axes.text(at, middle, held.replace(" ", "\n"), **bold, **name)


def draw_pressure(axes: Axes, scene: Scene, cut: Section, film: PressureFrames, index: int) -> None:
    """Draw the pressure of a frame of `film` (plane xz) over the cut: clear where nothing moves."""
    _draw_parts(axes, scene, cut, lw=1.0)
    half = 500 * (film.up_m[1] - film.up_m[0])
    left, right = 1e3 * film.across_m[0] - half, 1e3 * film.across_m[-1] + half
    low, high = 1e3 * film.up_m[0] - half, 1e3 * film.up_m[-1] + half
    shown = axes.imshow(
        colours_of(film.frames)[index], origin="lower", extent=(left, right, low, high),
        interpolation="none", zorder=1.5,
    )  # fmt: skip
    x, floor, *_ = _membrane(scene, cut)
    roof, height = scene.gripper.roof_radius_mm, scene.gripper.height_mm
    inside = [*zip(x, floor, strict=True), (roof, height), (-roof, height)]
    shown.set_clip_path(Polygon(inside, transform=axes.transData))
    _fit(axes, scene, *_heights(scene, cut))


def colours_of(frames: Real) -> NDArray[np.uint8]:
    """Return frames (n, up, across) as RGBA, on one scale, with PIXELS_PER_CELL² pixels per cell.

    Red above rest, blue below, the clearer the weaker: asinh, so that echoes are seen next to the
    pulse.
    """
    fine = (1, PIXELS_PER_CELL, PIXELS_PER_CELL)
    smooth = zoom(np.asarray(frames, float), fine, order=3, grid_mode=True, mode="nearest")
    strength = np.arcsinh(12 * smooth / (np.abs(smooth).max() or 1)) / np.arcsinh(12)
    colours = np.empty((*strength.shape, 4))
    colours[..., :3] = np.where(strength[..., None] > 0, to_rgb(ABOVE), to_rgb(BELOW))
    colours[..., 3] = np.minimum(1.5 * np.abs(strength), 1)
    return np.round(255 * colours).astype(np.uint8)


def _draw_parts(axes: Axes, scene: Scene, cut: Section, lw: float) -> None:
    """Draw gripper, filling, membrane and object in mm, cut at y = 0, and the two transducers."""
    gripper = scene.gripper
    rim, roof, height = gripper.rim_radius_mm, gripper.roof_radius_mm, gripper.height_mm
    x, floor, surface, touching = _membrane(scene, cut)
    axes.fill(
        [-rim, -roof, roof, rim, *x[::-1]], [0, height, height, 0, *floor[::-1]], color=AIR_COLOUR
    )
    bed = [*floor, *np.maximum(surface, floor)[::-1]]
    axes.fill([*x, *x[::-1]], bed, color=GRAINS_COLOUR, lw=0, label="grains")
    if cut.table is not None:
        below = np.maximum(cut.below, float(np.min(floor)) - DEEPEST_MM)
        held = cut.inside.tolist()
        axes.fill_between(cut.x, below, cut.top, where=held, color=OBJECT_COLOUR, lw=0)
        axes.axhline(cut.table, color=GREY, lw=lw)
    axes.plot([-rim, -roof, roof, rim], [0, height, height, 0], color=WALL, lw=2.2 * lw)
    axes.plot(x, floor, color=MEMBRANE_COLOURS, lw=1.5 * lw, label="membrane")
    axes.plot(
        x, np.where(touching >= 0.5, floor, np.nan), color=TOUCHING, lw=2.2 * lw, label="contact"
    )
    for (across, _), marker, colour in (
        (gripper.speaker_mm, "v", SPEAKER), (gripper.microphone_mm, "o", MICROPHONE),
    ):  # fmt: skip
        axes.plot(across, height, marker, color=colour, ms=7 * lw, mec="white", zorder=5)


def _membrane(scene: Scene, cut: Section) -> tuple[Real, Real, Real, Real]:
    """Return x, height of the membrane and of the grains, and contact, from rim to rim (n,) mm.

    Every second place of the raster is enough for a small picture.
    """
    open_ = np.flatnonzero(cut.roof > cut.floor)[::2]
    rim = scene.gripper.rim_radius_mm
    ends = ([-rim], [rim]), ([0], [0]), ([0], [0]), ([0], [0])
    of = (cut.x, cut.floor, cut.surface, cut.contact)
    x, floor, surface, touching = (
        np.concatenate([pair[0], values[open_], pair[1]])
        for pair, values in zip(ends, of, strict=True)
    )
    return x, floor, surface, touching


def _heights(scene: Scene, cut: Section) -> tuple[float, float]:
    """Return lowest and highest of what is drawn, in mm: a tall object's foot is cut off."""
    low = float(np.min(cut.floor))
    foot = low if cut.table is None else max(min(low, cut.table), low - DEEPEST_MM)
    return foot - BELOW_MM, scene.gripper.height_mm + ABOVE_MM


def _fit(axes: Axes, scene: Scene, low: float, high: float) -> None:
    """Show all from `low` to `high` and the whole rim, in one scale, from the top."""
    reach = scene.gripper.rim_radius_mm + BESIDE_MM
    axes.set(xlim=(-reach, reach), ylim=(low, high))
    axes.set_aspect("equal", adjustable="box", anchor="N")
