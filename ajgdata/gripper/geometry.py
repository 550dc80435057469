"""The cavity of a grasp: where the membrane lies, where the grains end, where the roof is.

Everything is a height over the plane of the rim, on a raster of 0.5 mm that knows nothing of the
solver's grid, so that refining the grid refines the solution and not the scene. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.optimize import brentq
from scipy.signal import fftconvolve

from ajgdata.gripper.fields import RandomField
from ajgdata.gripper.scene import Box, Cube, Cylinder, Ellipsoid, Gripper, Scene, derive_seed

RASTER_M = 0.5e-3
MM = 1e-3
Real = NDArray[np.floating]
#: Steps of the raster in all directions within 5 pixels: their cone is round to 0.2 %.
RING = [
    (i, j) for i in range(-5, 6) for j in range(-5, 6) if np.gcd(i, j) == 1 and i * i + j * j <= 26
]


class SceneError(ValueError):
    """A scene that cannot exist, e.g. an object that would pinch the cavity shut."""


@dataclass(frozen=True)
class Cavity:
    """Heights in m at the positions `axis` x `axis` (y first), and the share of contact.

    Between `floor` (membrane) and `roof` there is air above `surface` and grains below it; where
    `floor` >= `roof` there is nothing. `contact` is 1 where the membrane lies on something rigid.
    """

    axis: Real
    floor: Real
    roof: Real
    surface: Real
    contact: Real
    displaced_m3: float

    def at(self, x: Real, y: Real) -> tuple[Real, Real, Real, Real]:
        """Floor, roof, surface, contact on the grid (y, x), by bilinear interpolation."""
        position = np.meshgrid(
            (y - self.axis[0]) / RASTER_M, (x - self.axis[0]) / RASTER_M, indexing="ij"
        )
        floor, roof, surface, contact = (
            map_coordinates(field, position, order=1, mode="nearest")
            for field in (self.floor, self.roof, self.surface, self.contact)
        )
        return floor, roof, surface, contact


@dataclass(frozen=True)
class Relief:
    """An object on the table as the membrane sees it: `height` falls off at the drape angle
    outside the footprint, `inside` is the footprint with antialiased edges."""

    height: Real
    inside: Real


def relief(scene: Scene, x: Real, y: Real) -> Relief:
    """Relief of the scene's object over the table on the grid x, y (m)."""
    shape, grasp, steepest = scene.object, scene.grasp, _drape_slope(scene.gripper)
    turn = np.deg2rad(grasp.angle_deg)
    px, py = x - grasp.offset_x_mm * MM, y - grasp.offset_y_mm * MM
    u, v = px * np.cos(turn) + py * np.sin(turn), py * np.cos(turn) - px * np.sin(turn)
    match shape:
        case Cube():
            outside = _box_distance(u, v, shape.edge_mm, shape.edge_mm)
            top = np.full_like(u, shape.edge_mm * MM)
        case Box():
            outside = _box_distance(u, v, shape.length_mm, shape.width_mm)
            top = np.full_like(u, shape.height_mm * MM)
        case Cylinder():
            outside = np.hypot(u, v) - shape.diameter_mm * MM / 2
            top = np.full_like(u, shape.height_mm * MM)
        case Ellipsoid():
            a, b, c = (d * MM / 2 for d in shape.diameters_mm)
            radius = np.hypot(u / a, v / b)
            outside = (radius - 1) * min(a, b)
            top = c * (1 + np.sqrt(np.clip(1 - radius**2, 0, None)))
        case _:
            raise TypeError(f"no relief for {shape!r}")
    height = top - steepest * np.clip(outside, 0, None)
    if isinstance(shape, Ellipsoid):
        height = _drape(height, steepest)
    return Relief(np.maximum(height, 0.0), np.clip(0.5 - outside / RASTER_M, 0, 1))


def _box_distance(u: Real, v: Real, length_mm: float, width_mm: float) -> Real:
    """Signed distance to a rectangle, negative inside."""
    du, dv = np.abs(u) - length_mm * MM / 2, np.abs(v) - width_mm * MM / 2
    outer = np.hypot(np.clip(du, 0, None), np.clip(dv, 0, None))
    return outer + np.minimum(np.maximum(du, dv), 0)


def _drape_slope(gripper: Gripper) -> float:
    return float(np.tan(np.deg2rad(gripper.drape_deg)))


def _drape(height: Real, steepest: float) -> Real:
    """Lowest surface above `height` that is nowhere steeper than `steepest`."""
    rows, columns = height.shape
    while True:
        wide = np.pad(height, 5, mode="edge")
        higher = height
        for i, j in RING:
            moved = wide[5 + i : 5 + i + rows, 5 + j : 5 + j + columns]
            higher = np.maximum(higher, moved - steepest * RASTER_M * np.hypot(i, j))
        if np.max(higher - height) < 1e-6:
            return higher
        height = higher


