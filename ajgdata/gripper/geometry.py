"""The cavity of a grasp: heights of the membrane, of the grains' surface and of the roof.

All heights are over the plane of the rim, in m, on a raster of 0.5 mm. The raster does not depend
on the solver's grid, so a finer grid refines the solution and not the scene.
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
from ajgdata.gripper.scene import Scene, actual_scene, derive_seed

Real = NDArray[np.floating]
#: Meridians of the membrane on which its bare width is measured, and points on each of them.
MERIDIANS = 64
POINTS = 129


class Strip(NamedTuple):
    """A closed strip of the membrane: mean width (m) and area (m²)."""

    width_m: float
    area_m2: float


@dataclass(frozen=True)
class Cavity:
    """Heights (m) and shares of contact at the positions `axis` x `axis` (m; y first): (n, n).

    Grains are between `floor` (the membrane) and `surface`, and air is between `surface` and
    `roof`. Where `surface` is below `floor`, the membrane is bare; where `roof` is not above
    `floor`, there is no cavity. `contact` is 1 where the membrane lies on the object or on the
    table, and `object_contact` where it lies on the object, which `force_n` presses. The height of
    the table is `table_m`, None without an object.
    """

    axis: Real
    floor: Real
    roof: Real
    surface: Real
    contact: Real
    object_contact: Real
    table_m: float | None
    displaced_m3: float
    force_n: float

    def at(self, x: Real, y: Real) -> tuple[Real, Real, Real, Real]:
        """Return floor, roof, surface and contact on the grid (y, x), by bilinear interpolation."""
        along_y, along_x = np.meshgrid(y, x, indexing="ij")
        floor, roof, surface, contact = (
            self.sampled(field, along_x, along_y)
            for field in (self.floor, self.roof, self.surface, self.contact)
        )
        return floor, roof, surface, contact

    def bare_edge(self, rim: float) -> Strip:
        """Return the membrane between the grains and the rim, whose radius is `rim` (m).

        Its width is the length, along the meridians of the membrane, on which neither grains nor an
        object lie, averaged over azimuths. Width and area depend only on the shape of the cavity,
        so they are the same on each grid of the solver.
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
    """Return the share of each interval in which `level` (…, n), linear in it, is negative,
    (…, n - 1)."""
    before = level[..., :-1]
    after = level[..., 1:]
    below = np.maximum(-before, 0) + np.maximum(-after, 0)
    above = np.maximum(before, 0) + np.maximum(after, 0)
    return np.divide(below, below + above, out=np.zeros_like(below), where=below + above > 0)


def grasp_cavity(scene: Scene) -> Cavity:
    """Return the cavity of a grasp: the gripper is pressed on the object, and the grains settle.

    Raises SceneError if the object does not fit under the gripper.
    """
    scene = actual_scene(scene)
    gripper = scene.gripper
    rim = gripper.rim_radius_mm * MM
    half = int(np.ceil(rim / RASTER_M)) + 12
    axis = np.arange(-half, half + 1) * RASTER_M
    x, y = np.meshgrid(axis, axis)
    radius = np.hypot(x, y)
    taper = rim - gripper.roof_radius_mm * MM
    roof = np.clip((rim - radius) / taper, 0, 1) * (gripper.height_mm * MM)
    free = _balloon(scene, x, y)
    force = _force(scene)
    pressed = _press(scene, x, y, free, force)
    _check_clearance(scene, pressed.floor, free, roof)
    displaced = float(np.sum(pressed.floor - free)) * RASTER_M**2
    return Cavity(
        axis,
        pressed.floor,
        roof,
        _settle(scene, axis, roof, pressed.floor, free),
        pressed.contact,
        pressed.object_contact,
        pressed.table_m,
        displaced,
        force,
    )


def _balloon(scene: Scene, x: Real, y: Real) -> Real:
    """Return the height (m) of the free balloon: half of an ellipsoid with a shifted tip.

    The point p of the balloon was at p - askew (1 - |p|²/R²) before the shift, so the rim does not
    move. The change of the volume is of second order in askew / R.
    """
    rim = scene.gripper.rim_radius_mm * MM
    depth = scene.gripper.balloon_depth_mm * MM
    shift_x, shift_y = (offset * MM for offset in scene.assembly.askew_mm)
    inside = np.clip(1 - (np.hypot(x, y) / rim) ** 2, 0, None)
    radius = np.hypot(x - shift_x * inside, y - shift_y * inside)
    return -depth * np.sqrt(np.clip(1 - (radius / rim) ** 2, 0, None))


