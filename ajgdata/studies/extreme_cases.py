"""Systems for studies and tests: a bowl of cut cells, and extreme scenes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper import SAMPLE_RATE_HZ, Scene, build_plan
from ajgdata.gripper.grid import Cells, cut_cells
from ajgdata.gripper.medium import Air, Fluid, Packing, air_fluid, fit_fluid
from ajgdata.gripper.objects import MATERIALS, MM
from ajgdata.gripper.scene import Numerics
from ajgdata.gripper.solver import Probe
from ajgdata.gripper.solver_plan import steps_per_sample
from ajgdata.gripper.system import Packed, System, assemble
from ajgdata.gripper.walls import NO_MODES, NO_WALLS, ModeList, WallList

Real = NDArray[np.floating]
Heights = tuple[Real | float, Real | float, Real | float]
#: Air of all studies, at 22 °C.
AIR = Air(22.0)
#: Plastic grains of the default gripper.
PLASTIC = Packing(6e-3, 0.40)


@dataclass(frozen=True)
class Region:
    """Domain from a function of x and y (m) that returns floor, roof and surface of grains (m)."""

    heights: Callable[[Real, Real], Heights]

    def at(self, x: Real, y: Real) -> tuple[Real, Real, Real, Real]:
        """Return floor, roof, surface and contact (zero) on the grid, each (y, x)."""
        xx, yy = np.meshgrid(x, y)
        heights = self.heights(xx, yy)
        floor, roof, surface = (np.broadcast_to(height, xx.shape) * 1.0 for height in heights)
        return floor, np.maximum(floor, roof), surface, np.zeros_like(xx)


def bowl() -> Region:
    """Return a curved bowl, half full of grains, whose boundary cuts cells in all ways."""

    def heights(x: Real, y: Real) -> Heights:
        half = np.sqrt(np.clip(0.03**2 - x**2 - y**2, 0, None))
        return -half, half * 0.8 + 0.3 * x * (half > 0), -0.004 + 0.1 * y

    return Region(heights)


#: Half width, bottom and top of the box around the bowl (m).
BOWL = (0.031, -0.031, 0.036)


def bowl_cells(h: float) -> Cells:
    """Return the cells of the bowl on a grid of `h` (m)."""
    return cut_cells(bowl(), h, *BOWL)


def time_step(h: float, wide: float = 0.0) -> float:
    """Return the time step (s) of scenes on a grid of spacing `h` (m)."""
    return 1 / (SAMPLE_RATE_HZ * steps_per_sample(h, 0.99, wide=wide))


def at_cell(flat: int) -> Probe:
    """Return a source or receiver in one cell, given by its flat index."""
    return Probe(np.array([flat], np.uint64), np.ones(1))


def two_probes(system: System) -> tuple[Probe, Probe]:
    """Return a probe near the bottom, among grains if there are any, and a probe near the top."""
    live = np.flatnonzero(system.mass.ravel())
    return at_cell(int(live[len(live) // 7])), at_cell(int(live[-len(live) // 5]))


#: System, source and receiver.
Ends = tuple[System, Probe, Probe]
#: Function that builds a system in a precision.
Build = Callable[[type], Ends]
#: Spacing of the default grid, in mm and in m.
DX_MM = Numerics().dx_mm
H = DX_MM * 1e-3
#: Masses of walls (kg/m²) and of modes (kg).
EXTREME_MASSES = (0.0, 1e-9, 1e-3, 1.0, 1e3, 1e6)
#: Stiffnesses of walls (N/m³) and of modes (N/m).
EXTREME_STIFFNESSES = (0.0, 1.0, 1e5, 1e10, 1e15)
CUBE = {"kind": "cube", "edge_mm": 20.0}
#: Stiffness of the gripper that the needle almost pierces: a thousandth less is an error.
JUST_HELD_N_M3 = 7.4645e4
NEEDLE = {"kind": "cylinder", "diameter_mm": 10.0, "height_mm": 60.0}


@dataclass(frozen=True)
class Trial:
    """An extreme system, its number of steps, and the spacing of its grid (mm)."""

    group: str
    name: str
    build: Build
    steps: int
    dx_mm: float = DX_MM


def from_scene(parts: dict[str, Any], dx_mm: float = DX_MM) -> Build:
    """Return the builder of a complete scene on a grid of `dx_mm` (mm)."""

    def build(dtype: type) -> Ends:
        numerics = {
            "dx_mm": dx_mm,
            "precision": "float32" if dtype is np.float32 else "float64",
            # No part is omitted, because each must be stable.
            "omit": (),
            "modes_hz": 21_000.0,
            **parts.get("numerics", {}),
        }
        plan = build_plan(Scene.model_validate({**parts, "numerics": numerics}))
        return plan.system, plan.speaker, plan.microphone

    return build


def from_bowl(
    *,
    packing: Packing | None = PLASTIC,
    drag: float = 1.0,
    wall: tuple[float, float, float] | None = None,
    modes: np.ndarray | None = None,
    courant: float | None = None,
    dt: float | None = None,
    air: Air = AIR,
    fluid: Fluid | None = None,
    h: float = H,
) -> Build:
    """Return the builder of the bowl on a grid of `h` (m).

    The bowl is half full of grains if there is a `packing`; `fluid` replaces the fluid that is
    fitted to it. A `wall` has mass, resistance and stiffness per area; `modes` (N, 3) have mass,
    resistance and stiffness. The time step is that of scenes, `dt` (s), or a Courant number.
    """

    def build(dtype: type) -> Ends:
        cells = bowl_cells(h)
        grains = None
        if packing is not None:
            medium = fluid or fit_fluid(packing, air)
            thick = replace(medium, drag=medium.drag * drag)
            grains = Packed(thick, packing.porosity, np.ones(cells.shape))
        walls = NO_WALLS if wall is None else WallList.uniform(cells.membrane, *wall)
        moving = NO_MODES
        if modes is not None:
            cell = np.flatnonzero(cells.bed)
            weight = np.random.default_rng(0).uniform(-1, 1, (len(modes), len(cell))) * h**2
            moving = ModeList(cell, weight, *modes.T)
        step = time_step(h) if dt is None else dt
        if courant is not None:
            step = courant * h / (np.sqrt(3) * air.sound_speed)
        system = assemble(cells, air_fluid(air), step, grains, walls, dtype, moving)
        return system, *two_probes(system)

    return build


#: Steps of a bowl. Most bowls have no losses and show a slow growth of energy.
BOWL_STEPS = 20_000
#: Steps of a complete scene. Scenes have losses, so their energy falls from the first step on.
SCENE_STEPS = 5_000
QUICK_STEPS = 1_000
LONG_STEPS = 1_000_000


def trials(quick: bool = False, dx_mm: float = DX_MM) -> Iterator[Trial]:
    """Yield all trials on a grid of `dx_mm` (mm); `quick` computes fewer steps."""
    for group, name, parts in _scenes():
        steps = QUICK_STEPS if quick else SCENE_STEPS
        yield Trial(group, name, from_scene(parts, dx_mm), steps, dx_mm)
    for group, name, build in _bowls(dx_mm * MM):
        steps = QUICK_STEPS if quick else BOWL_STEPS
        yield Trial(group, name, build, steps, dx_mm)


def solid(density: float, young: float = 1e9) -> dict[str, float]:
    """Return a material without losses: density (kg/m³) and Young's modulus (Pa)."""
    return {"density_kg_m3": density, "young_pa": young, "poisson": 0.3, "loss": 0.0}