def cavity(scene: Scene) -> Cavity:
    """Press the gripper on the object until force and stiffness agree, and settle the grains.

    Raises SceneError if the object does not fit under the gripper.
    """
    gripper = scene.gripper
    rim, roof_z = gripper.rim_radius_mm * MM, gripper.height_mm * MM
    half = int(np.ceil(rim / RASTER_M)) + 12
    axis = np.arange(-half, half + 1) * RASTER_M
    x, y = np.meshgrid(axis, axis)
    radius = np.hypot(x, y)
    taper = rim - gripper.roof_radius_mm * MM
    roof = np.clip((rim - radius) / taper, 0, 1) * roof_z
    depth = gripper.balloon_depth_mm * MM
    free = -depth * np.sqrt(np.clip(1 - (radius / rim) ** 2, 0, None))
    floor, contact = _press(scene, x, y, free)
    if np.max(np.where(radius < rim, floor, -1)) > roof_z - gripper.clearance_mm * MM:
        raise SceneError(
            f"object {_title(scene)} pinches the cavity: it needs more room than the gripper has; "
            "use a lower object or less force"
        )
    displaced = float(np.sum(floor - free)) * RASTER_M**2
    surface = _settle(scene, axis, roof, floor, free)
    return Cavity(axis, floor, roof, surface, contact, displaced)


def _title(scene: Scene) -> str:
    return scene.object.kind if scene.object else "none"


def _press(scene: Scene, x: Real, y: Real, free: Real) -> tuple[Real, Real]:
    """Height of the membrane, and where it lies on the object or on the table."""
    if scene.object is None:
        return free, np.zeros_like(free)
    gripper, nuisance = scene.gripper, scene.grasp.nuisance
    draw = np.random.default_rng(derive_seed(scene.grasp.seed, "force")).standard_normal()
    force = scene.grasp.force_n * max(0.1, 1 + nuisance.force * float(draw))
    shape = relief(scene, x, y)
    within = free < 0

    def excess(table: float) -> float:
        risen = np.clip(table + shape.height - free, 0, None)[within]
        return float(risen.sum()) * RASTER_M**2 - force / gripper.stiffness_n_m3

    lowest = float(np.min((free - shape.height)[within]))
    highest = gripper.height_mm * MM
    if excess(highest) < 0:
        raise SceneError(
            f"object {_title(scene)} is so small or far off the axis that {force:.3g} N is never"
            " reached: move it under the balloon or lower the force"
        )
    table = brentq(excess, lowest, highest, xtol=1e-9)
    under_rim = table + np.where(shape.inside > 0, shape.height, 0.0)[~within]
    if under_rim.max() > 0:
        raise SceneError(
            f"object {_title(scene)} would stand against the housing's rim: it must be smaller, "
            "lower, or nearer to the axis"
        )
    pressed = np.maximum(free, table + shape.height)
    smoothing = gripper.drape_smoothing_mm * MM / RASTER_M
    rise = np.where(within, gaussian_filter(pressed - free, smoothing), 0.0)
    flat = np.clip(1 - (pressed - table) / RASTER_M, 0, 1)
    touching = np.maximum(shape.inside, flat) * (pressed > free)
    return free + rise, np.clip(gaussian_filter(touching, smoothing), 0, 1)


def _settle(scene: Scene, axis: Real, roof: Real, floor: Real, free: Real) -> Real:
    """Free surface of the grains: their volume is kept, imprints heave, no surface is smooth."""
    medium, nuisance = scene.medium, scene.grasp.nuisance
    if medium.kind == "air":
        return floor
    seed = scene.grasp.seed
    level = medium.bed_depth_mm * MM - scene.gripper.balloon_depth_mm * MM
    volume = np.sum(np.clip(np.minimum(level, roof) - free, 0, None))
    rough = RandomField.draw(seed, "roughness", 2, nuisance.roughness_correlation_mm * MM)
    tilt = np.random.default_rng(derive_seed(seed, "slope")).standard_normal(2)
    tilt *= np.tan(np.deg2rad(nuisance.slope_deg))
    shape = _heave(scene, floor, free, level) + nuisance.roughness_mm * MM * rough.on_axes(
        axis, axis
    )
    shape += tilt[0] * axis[None, :] + tilt[1] * axis[:, None]

    def excess(height: float) -> float:
        return float(np.sum(np.clip(np.minimum(height + shape, roof) - floor, 0, None)) - volume)

    span = scene.gripper.height_mm * MM
    if excess(span * 2) < 0:
        raise SceneError("the grains no longer fit: lower medium.bed_depth_mm or the force")
    height = brentq(excess, -span * 2, span * 2, xtol=1e-9)
    surface = np.maximum(floor, height + shape)
    ceiling = (scene.gripper.height_mm - scene.gripper.clearance_mm) * MM
    if np.max(surface) > ceiling:
        raise SceneError(
            "the grains would fill the cavity up to the roof: lower medium.bed_depth_mm"
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
    spread = fftconvolve(floor - free, cone / cone.sum(), mode="same")
    return medium.heave_fraction * spread