def _force(scene: Scene) -> float:
    """Return the force of this grasp in N."""
    if scene.object is None:
        return 0.0
    draw = np.random.default_rng(derive_seed(scene.grasp.seed, "force")).standard_normal()
    return scene.grasp.force_n * max(0.1, 1 + scene.grasp.nuisance.force * float(draw))


class _Pressed(NamedTuple):
    """The pressed membrane: height (m), both shares of contact, and the height of the table (m)."""

    floor: Real
    contact: Real
    object_contact: Real
    table_m: float | None


def _press(scene: Scene, x: Real, y: Real, free: Real, force: float) -> _Pressed:
    """Return the membrane, of height `free` (m) before, after the object is pressed into it by
    `force` (N)."""
    if scene.object is None:
        return _Pressed(free, np.zeros_like(free), np.zeros_like(free), None)
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
    # Grains press in spots at a distance of one diameter d. A disc of diameter d has the standard
    # deviation d/4.
    smoothing = max(_grain_diameter(scene) / 4, RASTER_M) / RASTER_M
    raised = np.where(within, np.maximum(over, 0), 0.0)
    rise = np.where(within, gaussian_filter(raised, smoothing), 0.0)
    # Volume that the filter moves over the rim is restored, because the force depends on it.
    rise *= raised.sum() / rise.sum()
    pressed = _edge(over) * within

    def smoothed(touching: Real) -> Real:
        return np.clip(gaussian_filter(touching * pressed, smoothing), 0, 1)

    contact = smoothed(np.maximum(shape.touching, shape.adjacent))
    return _Pressed(free + rise, contact, smoothed(shape.touching), table)


def _title(scene: Scene) -> str:
    """Return kind and size of the object, for messages."""
    return scene.object.title if scene.object else "none"


def _bending_radius(
    scene: Scene, bare: Relief, under: Real, within: NDArray[np.bool_], force: float
) -> float:
    """Return the radius (m) of the membrane where it touches nothing: T/p, but at least a grain's.

    p is the force over the area that would be pressed if the membrane followed every edge. `under`
    are the heights (m) of the free balloon `within` the rim.
    """
    over = np.maximum(bare.height[within], 0) - under
    goal = force / (scene.gripper.stiffness_n_m3 * RASTER_M**2)

    def excess(table: float) -> float:
        return float(np.clip(table + over, 0, None).sum()) - goal

    # At the upper end, the mean height alone displaces the required volume.
    table = brentq(excess, -float(over.max()), goal / over.size - float(over.min()), xtol=1e-7)
    # The derivative of the volume by the depth. It is smooth in all sizes; a count of samples is
    # not.
    pressed = np.clip(0.5 + (table + over) / RASTER_M, 0, 1).sum() * RASTER_M**2
    pressure = force / pressed
    return max(scene.gripper.tension_n_m / pressure, _grain_diameter(scene) / 2, RASTER_M)


def _grain_diameter(scene: Scene) -> float:
    """Return the diameter of the grains, m; 0 if there are none."""
    return 0.0 if scene.medium.kind == "air" else scene.medium.grain_diameter_mm * MM


def _yielding(scene: Scene, shape: Relief, within: NDArray[np.bool_]) -> float:
    """Return the volume that this bed yields to a force, relative to the mean.

    N = (D/d)² grains of diameter d lie on an object of the area of a disc of diameter D. Their
    forces have the standard deviation `grain_force`, and the mean over N grains has a standard
    deviation that is smaller by √N (central limit theorem).
    """
    scatter = scene.grasp.nuisance.grain_force
    if scene.medium.kind == "air" or scatter == 0:
        return 1.0
    width = np.sqrt(4 / np.pi * float(shape.inside[within].sum())) * RASTER_M
    ratio = _grain_diameter(scene) / max(width, _grain_diameter(scene))
    draw = np.random.default_rng(derive_seed(scene.grasp.seed, "yielding")).standard_normal()
    return max(0.1, 1 + scatter * ratio * float(draw))


