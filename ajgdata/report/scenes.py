"""Drawings of a scene: the cross-section, and the pressure in the cavity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

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
AIR_COLOUR = "#eaf3fa"
GRAINS_COLOUR = "#dcc9a3"
OBJECT_COLOUR = "#9aa3ad"
MEMBRANE_COLOUR = "#D55E00"
CONTACT_COLOUR = "#7a2f00"
WALL_COLOUR = "#333333"
SPEAKER_COLOUR = COLOURS[0]
MICROPHONE_COLOUR = COLOURS[2]
#: Colours of a pressure above and below the pressure at rest.
HIGH_COLOUR = "#b2182b"
LOW_COLOUR = "#2166ac"
#: Kinds of objects whose lower side mirrors the upper side. Other objects are drawn down to the
#: table below each place of the upper side, also where they overhang.
SYMMETRIC_OBJECTS = ("rod", "sphere", "ellipsoid")
#: Depth of a drawing below the lowest place of the membrane.
DEEPEST_MM = 40.0
#: Notches of an object up to twice this width are filled, because the membrane spans them.
NOTCH_M = 2e-3
TEXT_PT = 10.0
#: Pixels per cell of the grid and direction, so that no viewer shows the cells as squares.
PIXELS_PER_CELL = 3
#: Margins of a drawing: next to the rim, below the object, above the roof, and for names.
BESIDE_MM = 7.0
BELOW_MM = 4.0
ABOVE_MM = 4.0
NAMES_MM = 11.0
#: Places of the raster per place of a drawing; a small picture needs no more.
RASTER_STEP = 2


@dataclass(frozen=True)
class Section:
    """The cut y = 0 through a cavity; all heights are in mm.

    - `x`: places (n,), in mm
    - `floor`, `roof`, `surface`: heights (n,) of membrane, roof and grains
    - `contact`: share (n,) of the membrane that touches the object
    - `table`: height of the table; None without an object
    - `top`, `below`: heights (n,) of the upper and lower side of the object
    - `inside`: True (n,) at places of the object
    """

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
    x = shape.axis
    row = int(np.argmin(np.abs(x)))
    table = None
    inside = np.zeros(x.shape, bool)
    top = np.zeros_like(x)
    below = np.zeros_like(x)
    if scene.object is not None and shape.table_m is not None:
        seen = relief(scene, *np.meshgrid(x, x))
        table = 1e3 * shape.table_m
        inside = binary_closing(seen.inside[row] > 0.5, iterations=round(NOTCH_M / RASTER_M))
        top = table + 1e3 * np.maximum(seen.height[row], 0)
        below = np.full(x.shape, table)
        if scene.object.kind in SYMMETRIC_OBJECTS:
            below = 2 * table + scene.object.size_mm[2] - top
    return Section(
        x=1e3 * x,
        floor=1e3 * shape.floor[row],
        roof=1e3 * shape.roof[row],
        surface=1e3 * shape.surface[row],
        contact=shape.contact[row],
        table=table,
        top=top,
        below=below,
        inside=inside,
    )


@styled
def cross_section_figure(scene: Scene, title: str, name: str = "") -> Figure:
    """Return a drawing of the plane y = 0: housing, grains, membrane, transducers and object.

    `name` is the label of the object (default: its kind).
    """
    about = (
        f"{scene.medium.kind}, bed {number(scene.gripper.bed_depth_mm)} mm,"
        f" {number(scene.grasp.force_n)} N, {number(scene.grasp.angle_deg)}°"
    )
    figure = new_figure((WIDTH_IN, 4.9), title, about, ["simulated"])
    axes = figure.subplots()
    if not name and scene.object is not None:
        name = scene.object.kind
    draw_section(axes, scene, section(scene), name, TEXT_PT)
    axes.set(xlabel="x (mm), cut at y = 0", ylabel="height over the rim (mm)")
    axes.grid(False)
    axes.legend(loc="upper left", bbox_to_anchor=(1, 1))
    return figure


def draw_section(axes: Axes, scene: Scene, cut: Section, held: str, pt: float) -> None:
    """Draw the cut through gripper and object, with the names of the parts.

    `held` is the name of the object, and `pt` the size of the text.
    """
    gripper = scene.gripper
    low, high = _heights(scene, cut)
    _draw_parts(axes, scene, cut, lw=1.2)
    _fit(axes, scene, low, high + NAMES_MM)
    name: dict[str, Any] = {"fontsize": 0.85 * pt, "ha": "center", "va": "center"}
    above = gripper.height_mm + NAMES_MM
    axes.text(gripper.speaker_mm[0] + 6, above, "speaker", color=SPEAKER_COLOUR, **name)
    axes.text(gripper.microphone_mm[0] - 6, above, "microphone", color=MICROPHONE_COLOUR, **name)
    if cut.table is None or not np.any(cut.inside):
        return
    at = float(np.mean(cut.x[cut.inside]))
    top = float(np.max(cut.top[cut.inside]))
    bottom = max(low, float(np.min(cut.below[cut.inside])))
    middle = (bottom + top) / 2
    bold: dict[str, Any] = {"color": "white", "fontweight": "bold", "linespacing": 0.95}
    axes.text(at, middle, held.replace(" ", "\n"), **bold, **name)


def draw_pressure(axes: Axes, scene: Scene, cut: Section, film: PressureFrames, index: int) -> None:
    """Draw the pressure in a frame of `film` (plane xz) over the cut; still air is transparent."""
    _draw_parts(axes, scene, cut, lw=1.0)
    half_cell = 1e3 * (film.up_m[1] - film.up_m[0]) / 2
    extent = (
        1e3 * film.across_m[0] - half_cell,
        1e3 * film.across_m[-1] + half_cell,
        1e3 * film.up_m[0] - half_cell,
        1e3 * film.up_m[-1] + half_cell,
    )
    pixels = colours_of(film.frames)[index]
    shown = axes.imshow(pixels, origin="lower", extent=extent, interpolation="none", zorder=1.5)
    membrane = _membrane(scene, cut)
    roof = scene.gripper.roof_radius_mm
    height = scene.gripper.height_mm
    inside = [*zip(membrane.x, membrane.floor, strict=True), (roof, height), (-roof, height)]
    shown.set_clip_path(Polygon(inside, transform=axes.transData))
    _fit(axes, scene, *_heights(scene, cut))


def colours_of(frames: Real) -> NDArray[np.uint8]:
    """Return frames (n, up, across) as RGBA on one scale, with PIXELS_PER_CELL² pixels per cell.

    Red is a pressure above rest, and blue below; weak pressures are transparent. The scale is
    asinh, which shows echoes next to the pulse.
    """
    fine = (1, PIXELS_PER_CELL, PIXELS_PER_CELL)
    smooth = zoom(np.asarray(frames, float), fine, order=3, grid_mode=True, mode="nearest")
    strength = np.arcsinh(12 * smooth / (np.abs(smooth).max() or 1)) / np.arcsinh(12)
    colours = np.empty((*strength.shape, 4))
    colours[..., :3] = np.where(strength[..., None] > 0, to_rgb(HIGH_COLOUR), to_rgb(LOW_COLOUR))
    colours[..., 3] = np.minimum(1.5 * np.abs(strength), 1)
    return np.round(255 * colours).astype(np.uint8)


def _draw_parts(axes: Axes, scene: Scene, cut: Section, lw: float) -> None:
    """Draw gripper, filling, membrane and object in mm, cut at y = 0, and the two transducers."""
    gripper = scene.gripper
    membrane = _membrane(scene, cut)
    x = membrane.x
    floor = membrane.floor
    wall_x = [
        -gripper.rim_radius_mm,
        -gripper.roof_radius_mm,
        gripper.roof_radius_mm,
        gripper.rim_radius_mm,
    ]
    wall_height = [0, gripper.height_mm, gripper.height_mm, 0]
    axes.fill([*wall_x, *x[::-1]], [*wall_height, *floor[::-1]], color=AIR_COLOUR)
    bed = [*floor, *np.maximum(membrane.surface, floor)[::-1]]
    axes.fill([*x, *x[::-1]], bed, color=GRAINS_COLOUR, lw=0, label="grains")
    if cut.table is not None:
        below = np.maximum(cut.below, float(np.min(floor)) - DEEPEST_MM)
        held = cut.inside.tolist()
        axes.fill_between(cut.x, below, cut.top, where=held, color=OBJECT_COLOUR, lw=0)
        axes.axhline(cut.table, color=GREY, lw=lw)
    axes.plot(wall_x, wall_height, color=WALL_COLOUR, lw=2.2 * lw)
    axes.plot(x, floor, color=MEMBRANE_COLOUR, lw=1.5 * lw, label="membrane")
    contact = np.where(membrane.contact >= 0.5, floor, np.nan)
    axes.plot(x, contact, color=CONTACT_COLOUR, lw=2.2 * lw, label="contact")
    style: dict[str, Any] = {"ms": 7 * lw, "mec": "white", "zorder": 5}
    height = gripper.height_mm
    axes.plot(gripper.speaker_mm[0], height, "v", color=SPEAKER_COLOUR, **style)
    axes.plot(gripper.microphone_mm[0], height, "o", color=MICROPHONE_COLOUR, **style)


class MembraneLine(NamedTuple):
    """The membrane from rim to rim: `x`, its height, that of the grains (n,) in mm, and contact."""

    x: Real
    floor: Real
    surface: Real
    contact: Real


def _membrane(scene: Scene, cut: Section) -> MembraneLine:
    """Return the membrane of a cut, which is at height 0 at both rims."""
    rim = scene.gripper.rim_radius_mm
    cavity = np.flatnonzero(cut.roof > cut.floor)[::RASTER_STEP]
    return MembraneLine(
        x=np.concatenate([[-rim], cut.x[cavity], [rim]]),
        floor=np.concatenate([[0], cut.floor[cavity], [0]]),
        surface=np.concatenate([[0], cut.surface[cavity], [0]]),
        contact=np.concatenate([[0], cut.contact[cavity], [0]]),
    )


def _heights(scene: Scene, cut: Section) -> tuple[float, float]:
    """Return the lowest and highest place of a drawing (mm); the foot of a tall object is cut."""
    low = float(np.min(cut.floor))
    foot = low
    if cut.table is not None:
        foot = max(min(low, cut.table), low - DEEPEST_MM)
    return foot - BELOW_MM, scene.gripper.height_mm + ABOVE_MM


def _fit(axes: Axes, scene: Scene, low: float, high: float) -> None:
    """Show heights from `low` to `high` (mm) and the complete rim, with equal scales."""
    reach = scene.gripper.rim_radius_mm + BESIDE_MM
    axes.set(xlim=(-reach, reach), ylim=(low, high))
    axes.set_aspect("equal", adjustable="box", anchor="N")