def _objects() -> Iterator[tuple[str, dict[str, Any] | None]]:
    """Yield objects by name."""
    plate = {"kind": "box", "length_mm": 80.0, "width_mm": 80.0, "height_mm": 5.0}
    yield "no object", None
    yield "rigid cube", CUBE
    for material in MATERIALS:
        yield f"cube of {material}", {**CUBE, "material": material}
    for material in ("steel", "wood", "plastic", "styrofoam"):
        yield f"plate of {material}", {**plate, "material": material}
    for mass in (1e-9, 1e6):
        yield f"cube of {mass:g} kg", {**CUBE, "material": solid(mass / 20e-3**3)}
    for young in (1e-3, 1.0, 1e15):
        soft = solid(1_000.0, young)
        yield f"cube of Young's modulus {young:g} Pa", {**CUBE, "material": soft}
    yield "cube as heavy as it is soft", {**CUBE, "material": solid(1e9, 1.0)}
    yield "cube of 1 mm", {"kind": "cube", "edge_mm": 1.0}
    tall = {"kind": "cylinder", "diameter_mm": 30.0, "height_mm": 1_000.0}
    yield "object taller than the cavity", tall
    wide = {"kind": "box", "length_mm": 400.0, "width_mm": 400.0, "height_mm": 40.0}
    yield "object wider than the cavity", wide