def _table(
    scene: Scene, shape: Relief, free: Real, within: NDArray[np.bool_], force: float
) -> float:
    """Return the height of the table (m) at which the displaced volume balances `force` (N)."""
    under = free[within]
    over = np.maximum(shape.height[within], 0)
    goal = force / scene.gripper.stiffness_n_m3

    def excess(table: float) -> float:
        return float(np.clip(table + over - under, 0, None).sum()) * RASTER_M**2 - goal

    room = (scene.gripper.height_mm - scene.gripper.clearance_mm) * MM
    under_roof = room - float(over.max())
    if excess(min(0.0, under_roof)) < 0:
        raise SceneError(_too_weak(scene, force, under_roof))
    table = brentq(excess, float(np.min(under - over)), min(0.0, under_roof), xtol=1e-9)
    under_rim = table + np.where(shape.inside > 0, shape.height, 0.0)[~within]
    if under_rim.max() > 0:
        raise SceneError(
            f"object {_title(scene)} would stand against the housing's rim: make it smaller or "
            "lower, or move it to the axis"
        )
    return float(table)


def _too_weak(scene: Scene, force: float, under_roof: float) -> str:
    """Return in one line why the object cannot displace the volume for `force` (N).

    `under_roof` is the highest possible table (m) at which the object does not touch the roof.
    """
    subject = f"object {_title(scene)}"
    fix = f"or lower grasp.force_n, to hold {force:.3g} N"
    if under_roof >= 0:
        return f"{subject} lets the rim stand on the table: make it larger or higher, {fix}"
    return f"{subject} pinches the cavity to its clearance: make it lower or wider, {fix}"


def _edge(level: Real) -> Real:
    """Return 1 where `level` is positive, 0 where it is negative, values between along its zero
    line."""
    slope = np.hypot(*np.gradient(level))
    return np.clip(0.5 + level / np.maximum(slope, 1e-12), 0, 1)


def _check_clearance(scene: Scene, floor: Real, free: Real, roof: Real) -> None:
    """Raise SceneError if the raised membrane pinches the cavity, also below the cone of the
    housing."""
    raised = (floor > 0) & (floor - free > RASTER_M)
    gap = np.min(np.where(raised, roof - floor, np.inf)) / MM
    if gap < scene.gripper.clearance_mm:
        raise SceneError(
            f"object {_title(scene)} pinches the cavity to {max(gap, 0):.1f} mm of at least "
            f"{scene.gripper.clearance_mm:g} mm: make it lower, move it to the axis, or lower "
            f"grasp.force_n {scene.grasp.force_n:g}"
        )


def _settle(scene: Scene, axis: Real, roof: Real, floor: Real, free: Real) -> Real:
    """Return the height (m) of the grains' free surface, also where it is below the membrane.

    The volume of the grains is constant, imprints heave the grains above them, and the surface is
    rough. `floor` and `free` are the heights (m) of the pressed and of the free membrane.
    """
    medium = scene.medium
    if medium.kind == "air":
        return floor
    level = scene.gripper.bed_depth_mm * MM - scene.gripper.balloon_depth_mm * MM
    volume = np.sum(np.clip(np.minimum(level, roof) - free, 0, None))
    shape = _surface_shape(scene, axis, floor, free, level)

    def excess(height: float | np.floating) -> float:
        return float(np.sum(np.clip(np.minimum(height + shape, roof) - floor, 0, None)) - volume)

    inside = roof > floor
    lowest = np.min((floor - shape)[inside])
    highest = np.max((roof - shape)[inside])
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


def _surface_shape(scene: Scene, axis: Real, floor: Real, free: Real, level: float) -> Real:
    """Return the shape (m) of the grains' surface up to a constant: heave, roughness and slope."""
    nuisance = scene.grasp.nuisance
    seed = scene.grasp.seed
    history = scene.grasp.history
    correlation = nuisance.roughness_correlation_mm * MM
    rough = RandomField(seed, "roughness", 2, correlation, history).on_axes(axis, axis)
    slope = normals(seed, "slope", 2, history) * np.tan(np.deg2rad(nuisance.slope_deg))
    slope += np.tan(np.deg2rad(scene.assembly.fill_slope_deg))
    shape = _heave(scene, floor, free, level) + nuisance.roughness_mm * MM * rough
    shape += slope[0] * axis[None, :] + slope[1] * axis[:, None]
    return shape


def _heave(scene: Scene, floor: Real, free: Real, level: float) -> Real:
    """Return the rise (m) of the grains above an imprint, spread by the cone of the friction
    angle."""
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
