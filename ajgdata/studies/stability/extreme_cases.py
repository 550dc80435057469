"""The extremes: what an object, a wall, a bed, a shape, a climate or a time step can be."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ajgdata.gripper import Scene, build_plan
from ajgdata.gripper.grid import cut_cells
from ajgdata.gripper.medium import Packing, air_fluid, fit_fluid
from ajgdata.gripper.objects import MATERIALS
from ajgdata.gripper.system import Packed, assemble
from ajgdata.gripper.walls import NO_MODES, NO_WALLS, ModeList, WallList
from ajgdata.studies.domains import AIR, BOWL, PLASTIC, bowl, time_step, two_probes
from ajgdata.studies.stability.trial import Ends, Trial

DX_MM = 5.0
H = DX_MM * 1e-3
EXTREME = (0.0, 1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6)
CUBE = {"kind": "cube", "edge_mm": 20.0}
#: Stiffness of the gripper that the needle almost pierces: at a thousandth less it is refused.
JUST_HELD_N_M3 = 7.4645e4
NEEDLE = {"kind": "cylinder", "diameter_mm": 10.0, "height_mm": 60.0}
STIFF = (0.0, 1.0, 1e5, 1e10, 1e15)


def of_scene(parts: dict[str, Any]) -> Callable[[type], Ends]:
    """A whole scene, on the grid of this study."""

    def build(dtype: type) -> Ends:
        numerics = {
            "dx_mm": DX_MM,
            "precision": "float32" if dtype is np.float32 else "float64",
            # An extreme must be stable, not absent.
            "tolerance": 0.0,
            **parts.get("numerics", {}),
        }
        plan = build_plan(Scene.model_validate({**parts, "numerics": numerics}))
        return plan.system, plan.speaker, plan.microphone

    return build


def of_bowl(
    *,
    packing: Packing | None = PLASTIC,
    drag: float = 1.0,
    wall: tuple[float, float, float] | None = None,
    modes: np.ndarray | None = None,
    courant: float | None = None,
    h: float = H,
) -> Callable[[type], Ends]:
    """The bowl on a grid of `h` (m), half full of grains if there is a packing, with walls (m, r, k
    per area) or modes (m, r, k each); at the time step of scenes or at a Courant number."""

    def build(dtype: type) -> Ends:
        cells = cut_cells(bowl(), h, *BOWL)
        grains = None
        if packing is not None:
            fluid = fit_fluid(packing, AIR)
            thick = replace(fluid, drag=fluid.drag * drag)
            grains = Packed(thick, packing.porosity, np.ones(cells.shape))
        walls = NO_WALLS if wall is None else WallList.uniform(cells.membrane, *wall)
        moving = NO_MODES
        if modes is not None:
            cell = np.flatnonzero(cells.bed)
            weight = np.random.default_rng(0).uniform(-1, 1, (len(modes), len(cell))) * h**2
            moving = ModeList(cell, weight, *modes.T)
        dt = time_step(h) if courant is None else courant * h / (np.sqrt(3) * AIR.sound_speed)
        system = assemble(cells, air_fluid(AIR), dt, grains, walls, dtype, moving)
        return system, *two_probes(system)

    return build


def trials(quick: bool = False) -> Iterator[Trial]:
    """All of them; `quick` marches a twentieth of the steps."""
    steps = 1_000 if quick else 20_000
    for group, members in (
        ("object", _objects()),
        ("wall", _walls()),
        ("mode", _modes()),
        ("bed", _beds()),
        ("shape", _shapes()),
        ("climate", _climates()),
        ("time step", _time_steps()),
    ):
        for name, build in members:
            yield Trial(group, name, build, steps)
    for name, parts in _impossible().items():
        yield Trial("impossible", name, of_scene(parts), steps, "refused")
    yield Trial("long run", "grains, walls and modes", _long(), 10_000 if quick else 1_000_000)


Members = Iterator[tuple[str, Callable[[type], Ends]]]


def _objects() -> Members:
    plate = {"kind": "box", "length_mm": 80.0, "width_mm": 80.0, "height_mm": 5.0}
    yield "no object", of_scene({})
    yield "rigid cube", of_scene({"object": CUBE})
    for material in MATERIALS:
        yield f"cube of {material}", of_scene({"object": {**CUBE, "material": material}})
    for material in ("steel", "wood", "plastic", "styrofoam"):
        yield f"plate of {material}", of_scene({"object": {**plate, "material": material}})
    volume = 20e-3**3
    for mass in (1e-9, 1e-3, 1e6):
        yield (
            f"cube of {mass:g} kg",
            of_scene({"object": {**CUBE, "material": _solid(mass / volume)}}),
        )
    for young in (1e-3, 1.0, 1e15):
        solid = _solid(1_000.0, young)
        yield (
            f"cube of Young's modulus {young:g} Pa",
            of_scene({"object": {**CUBE, "material": solid}}),
        )
    lump = {**CUBE, "material": _solid(1e9, 1.0)}
    yield "cube as heavy as it is soft", of_scene({"object": lump})
    rubber = {"object": {**CUBE, "material": "steel"}, "support": {"kind": "rubber"}}
    yield "steel cube on rubber", of_scene(rubber)


def _solid(density: float, young: float = 1e9) -> dict[str, float]:
    return {"density_kg_m3": density, "young_pa": young, "poisson": 0.3, "loss": 0.0}


def _walls() -> Members:
    """Around air without losses, which would hide a slow growth."""
    for mass in EXTREME:
        yield f"mass {mass:g} kg/m²", of_bowl(packing=None, wall=(mass, 0.0, 1e5))
    for stiffness in STIFF:
        yield f"stiffness {stiffness:g} N/m³", of_bowl(packing=None, wall=(0.3, 0.0, stiffness))
    for resistance in (1e-6, 1e15):
        lossy = (0.0, resistance, 1e5)
        yield f"resistance {resistance:g} Pa s/m", of_bowl(packing=None, wall=lossy)
    yield "resonance at 1.6 GHz", of_bowl(packing=None, wall=(1e-9, 0.0, 1e11))


def _modes() -> Members:
    """In air without losses."""
    for mass in EXTREME:
        yield f"mass {mass:g} kg", _mode(mass, 1e5)
    for stiffness in STIFF:
        yield f"stiffness {stiffness:g} N/m", _mode(1e-2, stiffness)
    yield "resonance at 160 GHz", _mode(1e-9, 1e15)
    several = [[m, 0.0, k] for m in (1e-9, 1.0, 1e6) for k in (1.0, 1e7, 1e15)]
    yield "nine of them at once", of_bowl(packing=None, modes=np.array(several))


def _mode(mass: float, stiffness: float) -> Callable[[type], Ends]:
    return of_bowl(packing=None, modes=np.array([[mass, 0.0, stiffness]]))


def _beds() -> Members:
    for factor in (0.0, 1.0, 1e3, 1e6):
        yield f"flow resistivity × {factor:g}", of_bowl(drag=factor)
    for porosity in (0.2, 0.95):
        medium = {"kind": "plastic", "porosity": porosity}
        grasp = {"nuisance": {"packing": 0.01}}
        yield f"porosity {porosity:g}, scene", of_scene({"medium": medium, "grasp": grasp})
    for porosity in (0.01, 0.999):
        yield f"porosity {porosity:g}", of_bowl(packing=Packing(6e-3, porosity))
    for diameter_mm in (0.05, 20.0):
        medium = {"kind": "plastic", "grain_diameter_mm": diameter_mm}
        yield f"grains of {diameter_mm:g} mm", of_scene({"medium": medium})
    powder = {"kind": "plastic", "grain_diameter_mm": 0.05}
    plain = {"scheme": "second", "dx_mm": 3.0}
    yield (
        "cube in grains of 0.05 mm, plain scheme, 3 mm grid",
        of_scene({"object": CUBE, "medium": powder, "numerics": plain}),
    )


def _shapes() -> Members:
    yield "cube of 1 mm", of_scene({"object": {"kind": "cube", "edge_mm": 1.0}})
    tall = {"kind": "cylinder", "diameter_mm": 30.0, "height_mm": 1_000.0}
    yield "object taller than the cavity", of_scene({"object": tall})
    wide = {"kind": "box", "length_mm": 400.0, "width_mm": 400.0, "height_mm": 40.0}
    yield "object wider than the cavity", of_scene({"object": wide})
    needle = {"object": NEEDLE, "gripper": {"stiffness_n_m3": JUST_HELD_N_M3}}
    yield "cavity pressed until almost closed", of_scene(needle)


def _climates() -> Members:
    for celsius in (-20.0, 60.0):
        yield (
            f"{celsius:g} °C",
            of_scene({"object": CUBE, "environment": {"temperature_c": celsius}}),
        )


def _time_steps() -> Members:
    yield "CFL 0.99, scene", of_scene({"object": CUBE, "numerics": {"cfl": 0.99}})
    for courant in (0.99, 1.0, 1.2, 2.0):
        yield f"CFL {courant:g}, cells enlarged for it", of_bowl(packing=None, courant=courant)
    for drag in (1e2, 1e4):
        name = f"CFL 2, flow resistivity × {drag:g}, cells enlarged for it"
        yield name, of_bowl(drag=drag, courant=2.0)


def _impossible() -> dict[str, dict[str, Any]]:
    return {
        "CFL 1": {"numerics": {"cfl": 1.0}},
        "CFL 1.2": {"numerics": {"cfl": 1.2}},
        "porosity 0.1": {"medium": {"kind": "plastic", "porosity": 0.1}},
        "porosity 0.96": {"medium": {"kind": "plastic", "porosity": 0.96}},
        "no grains left where the packing is loosest": {
            "medium": {"kind": "plastic", "porosity": 0.95}
        },
        "-40 °C": {"environment": {"temperature_c": -40.0}},
        "80 °C": {"environment": {"temperature_c": 80.0}},
        "negative edge": {"object": {"kind": "cube", "edge_mm": -20.0}},
        "edge that is not a number": {"object": {"kind": "cube", "edge_mm": float("nan")}},
        "infinite force": {"object": CUBE, "grasp": {"force_n": float("inf")}},
        "object outside the gripper": {"object": CUBE, "grasp": {"offset_x_mm": 80.0}},
        "object against the housing": {
            "object": {**NEEDLE, "height_mm": 1_000.0},
            "grasp": {"offset_x_mm": 49.0},
        },
        "cavity pinched shut": {"object": NEEDLE, "gripper": {"stiffness_n_m3": 4e4}},
        "transducer outside the roof": {"gripper": {"speaker_mm": [39.0, 0.0]}},
        "bed up to the roof": {"gripper": {"bed_depth_mm": 86.0}},
        "negative mass": {"object": {**CUBE, "material": _solid(-1.0)}},
    }


def _long() -> Callable[[type], Ends]:
    modes = np.array([[1e-2, 0.0, 1e15], [1.0, 0.0, 1e5], [0.0, 0.0, 1e3]])
    return of_bowl(wall=(0.3, 450.0, 1e5), modes=modes)