def _scenes() -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield group, name and settings of complete scenes."""
    for name, shape in _objects():
        yield "object", name, {"object": shape}
    steel = {**CUBE, "material": "steel"}
    yield "object", "steel cube on rubber", {"object": steel, "support": {"kind": "concave"}}
    pressed = {"object": NEEDLE, "gripper": {"stiffness_n_m3": JUST_HELD_N_M3}}
    yield "object", "cavity pressed until almost closed", pressed
    for porosity in (0.2, 0.95):
        grasp = {"nuisance": {"packing": 0.01}}
        loose = {"medium": {"porosity": porosity}, "grasp": grasp}
        yield "bed", f"porosity {porosity:g}, scene", loose
    for diameter in (0.05, 20.0):
        yield "bed", f"grains of {diameter:g} mm", {"medium": {"grain_diameter_mm": diameter}}
    for celsius in (-20.0, 60.0):
        air = {"temperature_c": celsius}
        yield "climate", f"{celsius:g} °C", {"object": CUBE, "environment": air}
    yield "time step", "CFL 0.99, scene", {"object": CUBE, "numerics": {"cfl": 0.99}}


def _bowls(h: float) -> Iterator[tuple[str, str, Build]]:
    """Yield group, name and builder of bowls on a grid of `h` (m).

    Walls and modes are next to air without losses, which would hide a slow growth.
    """
    for mass in EXTREME_MASSES:
        yield "wall", f"mass {mass:g} kg/m²", from_bowl(h=h, packing=None, wall=(mass, 0.0, 1e5))
        yield "mode", f"mass {mass:g} kg", _mode(mass, 1e5, h)
    for stiffness in EXTREME_STIFFNESSES:
        wall = (0.3, 0.0, stiffness)
        yield "wall", f"stiffness {stiffness:g} N/m³", from_bowl(h=h, packing=None, wall=wall)
        yield "mode", f"stiffness {stiffness:g} N/m", _mode(1e-2, stiffness, h)
    for resistance in (1e-6, 1e15):
        wall = (0.0, resistance, 1e5)
        yield "wall", f"resistance {resistance:g} Pa s/m", from_bowl(h=h, packing=None, wall=wall)
    yield "wall", "resonance at 1.6 GHz", from_bowl(h=h, packing=None, wall=(1e-9, 0.0, 1e11))
    yield "mode", "resonance at 160 GHz", _mode(1e-9, 1e15, h)
    several = np.array([[m, 0.0, k] for m in (1e-9, 1.0, 1e6) for k in (1.0, 1e7, 1e15)])
    yield "mode", "nine of them at once", from_bowl(h=h, packing=None, modes=several)
    for factor in (0.0, 1.0, 1e3, 1e6):
        yield "bed", f"flow resistivity × {factor:g}", from_bowl(h=h, drag=factor)
    for porosity in (0.01, 0.999):
        yield "bed", f"porosity {porosity:g}", from_bowl(h=h, packing=Packing(6e-3, porosity))
    for courant in (0.99, 1.0, 1.2, 2.0):
        name = f"CFL {courant:g}, cells enlarged for it"
        yield "time step", name, from_bowl(h=h, packing=None, courant=courant)
    for drag in (1e2, 1e4):
        name = f"CFL 2, flow resistivity × {drag:g}, cells enlarged for it"
        yield "time step", name, from_bowl(h=h, drag=drag, courant=2.0)
    yield "all parts", "grains, walls and modes", _everything(h)


def _mode(mass: float, stiffness: float, h: float) -> Build:
    return from_bowl(packing=None, modes=np.array([[mass, 0.0, stiffness]]), h=h)


def _everything(h: float) -> Build:
    """Return the bowl with grains, a wall and modes: stiff, heavy and massless."""
    modes = np.array([[1e-2, 0.0, 1e15], [1.0, 0.0, 1e5], [0.0, 0.0, 1e3]])
    return from_bowl(wall=(0.3, 450.0, 1e5), modes=modes, h=h)
