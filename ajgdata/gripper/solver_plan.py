"""Scene -> Plan: geometry, grid, medium and walls, ready to march."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from ajgdata.gripper.geometry import Cavity, grasp_cavity
from ajgdata.gripper.grasped_object import grasped
from ajgdata.gripper.grid import Cells, cut_cells
from ajgdata.gripper.medium import Air, Packing, air_fluid, fit_fluid
from ajgdata.gripper.membrane import membrane_walls
from ajgdata.gripper.objects import MM, SceneError
from ajgdata.gripper.outside import MembranePatches, membrane_patches
from ajgdata.gripper.parts import PhysicsPart
from ajgdata.gripper.random_fields import RandomField
from ajgdata.gripper.scene import HOTTEST_C, SAMPLE_RATE_HZ, Scene, actual_scene
from ajgdata.gripper.solver import Probe
from ajgdata.gripper.system import Packed, System, assemble
from ajgdata.gripper.walls import NO_WALLS, ModeList, WallList

Real = NDArray[np.floating]
#: Where the four-point differences have no dispersion along an axis.
ACCURATE_HZ = 17_000.0


@dataclass(frozen=True)
class Plan:
    """A scene ready to march, and what of its physics is solved.

    `skin` is the membrane where sound from outside reaches it.
    """

    scene: Scene
    parts: tuple[PhysicsPart, ...]

    cells: Cells
    skin: MembranePatches
    system: System
    speaker: Probe
    microphone: Probe
    steps_per_sample: int
    displaced_m3: float
    air: Air

    @property
    def bytes(self) -> int:
        """Memory of the arrays that are marched."""
        system = self.system
        groups = (system.faces, system.reach, system.capacities, system.walls, system.modes)
        arrays = (system.mass, *(array for group in groups for array in group))
        state = 6 * system.mass.size + 3 * len(system.walls.cell)
        return sum(a.nbytes for a in arrays) + state * system.faces.gain_x.itemsize


def steps_per_sample(
    dx_m: float, cfl: float, temperature_c: float = HOTTEST_C, wide: float = 0.0
) -> int:
    """Steps per sample at 44.1 kHz by the sound speed at 30 °C, so that all scenes share it; in
    hotter air by its own. Four-point differences of weight `wide` shorten the step by 1 + 4 `wide`.
    """
    fastest = Air(max(temperature_c, HOTTEST_C)).sound_speed
    return int(np.ceil(fastest * np.sqrt(3) * (1 + 4 * wide) / (cfl * dx_m * SAMPLE_RATE_HZ)))


def wide_weight(dx_m: float) -> float:
    """Weight of the four-point differences: without dispersion along an axis at 17 kHz in air.

    2 (1 + 3w) sin(kh/2) - 2 w sin(3kh/2) = kh there; 1/24, the weight of fourth order, as h → 0.
    """
    half = np.pi * ACCURATE_HZ / Air().sound_speed * dx_m
    return float((half / np.sin(half) - 1) / (3 - np.sin(3 * half) / np.sin(half)))


@cache
def _libraries() -> ThreadpoolController:
    """Return the libraries with threads; to find them takes as long as a twentieth of a scene."""
    return ThreadpoolController()


def build_plan(scene: Scene) -> Plan:
    """Return geometry, grid, medium, walls and modes of `scene`; raise SceneError (a ValueError).

    >>> plan = build_plan(Scene.model_validate({"object": "cube_20p7", "numerics": {"dx_mm": 6}}))
    >>> [part.name for part in plan.parts if part.is_solved]
    ['bed', 'poles', 'membrane', 'object', 'compliance', 'film']
    """
    # Threads of BLAS spin on a busy computer, and their number changes how sums round.
    with _libraries().limit(limits=1, user_api="blas"):
        return _planned(actual_scene(scene))


def _planned(scene: Scene) -> Plan:
    gripper, h = scene.gripper, scene.numerics.dx_mm * MM
    shape = grasp_cavity(scene)
    cells = cut_cells(
        shape, h, gripper.rim_radius_mm * MM, -gripper.balloon_depth_mm * MM, gripper.height_mm * MM
    )
    air = _air(scene)
    grains = _grains(scene, cells, air)
    wide = wide_weight(h)
    per_sample = steps_per_sample(h, scene.numerics.cfl, air.temperature_c, wide)
    parts, object_walls, modes = _parts(scene, shape, cells)
    membrane = membrane_walls(scene, shape, cells)
    system = assemble(
        cells,
        air_fluid(air),
        1 / (SAMPLE_RATE_HZ * per_sample),
        grains,
        membrane + _housing(scene, cells, air) + object_walls,
        np.float32 if scene.numerics.precision == "float32" else np.float64,
        modes,
        wide=wide,
    )
    roof, sigma = gripper.height_mm * MM, gripper.transducer_sigma_mm * MM
    speaker, microphone = (
        gaussian_probe(cells, system, (x * MM, y * MM, roof), sigma)
        for x, y in (gripper.speaker_mm, gripper.microphone_mm)
    )
    exposed = membrane_patches(membrane, cells)
    ends = speaker, microphone, per_sample, shape.displaced_m3, air
    return Plan(scene, parts, cells, exposed, system, *ends)


def _parts(
    scene: Scene, shape: Cavity, cells: Cells
) -> tuple[tuple[PhysicsPart, ...], WallList, ModeList]:
    """Return the parts, solved or not, and the walls and modes of what is grasped."""
    full = scene.medium.kind != "air"
    relaxing = full and scene.numerics.poles > 0
    held = grasped(scene, shape, cells)
    parts = (
        PhysicsPart("bed", full),
        PhysicsPart("poles", relaxing),
        PhysicsPart("membrane", True),
        PhysicsPart("object", scene.object is not None),
        *held.parts,
    )
    return parts, held.walls, held.modes


def _air(scene: Scene) -> Air:
    """Return the air of this grasp."""
    return Air(scene.environment.temperature_c, scene.environment.pressure_pa)


def _grains(scene: Scene, cells: Cells, air: Air) -> Packed | None:
    medium, nuisance = scene.medium, scene.grasp.nuisance
    if medium.kind == "air":
        return None
    field = RandomField(
        scene.grasp.seed, "packing", 3, nuisance.packing_correlation_mm * MM, scene.grasp.history
    ).on_axes(cells.z, cells.y, cells.x)
    ratio = 1 + nuisance.packing * np.clip(field, -3, 3)
    packing = Packing(medium.grain_diameter_mm * MM, medium.porosity)
    return Packed(fit_fluid(packing, air, scene.numerics.poles), medium.porosity, ratio)


def _housing(scene: Scene, cells: Cells, air: Air) -> WallList:
    gripper, walls = scene.gripper, NO_WALLS
    impedance = air.density * air.sound_speed
    if gripper.wall_admittance > 0:
        walls += WallList.uniform(cells.housing, 0.0, impedance / gripper.wall_admittance, 0.0)
    # The hose is long and lossy: beyond the inert fitting it sends nothing back.
    bore = gripper.port_bore_mm * MM / 2
    x, y = (c * MM for c in gripper.port_mm)
    spot = _gaussian(cells, (x, y, gripper.height_mm * MM), max(bore, cells.h / 2))
    area = np.pi * bore**2 * spot * (cells.volume > 0)
    area[area < 1e-3 * area.max()] = 0.0
    area *= np.pi * bore**2 / area.sum()
    inert = air.density * gripper.port_length_mm * MM
    return walls + WallList.uniform(area, inert, impedance, 0.0)


def _gaussian(cells: Cells, position: tuple[float, float, float], sigma: float) -> Real:
    x, y, z = position
    square = (
        (cells.z[:, None, None] - z) ** 2
        + (cells.y[None, :, None] - y) ** 2
        + (cells.x[None, None, :] - x) ** 2
    )
    return np.exp(-square / (2 * sigma**2))


def gaussian_probe(
    cells: Cells, system: System, position: tuple[float, float, float], sigma: float
) -> Probe:
    """Gaussian volume of width `sigma` (m) at x, y, z (m), inside the open cells."""
    weight = _gaussian(cells, position, sigma) * cells.volume * (system.mass > 0)
    weight[weight < 1e-4 * weight.max()] = 0.0
    cell = np.flatnonzero(weight)
    if not len(cell):
        raise SceneError(f"no open cell near {position}: the transducer is outside the cavity")
    return Probe(cell.astype(np.uint64), weight.ravel()[cell] / weight.sum())
