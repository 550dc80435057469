"""From a scene to a plan: geometry, grid, medium, walls and modes for the solver."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from ajgdata.gripper.geometry import grasp_cavity
from ajgdata.gripper.grasped_object import object_physics
from ajgdata.gripper.grid import Cells, cut_cells
from ajgdata.gripper.medium import Air, Packing, air_fluid, fit_fluid
from ajgdata.gripper.membrane import membrane_walls
from ajgdata.gripper.objects import MM, SceneError
from ajgdata.gripper.outside import MembranePatches, membrane_patches
from ajgdata.gripper.parts import PhysicsPart
from ajgdata.gripper.random_fields import RandomField
from ajgdata.gripper.scene import HOTTEST_C, PACKING_SIGMAS, SAMPLE_RATE_HZ, Scene, actual_scene
from ajgdata.gripper.solver import Probe
from ajgdata.gripper.system import Packed, System, assemble
from ajgdata.gripper.walls import NO_WALLS, WallList

Real = NDArray[np.floating]
#: Frequency at which the four-point differences have no dispersion along an axis.
ACCURATE_HZ = 17_000.0
#: Cells with a smaller share of the largest weight do not belong to a transducer, or to the port.
LEAST_TRANSDUCER_WEIGHT = 1e-4
LEAST_PORT_WEIGHT = 1e-3


@dataclass(frozen=True)
class Plan:
    """A scene that is ready for the solver, and the parts of its physics.

    `membrane` is the part of the membrane that sound from outside reaches. The object displaces the
    volume `displaced_m3`.
    """

    scene: Scene
    parts: tuple[PhysicsPart, ...]

    cells: Cells
    membrane: MembranePatches
    system: System
    speaker: Probe
    microphone: Probe
    steps_per_sample: int
    displaced_m3: float
    air: Air

    @property
    def bytes(self) -> int:
        """Memory of the arrays of the solver."""
        system = self.system
        groups = (system.faces, system.reach, system.capacities, system.walls, system.modes)
        arrays = (system.mass, *(array for group in groups for array in group))
        state = 6 * system.mass.size + 3 * len(system.walls.cell)
        return sum(a.nbytes for a in arrays) + state * system.faces.gain_x.itemsize


def build_plan(scene: Scene) -> Plan:
    """Return the plan of a scene. Raises SceneError (a ValueError) for an impossible scene.

    >>> plan = build_plan(Scene.model_validate({"object": "cube_20p7", "numerics": {"dx_mm": 6}}))
    >>> [part.name for part in plan.parts if part.is_solved]
    ['bed', 'poles', 'membrane', 'object', 'compliance', 'film']
    """
    # Threads of BLAS wait actively on a busy computer, and their number changes rounding errors.
    with _libraries().limit(limits=1, user_api="blas"):
        return _planned(actual_scene(scene))


@cache
def _libraries() -> ThreadpoolController:
    """Return the libraries with threads; the search takes a twentieth of the time of a scene."""
    return ThreadpoolController()


def _planned(scene: Scene) -> Plan:
    """Return the plan of an `actual_scene`."""
    gripper = scene.gripper
    h = scene.numerics.dx_mm * MM
    roof = gripper.height_mm * MM
    cavity = grasp_cavity(scene)
    rim = gripper.rim_radius_mm * MM
    cells = cut_cells(cavity, h, rim, -gripper.balloon_depth_mm * MM, roof)
    air = Air(scene.environment.temperature_c, scene.environment.pressure_pa)
    grains = _grains(scene, cells, air)
    wide = wide_weight(h)
    per_sample = steps_per_sample(h, scene.numerics.cfl, air.temperature_c, wide)
    physics = object_physics(scene, cavity, cells)
    membrane = membrane_walls(scene, cavity, cells)
    system = assemble(
        cells,
        air_fluid(air),
        1 / (SAMPLE_RATE_HZ * per_sample),
        grains,
        membrane + _housing(scene, cells, air) + physics.walls,
        np.float32 if scene.numerics.precision == "float32" else np.float64,
        physics.modes,
        wide=wide,
    )
    sigma = gripper.transducer_sigma_mm * MM
    speaker, microphone = (
        gaussian_probe(cells, system, (x * MM, y * MM, roof), sigma)
        for x, y in (gripper.speaker_mm, gripper.microphone_mm)
    )
    has_grains = grains is not None
    parts = (
        PhysicsPart("bed", has_grains),
        PhysicsPart("poles", has_grains and scene.numerics.poles > 0),
        PhysicsPart("membrane", True),
        PhysicsPart("object", scene.object is not None),
        *physics.parts,
    )
    return Plan(
        scene,
        parts,
        cells,
        membrane_patches(membrane, cells),
        system,
        speaker,
        microphone,
        per_sample,
        cavity.displaced_m3,
        air,
    )


def wide_weight(dx_m: float) -> float:
    """Return the weight w of the four-point differences on a grid of width h = `dx_m`.

    At 17 kHz in air, a wave along an axis has no dispersion: 2 (1 + 3w) sin(kh/2) - 2 w sin(3kh/2)
    = kh. For h → 0, w is 1/24, the weight of fourth order.
    """
    half = np.pi * ACCURATE_HZ / Air().sound_speed * dx_m
    return float((half / np.sin(half) - 1) / (3 - np.sin(3 * half) / np.sin(half)))


def steps_per_sample(
    dx_m: float, cfl: float, temperature_c: float = HOTTEST_C, wide: float = 0.0
) -> int:
    """Return the number of time steps per sample at 44.1 kHz.

    It follows from the speed of sound at 30 °C, so that all scenes share it, or from that of hotter
    air. Four-point differences of weight `wide` shorten the step by 1 + 4 `wide`.
    """
    fastest = Air(max(temperature_c, HOTTEST_C)).sound_speed
    return int(np.ceil(fastest * np.sqrt(3) * (1 + 4 * wide) / (cfl * dx_m * SAMPLE_RATE_HZ)))


def _grains(scene: Scene, cells: Cells, air: Air) -> Packed | None:
    """Return the grains of this grasp; None in air."""
    medium = scene.medium
    nuisance = scene.grasp.nuisance
    if medium.kind == "air":
        return None
    correlation = nuisance.packing_correlation_mm * MM
    field = RandomField(scene.grasp.seed, "packing", 3, correlation, scene.grasp.history)
    values = field.on_axes(cells.z, cells.y, cells.x)
    ratio = 1 + nuisance.packing * np.clip(values, -PACKING_SIGMAS, PACKING_SIGMAS)
    packing = Packing(medium.grain_diameter_mm * MM, medium.porosity)
    return Packed(fit_fluid(packing, air, scene.numerics.poles), medium.porosity, ratio)


def _housing(scene: Scene, cells: Cells, air: Air) -> WallList:
    """Return the walls of the housing and of the vacuum port.

    The hose is long and lossy, so it reflects nothing behind the inert fitting.
    """
    gripper = scene.gripper
    walls = NO_WALLS
    impedance = air.density * air.sound_speed
    if gripper.wall_admittance > 0:
        walls += WallList.uniform(cells.housing, 0.0, impedance / gripper.wall_admittance, 0.0)
    radius = gripper.port_bore_mm * MM / 2
    x, y = (c * MM for c in gripper.port_mm)
    spot = _gaussian(cells, (x, y, gripper.height_mm * MM), max(radius, cells.h / 2))
    area = np.pi * radius**2 * spot * (cells.volume > 0)
    area[area < LEAST_PORT_WEIGHT * area.max()] = 0.0
    area *= np.pi * radius**2 / area.sum()
    inert = air.density * gripper.port_length_mm * MM
    return walls + WallList.uniform(area, inert, impedance, 0.0)


def _gaussian(cells: Cells, position: tuple[float, float, float], sigma: float) -> Real:
    """Return a Gaussian function of the distance from `position` (m), 1 at this position."""
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
    """Return a Gaussian volume of width `sigma` (m) at x, y, z (m), inside the open cells."""
    weight = _gaussian(cells, position, sigma) * cells.volume * (system.mass > 0)
    weight[weight < LEAST_TRANSDUCER_WEIGHT * weight.max()] = 0.0
    cell = np.flatnonzero(weight)
    if not len(cell):
        raise SceneError(f"no open cell near {position}: the transducer is outside the cavity")
    return Probe(cell.astype(np.uint64), weight.ravel()[cell] / weight.sum())
