"""The cavity of a grasp: where the membrane lies, where the grains end, where the roof is.

Everything is a height over the plane of the rim, on a raster of 0.5 mm that knows nothing of the
solver's grid, so that refining the grid refines the solution and not the scene. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, next_fast_len, rfft2
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.optimize import brentq

from ajgdata.gripper.objects import MM, SceneError
from ajgdata.gripper.random_fields import RandomField, normals
from ajgdata.gripper.relief import RASTER_M, Relief, draped, relief
from ajgdata.gripper.scene import Scene, as_met, derive_seed

Real = NDArray[np.floating]
#: Meridians of the membrane, for the width that no grains cover, and points on each.
MERIDIANS = 64
POINTS = 129


class Strip(NamedTuple):
    """A closed strip of the membrane: mean width (m) and area (m²)."""

    width_m: float
    area_m2: float


@dataclass(frozen=True)
class Cavity:
    """Heights in m at the positions `axis` x `axis` (y first), and the share of contact.

    Between `floor` (membrane) and `roof` there is air above `surface` and grains below it; where
    `floor` >= `roof` there is nothing. Where `surface` is below `floor`, the membrane is bare.
    `contact` is 1 where the membrane lies on the object or on the table, `held` where on the
    object, which `force_n` presses. The table lies at `table_m`.
    """

    axis: Real
    floor: Real
    roof: Real
    surface: Real
    contact: Real
    held: Real
    table_m: float | None
    displaced_m3: float
    force_n: float

    def at(self, x: Real, y: Real) -> tuple[Real, Real, Real, Real]:
        """Floor, roof, surface, contact on the grid (y, x), by bilinear interpolation."""
        along_y, along_x = np.meshgrid(y, x, indexing="ij")
        floor, roof, surface, contact = (
            self.sampled(field, along_x, along_y)
            for field in (self.floor, self.roof, self.surface, self.contact)
        )
        return floor, roof, surface, contact

    def bare_edge(self, rim: float) -> Strip:
        """Return the membrane between the grains and the rim, whose radius is `rim` (m).

        Its width is the length, along the meridians of the membrane, on which neither grains nor an
        object lie, averaged over azimuths. Both numbers depend on the shape of the cavity alone, so
        they are the same on each grid of the solver.
        """
        azimuth = np.linspace(0, 2 * np.pi, MERIDIANS, endpoint=False)[:, None]
        # Points are denser near the rim, where the balloon is steep.
        radius = rim * np.sin(np.linspace(0, np.pi / 2, POINTS))
        x = radius * np.cos(azimuth)
        y = radius * np.sin(azimuth)
        floor, surface, contact = (
            self.sampled(field, x, y) for field in (self.floor, self.surface, self.contact)
        )
        floor[:, -1] = 0.0  # the rim; the raster is too coarse for the last step up to it
        length = np.hypot(np.diff(radius), np.diff(floor))
        touching = (contact[:, 1:] + contact[:, :-1]) / 2
        bare = length * _negative_share(surface - floor) * (1 - touching)
        middle = (radius[1:] + radius[:-1]) / 2
        area = 2 * np.pi * (bare * middle).sum(axis=1).mean()
        return Strip(float(bare.sum(axis=1).mean()), float(area))

    def sampled(self, field: Real, x: Real, y: Real) -> Real:
        """Return `field` at the points (x, y) in m, by bilinear interpolation."""
        position = (y - self.axis[0]) / RASTER_M, (x - self.axis[0]) / RASTER_M
        return np.asarray(map_coordinates(field, position, order=1, mode="nearest"))


def _negative_share(level: Real) -> Real:
    """Return the share of each interval on which `level` (…, n), linear in it, is negative,
    (…, n - 1)."""
    before, after = level[..., :-1], level[..., 1:]
    below = np.maximum(-before, 0) + np.maximum(-after, 0)
    above = np.maximum(before, 0) + np.maximum(after, 0)
    return np.divide(below, below + above, out=np.zeros_like(below), where=below + above > 0)


def cavity(scene: Scene) -> Cavity:
    """Press the gripper on the object until force and stiffness agree, and settle the grains.

    Raises SceneError if the object does not fit under the gripper.
    """
    scene = as_met(scene)
    gripper = scene.gripper
    rim, roof_z = gripper.rim_radius_mm * MM, gripper.height_mm * MM
    half = int(np.ceil(rim / RASTER_M)) + 12
    axis = np.arange(-half, half + 1) * RASTER_M
    x, y = np.meshgrid(axis, axis)
    radius = np.hypot(x, y)
    taper = rim - gripper.roof_radius_mm * MM
    roof = np.clip((rim - radius) / taper, 0, 1) * roof_z
    free = _balloon(scene, x, y)
    force = _force(scene)
    floor, contact, held, table = _press(scene, x, y, free, force)
    _refuse_pinched(scene, floor, free, roof)
    displaced = float(np.sum(floor - free)) * RASTER_M**2
    surface = _settle(scene, axis, roof, floor, free)
    return Cavity(axis, floor, roof, surface, contact, held, table, displaced, force)


def _balloon(scene: Scene, x: Real, y: Real) -> Real:
    """Height of the free balloon: half of an ellipsoid, its tip moved and its rim held.

    At p lies what lay at p - askew (1 - |p|²/R²). Volume changes in second order of askew / R.
    """
    rim, depth = scene.gripper.rim_radius_mm * MM, scene.gripper.balloon_depth_mm * MM
    across, along = (offset * MM for offset in scene.assembly.askew_mm)
    inside = np.clip(1 - (np.hypot(x, y) / rim) ** 2, 0, None)
    radius = np.hypot(x - across * inside, y - along * inside)
    return -depth * np.sqrt(np.clip(1 - (radius / rim) ** 2, 0, None))


def _refuse_pinched(scene: Scene, floor: Real, free: Real, roof: Real) -> None:
    """Above the rim, where the membrane was raised, the cavity stays open, also at the cone."""
    raised = (floor > 0) & (floor - free > RASTER_M)
    gap = np.min(np.where(raised, roof - floor, np.inf)) / MM
    if gap < scene.gripper.clearance_mm:
        raise SceneError(
            f"object {_title(scene)} pinches the cavity to {max(gap, 0):.1f} mm of at least "
            f"{scene.gripper.clearance_mm:g} mm: make it lower, move it to the axis, or lower "
            f"grasp.force_n {scene.grasp.force_n:g}"
        )


def _title(scene: Scene) -> str:
    return scene.object.title if scene.object else "none"


def _force(scene: Scene) -> float:
    """Force of this grasp in N."""
    if scene.object is None:
        return 0.0
    draw = np.random.default_rng(derive_seed(scene.grasp.seed, "force")).standard_normal()
    return scene.grasp.force_n * max(0.1, 1 + scene.grasp.nuisance.force * float(draw))


def _press(
    scene: Scene, x: Real, y: Real, free: Real, force: float
) -> tuple[Real, Real, Real, float | None]:
    """Height of the membrane, where it lies on the object or on the table, where on the object,
    and the height of the table."""
    if scene.object is None:
        return free, np.zeros_like(free), np.zeros_like(free), None
    bare = relief(scene, x, y)
    within = free < 0
    if not np.any(bare.inside[within] > 0):
        raise SceneError(
            f"object {_title(scene)} lies outside the rim: reduce grasp.offset_x_mm "
            f"{scene.grasp.offset_x_mm:g} or grasp.offset_y_mm {scene.grasp.offset_y_mm:g}"
        )
    shape = draped(bare, _bending_radius(scene, bare, free[within], within, force))
    table = _table(scene, shape, free, within, force * _yielding(scene, shape, within))
    over = table + np.maximum(shape.height, 0) - free
    # Grains press in spots one diameter d apart: a disc of d has the standard deviation d/4.
    smoothing = max(_grain(scene) / 4, RASTER_M) / RASTER_M
    raised = np.where(within, np.maximum(over, 0), 0.0)
    rise = np.where(within, gaussian_filter(raised, smoothing), 0.0)
    # What smoothing carried over the rim comes back, so that the force law holds.
    rise *= raised.sum() / rise.sum()
    pressed = _edge(over) * within
    contact, held = (
        np.clip(gaussian_filter(touching * pressed, smoothing), 0, 1)
        for touching in (np.maximum(shape.touching, shape.adjacent), shape.touching)
    )
    return free + rise, contact, held, table


def _bending_radius(
    scene: Scene, bare: Relief, under: Real, within: NDArray[np.bool_], force: float
) -> float:
    """Radius (m) of the membrane where it touches nothing: T/p, and no less than a grain's.

    p is the force over what would be pressed if the membrane followed every edge.
    """
    over = np.maximum(bare.height[within], 0) - under
    goal = force / (scene.gripper.stiffness_n_m3 * RASTER_M**2)

    def excess(table: float) -> float:
        return float(np.clip(table + over, 0, None).sum()) - goal

    # At the upper end the mean height alone is the force.
    table = brentq(excess, -float(over.max()), goal / over.size - float(over.min()), xtol=1e-7)
    # Of the volume, by the depth: smooth in all sizes, other than a count of samples.
    pressed = np.clip(0.5 + (table + over) / RASTER_M, 0, 1).sum() * RASTER_M**2
    pressure = force / pressed
    return max(scene.gripper.tension_n_m / pressure, _grain(scene) / 2, RASTER_M)


def _grain(scene: Scene) -> float:
    """Diameter of the grains, m; 0 where there are none."""
    return 0.0 if scene.medium.kind == "air" else scene.medium.grain_diameter_mm * MM


def _yielding(scene: Scene, shape: Relief, within: NDArray[np.bool_]) -> float:
    """Volume that this bed yields to a force, relative to the mean.

    N = (D/d)² grains of diameter d lie on an object as wide as a disc of diameter D; their forces,
    each of standard deviation `grain_force`, scatter in sum by √N less (central limit theorem).
    """
    scatter = scene.grasp.nuisance.grain_force
    if scene.medium.kind == "air" or scatter == 0:
        return 1.0
    width = np.sqrt(4 / np.pi * float(shape.inside[within].sum())) * RASTER_M
    few = _grain(scene) / max(width, _grain(scene))
    draw = np.random.default_rng(derive_seed(scene.grasp.seed, "yielding")).standard_normal()
    return max(0.1, 1 + scatter * few * float(draw))


def _edge(level: Real) -> Real:
    """1 where `level` is positive, 0 where it is negative, and in between along its zero line."""
    slope = np.hypot(*np.gradient(level))
    return np.clip(0.5 + level / np.maximum(slope, 1e-12), 0, 1)


def _table(
    scene: Scene, shape: Relief, free: Real, within: NDArray[np.bool_], force: float
) -> float:
    """Height of the table (m) at which the displaced volume answers the force."""
    under, over = free[within], np.maximum(shape.height[within], 0)
    goal = force / scene.gripper.stiffness_n_m3

    def excess(table: float) -> float:
        return float(np.clip(table + over - under, 0, None).sum()) * RASTER_M**2 - goal

    room = (scene.gripper.height_mm - scene.gripper.clearance_mm) * MM
    under_roof = room - float(over.max())
    if excess(min(0.0, under_roof)) < 0:
        raise SceneError(_unheld(scene, force, under_roof))
    table = brentq(excess, float(np.min(under - over)), min(0.0, under_roof), xtol=1e-9)
    under_rim = table + np.where(shape.inside > 0, shape.height, 0.0)[~within]
    if under_rim.max() > 0:
        raise SceneError(
            f"object {_title(scene)} would stand against the housing's rim: make it smaller or "
            "lower, or move it to the axis"
        )
    return float(table)


def _unheld(scene: Scene, force: float, under_roof: float) -> str:
    """Why the force cannot be reached, in one line."""
    what = f"object {_title(scene)}"
    fix = f"or lower grasp.force_n, to hold {force:.3g} N"
    if under_roof >= 0:
        return f"{what} lets the rim stand on the table: make it larger or higher, {fix}"
    return f"{what} pinches the cavity to its clearance: make it lower or wider, {fix}"


def _settle(scene: Scene, axis: Real, roof: Real, floor: Real, free: Real) -> Real:
    """Return the height (m) of the grains' free surface, also where it is below the membrane.

    Their volume is kept, imprints heave, no surface is smooth.
    """
    medium, nuisance = scene.medium, scene.grasp.nuisance
    if medium.kind == "air":
        return floor
    seed, history = scene.grasp.seed, scene.grasp.history
    level = scene.gripper.bed_depth_mm * MM - scene.gripper.balloon_depth_mm * MM
    volume = np.sum(np.clip(np.minimum(level, roof) - free, 0, None))
    correlation = nuisance.roughness_correlation_mm * MM
    rough = RandomField(seed, "roughness", 2, correlation, history)
    tilt = normals(seed, "slope", 2, history) * np.tan(np.deg2rad(nuisance.slope_deg))
    tilt += np.tan(np.deg2rad(scene.assembly.fill_slope_deg))
    shape = _heave(scene, floor, free, level) + nuisance.roughness_mm * MM * rough.on_axes(
        axis, axis
    )
    shape += tilt[0] * axis[None, :] + tilt[1] * axis[:, None]

    def excess(height: float | np.floating) -> float:
        return float(np.sum(np.clip(np.minimum(height + shape, roof) - floor, 0, None)) - volume)

    inside = roof > floor
    lowest, highest = np.min((floor - shape)[inside]), np.max((roof - shape)[inside])
    if excess(highest) < 0:
        raise SceneError(
            f"the grains no longer fit: lower gripper.bed_depth_mm {scene.gripper.bed_depth_mm:g} "
            f"or grasp.force_n {scene.grasp.force_n:g}"
        )
    height = brentq(excess, lowest, highest, xtol=1e-9)
    surface = height + shape
    ceiling = (scene.gripper.height_mm - scene.gripper.clearance_mm) * MM
    if np.max(np.minimum(surface, roof)) > ceiling:
        raise SceneError(
            "the grains would bury the speaker and the microphone: lower gripper.bed_depth_mm "
            f"{scene.gripper.bed_depth_mm:g}"
        )
    return surface


def _heave(scene: Scene, floor: Real, free: Real, level: float) -> Real:
    """Grains pushed up above an imprint, spread by the cone of the friction angle."""
    medium = scene.medium
    cover = max(level - float(floor.max()), medium.grain_diameter_mm * MM)
    reach = max(cover * np.tan(np.deg2rad(medium.heave_deg)), 2 * RASTER_M)
    half = int(np.ceil(reach / RASTER_M))
    offsets = np.arange(-half, half + 1) * RASTER_M
    cone = np.clip(1 - np.hypot(offsets[None, :], offsets[:, None]) / reach, 0, None)
    raised = floor - free
    size = [next_fast_len(count + 2 * half, real=True) for count in raised.shape]
    spread = irfft2(rfft2(raised, size) * rfft2(cone / cone.sum(), size), size)
    ny, nx = raised.shape
    return medium.heave_fraction * spread[half : half + ny, half : half + nx]
