"""All limits of the virtual gripper: one class of a few lines per limit."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.column import Body, skin, solve, stack
from ajgdata.gripper.grid import Cells, cut_cells
from ajgdata.gripper.medium import Air, Fluid, Packing, air_fluid, fit_fluid
from ajgdata.gripper.objects import Material, ObjectPart
from ajgdata.gripper.solver import Probe
from ajgdata.gripper.system import Packed, System, assemble
from ajgdata.gripper.walls import NO_MODES, ModeList, WallList
from ajgdata.studies.extreme_cases import (
    AIR,
    CUBE,
    PLASTIC,
    Ends,
    Heights,
    Region,
    at_cell,
    bowl_cells,
    from_bowl,
    solid,
    time_step,
)
from ajgdata.studies.limit import (
    FromBowl,
    FromScene,
    Limit,
    LimitResult,
    PowerLimit,
    bowl_ends,
    powers,
    probes_apart_from,
    pulse_response,
)
from ajgdata.studies.noise_free import relative_error

Real = NDArray[np.floating]
#: Share of a face that stays open if it is closed. The cell behind it remains a part of the system,
#: so that the expected system shares capacity between the same cells.
PINHOLE = 1e-30
#: Mass (kg/m²), resistance (Pa s/m) and stiffness (N/m³) of a membrane without losses.
MEMBRANE = (0.3, 0.0, 1e5)
IMPEDANCE = "a part of impedance Z takes the volume velocity p S/Z, and Z is proportional to it"


class HeavyObject(FromBowl):
    """A body that moves without deformation; at rest, it is a rigid part of the boundary."""

    title = "object, mass → ∞: rigid object"
    parameter = "mass"
    unit = "kg"
    values = powers(1.0, 1e4)
    order = -1.0
    reason = IMPEDANCE

    def moving(self, value: float) -> dict[str, Any]:
        """See `FromBowl`."""
        return {"modes": np.array([[value, 0.0, 1e4]])}


class StiffObject(FromBowl):
    """A body on a spring; an infinitely stiff spring holds it."""

    title = "object, stiffness → ∞: rigid object"
    parameter = "stiffness"
    unit = "N/m"
    values = powers(1e9, 1e13)
    order = -1.0
    reason = IMPEDANCE

    def moving(self, value: float) -> dict[str, Any]:
        """See `FromBowl`."""
        return {"modes": np.array([[1e-3, 0.0, value]])}


class HeavyWall(FromBowl):
    """A locally reacting wall that is too heavy to move."""

    title = "wall, mass → ∞: rigid wall"
    parameter = "mass"
    unit = "kg/m²"
    values = powers(1e2, 1e6)
    order = -1.0
    reason = IMPEDANCE

    def moving(self, value: float) -> dict[str, Any]:
        """See `FromBowl`."""
        return {"wall": (value, 0.0, 1e5)}


class StiffWall(FromBowl):
    """A locally reacting wall that is too stiff to move, with its resonance above the band."""

    title = "wall, stiffness → ∞: rigid wall"
    parameter = "stiffness"
    unit = "N/m³"
    values = powers(1e11, 1e15)
    order = -1.0
    reason = IMPEDANCE

    def moving(self, value: float) -> dict[str, Any]:
        """See `FromBowl`."""
        return {"wall": (0.3, 0.0, value)}


class ResistiveWall(FromBowl):
    """A porous wall through which no air flows."""

    title = "wall, resistance → ∞: rigid wall"
    parameter = "resistance"
    unit = "Pa s/m"
    values = powers(1e5, 1e9)
    order = -1.0
    reason = IMPEDANCE

    def moving(self, value: float) -> dict[str, Any]:
        """See `FromBowl`."""
        return {"wall": (0.0, value, 0.0)}


class LightObject(FromBowl):
    """The skin of a 20 mm cube under the membrane; without mass and stiffness, only the membrane
    moves, as without an object.

    The factor scales density (from 1,000 kg/m³) and Young's modulus (from 0.1 GPa).
    """

    title = "object, mass and stiffness → 0: membrane without object"
    parameter = "factor"
    unit = ""
    values = powers(1e-6, 1e-9, 4)
    order = 1.0
    reason = "mass and stiffness add to those of the membrane, and are proportional to the factor"
    known: ClassVar[dict[str, Any]] = {"wall": (0.3, 0.0, 0.0)}

    def moving(self, value: float) -> dict[str, Any]:
        """See `FromBowl`."""
        return {"wall": skin(_cube_body(value, 4e-4), 0.3)}


def _cube_body(factor: float, imprint_m2: float) -> Body:
    """Return a 20 mm cube whose density and Young's modulus are scaled by `factor`."""
    material = Material(density_kg_m3=1e3 * factor, young_pa=1e8 * factor, poisson=0.3, loss=0.0)
    return Body(material, 0.02, lambda z: np.full(np.shape(z), imprint_m2), imprint_m2, imprint_m2)


class LightWall(PowerLimit):
    """A wall without mass, resistance and stiffness, which is an opening to a vacuum.

    The expected system has cells whose pressure stays zero.
    """

    title = "wall, mass → 0: no wall (pressure 0)"
    parameter = "mass"
    unit = "kg/m²"
    values = powers(1e-6, 1e-10)
    order = 1.0
    reason = "the pressure at the wall is Z times the velocity, and Z is proportional to the mass"

    def system(self, value: float) -> Ends:
        """See `Limit`."""
        system = bowl_ends(self.h, wall=(value, 0.0, 0.0))[0]
        return system, *self._inside(system)

    def expected(self, value: float) -> Ends:
        """See `Limit`."""
        system = bowl_ends(self.h)[0]
        at_wall = bowl_cells(self.h).membrane.ravel() > 0
        capacities = system.capacities._replace(
            yield_=np.where(at_wall, 0.0, system.capacities.yield_),
            keep=np.where(at_wall, 0.0, system.capacities.keep),
        )
        return replace(system, capacities=capacities), *self._inside(system)

    def _inside(self, system: System) -> tuple[Probe, Probe]:
        return probes_apart_from(system, bowl_cells(self.h).membrane)


class HeavyStiffCube(FromScene):
    """A cube whose density and Young's modulus grow together, so that its resonances are constant.

    The frame of the grains is omitted, because it would move above a rigid object, too.
    """

    title = "cube, density and Young's modulus → ∞: rigid cube"
    parameter = "factor"
    unit = ""
    values = powers(1.0, 1e4)
    order = -1.0
    reason = "mobilities of skin and modes are proportional to 1 over the factor"
    omit: ClassVar[tuple[ObjectPart, ...]] = ("frame",)
    known: ClassVar[dict[str, Any]] = {"object": CUBE}

    def settings(self, value: float) -> dict[str, Any]:
        """See `FromScene`."""
        return {"object": {**CUBE, "material": solid(1e3 * value, 1e8 * value)}}


class StiffCube(FromScene):
    """A cube of which only Young's modulus grows; its modes leave the band, its skin stiffens."""

    title = "cube, Young's modulus → ∞: rigid cube"
    parameter = "Young's modulus"
    unit = "Pa"
    values = powers(1e9, 1e13)
    order = -1.0
    reason = "mobilities of skin and contact are proportional to 1 over the modulus"
    omit: ClassVar[tuple[ObjectPart, ...]] = ("frame",)
    known: ClassVar[dict[str, Any]] = {"object": CUBE}

    def settings(self, value: float) -> dict[str, Any]:
        """See `FromScene`."""
        return {"object": {**CUBE, "material": solid(1e3, value)}}


class SlackMembrane(FromScene):
    """A membrane without tension, with only mass and resistance, in a gripper without grains."""

    title = "membrane, tension → 0: limp membrane"
    parameter = "stiffness"
    unit = "N/m³"
    values = powers(1e4, 1.0)
    order = 1.0
    reason = "the impedance of the tension is k/iω, added to that of mass and resistance"
    known: ClassVar[dict[str, Any]] = {
        "medium": {"kind": "air"},
        "gripper": {"membrane": {"stiffness_n_m3": 0.0}},
    }

    def settings(self, value: float) -> dict[str, Any]:
        """See `FromScene`."""
        return {**self.known, "gripper": {"membrane": {"stiffness_n_m3": value}}}


class ThinFilm(FromScene):
    """The film of air between membrane and object, in units of its default thickness."""

    title = "film of air, thickness → 0: membrane on the object"
    parameter = "thickness"
    unit = "of the default"
    values = powers(1.0, 1e-4)
    order = 1.0
    reason = "the flexibility of a film is proportional to its thickness"
    known: ClassVar[dict[str, Any]] = {
        "object": {**CUBE, "material": "plastic"},
        "gripper": {"membrane": {"film": 0.0}},
    }

    def settings(self, value: float) -> dict[str, Any]:
        """See `FromScene`."""
        return {**self.known, "gripper": {"membrane": {"film": value}}}


class RigidHousing(FromScene):
    """A housing of the admittance ρc/z."""

    title = "housing, admittance → 0: rigid housing"
    parameter = "admittance"
    unit = ""
    values = powers(1e-2, 1e-6)
    order = 1.0
    reason = "the housing takes the volume velocity p S times its admittance"
    known: ClassVar[dict[str, Any]] = {"gripper": {"wall_admittance": 0.0}}

    def settings(self, value: float) -> dict[str, Any]:
        """See `FromScene`."""
        return {"gripper": {"wall_admittance": value}}


class LoosePacking(FromBowl):
    """Grains that fill a share 1 - φ of the bed.

    In the JCA model with the parameters of `Packing`, tortuosity φ^-1/2, 1/φ, and both boundary
    layers (δ/Λ with 1/Λ ~ 1 - φ) deviate from air in the first power of 1 - φ, drag in the second.
    """

    title = "grains, porosity → 1: air"
    parameter = "1 - porosity"
    unit = ""
    values = powers(0.1, 0.001)
    order = 1.0
    reason = "tortuosity and boundary layers of Johnson, Champoux and Allard are linear in 1 - φ"

    def moving(self, value: float) -> dict[str, Any]:
        """See `FromBowl`."""
        return {"packing": Packing(PLASTIC.diameter, 1 - value)}


class NoDrag(FromBowl):
    """The drag of the bed, in units of the drag of plastic grains."""

    title = "grains, drag → 0: fluid without drag"
    parameter = "drag"
    unit = "of plastic grains"
    values = powers(0.1, 1e-5)
    order = 1.0
    reason = "the drag σ'/iω is added to the density of the fluid"
    known: ClassVar[dict[str, Any]] = {"packing": PLASTIC, "drag": 0.0}

    def moving(self, value: float) -> dict[str, Any]:
        """See `FromBowl`."""
        return {"packing": PLASTIC, "drag": value}


class DenseDrag(PowerLimit):
    """Grains through which no air flows are a wall; the expected system has closed faces.

    The pressure diffuses into the bed by δ = (ωσ'C)^-1/2. Once a cell is deeper than δ, the flow
    into the bed is the pressure of the cell above over σ' h: the order is that of the grid, 1. If
    the grid resolves δ, the order is 1/2 (see `FinePowder`).
    """

    title = "grains, drag → ∞: wall"
    parameter = "drag"
    unit = "of plastic grains"
    values = powers(1e7, 1e11)
    order = -1.0
    reason = "the flow through a face is the pressure difference over drag, if cells exceed δ"

    def system(self, value: float) -> Ends:
        """See `Limit`."""
        system = bowl_ends(self.h, packing=PLASTIC, drag=value)[0]
        return system, *self._above(system)

    def expected(self, value: float) -> Ends:
        """See `Limit`."""
        cells = bowl_cells(self.h)
        decays = bowl_ends(self.h, packing=PLASTIC)[0].faces[:3]
        area_x, area_y, area_z = (
            np.where(decay.reshape(cells.shape) < 1, PINHOLE * area, area)
            for decay, area in zip(decays, (cells.area_x, cells.area_y, cells.area_z), strict=True)
        )
        closed = replace(cells, area_x=area_x, area_y=area_y, area_z=area_z)
        grains = Packed(fit_fluid(PLASTIC, AIR), PLASTIC.porosity, np.ones(cells.shape))
        system = assemble(closed, air_fluid(AIR), time_step(self.h), grains)
        return system, *self._above(system)

    def _above(self, system: System) -> tuple[Probe, Probe]:
        return probes_apart_from(system, bowl_cells(self.h).bed)


class FinePowder(PowerLimit):
    """A layer of powder under a column of air, on a grid that resolves the diffusion of pressure.

    A layer deeper than δ has the admittance (iωC/σ')^1/2, and σ' ~ d^-2 (Kozeny-Carman): the
    distance to a rigid floor is proportional to the diameter d.
    """

    title = "grains, diameter → 0 (very fine powder): wall"
    parameter = "diameter"
    unit = "mm"
    values = powers(0.04, 0.005, 4)
    order = 1.0
    reason = "the admittance of a deep layer is √(iωC/σ'), and σ' is proportional to d⁻²"
    steps = 32_768
    #: Spacing of the grid (m).
    spacing = 5e-5
    #: Depth of the powder, and height of the air above it (m).
    depth = 5e-3
    height = 5e-3

    def system(self, value: float) -> Ends:
        """See `Limit`."""
        return self._column(self.depth, fit_fluid(Packing(1e-3 * value, PLASTIC.porosity), AIR))

    def expected(self, value: float) -> Ends:
        """See `Limit`."""
        return self._column(0.0, None)

    def _column(self, depth: float, powder: Fluid | None) -> Ends:
        def heights(x: Real, y: Real) -> Heights:
            inside = (np.abs(x) < self.spacing) & (np.abs(y) < self.spacing)
            return np.where(inside, -depth, 0.0), np.where(inside, self.height, 0.0), 0.0

        width = 2 * self.spacing
        cells = cut_cells(Region(heights), self.spacing, width, -self.depth, self.height)
        grains = None
        if powder is not None:
            grains = Packed(powder, PLASTIC.porosity, np.ones(cells.shape))
        system = assemble(cells, air_fluid(AIR), time_step(self.spacing), grains)
        live = np.flatnonzero((system.mass.ravel() > 0) & (cells.bed.ravel() == 0))
        return system, at_cell(int(live[len(live) // 4])), at_cell(int(live[-1]))


class ThinAir(PowerLimit):
    """Air of low pressure, which does not move a wall of mass and stiffness."""

    title = "air, pressure → 0: rigid walls"
    parameter = "pressure"
    unit = "Pa"
    values = powers(1e3, 0.1)
    order = 1.0
    reason = "the stiffness of the air is γP; that of walls and masses does not depend on P"

    def system(self, value: float) -> Ends:
        """See `Limit`."""
        return bowl_ends(self.h, wall=MEMBRANE, air=Air(AIR.temperature_c, value))

    def expected(self, value: float) -> Ends:
        """See `Limit`."""
        return bowl_ends(self.h, air=Air(AIR.temperature_c, value))


class Similarity(Limit):
    """A bowl in different air, to which walls, grains and time step are scaled.

    With masses proportional to ρ, resistances to ρc, stiffnesses to ρc² and times to 1/c, the
    discrete equations are identical, and the pressure is proportional to ρc² Δt = γP Δt.
    The cap: coefficients are rounded to half an ulp, which moves the phase of a wave by up to 2π ε
    per step, ε = 2⁻⁵³.
    """

    reason = "similarity: the discrete equations contain only ratios; rounding of 2π ε per step"

    @abstractmethod
    def air(self, value: float) -> Air:
        """Return the air at a value of the parameter."""

    def system(self, value: float) -> Ends:
        """See `Limit`."""
        return self._scaled(self.air(value))

    def expected(self, value: float) -> Ends:
        """See `Limit`."""
        return self._scaled(AIR)

    def distance(self, value: float) -> float:
        """Return the relative L2 distance of all steps, pressures in units of γP Δt."""
        scaled = self._unit_response(self.system(value), self.air(value))
        return relative_error(scaled, self._unit_response(self.expected(value), AIR))

    def _unit_response(self, ends: Ends, air: Air) -> Real:
        """Return the response to a pulse, (steps,), in units of γP Δt."""
        unit = ends[0].dt / air.compressibility
        return pulse_response(ends, self.steps) / unit

    def run(self) -> LimitResult:
        """Measure the distance at each value."""
        distances = tuple(self.distance(value) for value in self.values)
        return LimitResult(distances, cap=self.steps * 2 * np.pi * 2.0**-53)

    def _scaled(self, air: Air) -> Ends:
        density = air.density / AIR.density
        speed = air.sound_speed / AIR.sound_speed
        scale = np.array([density, density * speed, density * speed**2])
        plastic = fit_fluid(PLASTIC, AIR)
        fluid = Fluid(
            plastic.density * scale[0],
            plastic.drag * scale[1],
            plastic.compressibility / scale[2],
            plastic.strengths,
            tuple(time / speed for time in plastic.times),
        )
        return from_bowl(
            air=air,
            fluid=fluid,
            wall=tuple(np.multiply((0.3, 450.0, 1e5), scale)),
            modes=np.array([[1e-2, 1.0, 1e5]]) * scale,
            dt=time_step(self.h) / speed,
            h=self.h,
        )(np.float64)


class Temperature(Similarity):
    """Temperatures at the ends of the valid range and between."""

    title = "air of -20 to 60 °C: scaled response at 22 °C"
    parameter = "temperature"
    unit = "°C"
    values = (-20.0, 0.0, 60.0)

    def air(self, value: float) -> Air:
        """See `Similarity`."""
        return Air(value)


class Pressure(Similarity):
    """Pressures at the ends of the valid range and between."""

    title = "air of 0.5 to 1.1 bar: scaled response at 1.013 bar"
    parameter = "pressure"
    unit = "Pa"
    values = (5e4, 8e4, 1.1e5)

    def air(self, value: float) -> Air:
        """See `Similarity`."""
        return Air(AIR.temperature_c, value)


#: Limits that the model reaches, in the order of the report.
LIMITS: tuple[type[Limit], ...] = (
    HeavyObject,
    StiffObject,
    LightObject,
    SlackMembrane,
    LoosePacking,
    DenseDrag,
    FinePowder,
    Temperature,
    Pressure,
    HeavyStiffCube,
    StiffCube,
    HeavyWall,
    StiffWall,
    ResistiveWall,
    LightWall,
    ThinFilm,
    RigidHousing,
    NoDrag,
    ThinAir,
)


class LightObjectWithCore(PowerLimit):
    """`LightObject` with the modes of its core.

    The model adds the mass of the membrane to the skin and to the core, so two membranes move side
    by side instead of one.
    """

    title = "object with core modes, mass and stiffness → 0: membrane without object"
    parameter = "factor"
    unit = ""
    values = powers(1e-6, 1e-9, 4)
    order = 1.0
    reason = "the membrane's mass is in the skin and again in the modes of the core"

    def system(self, value: float) -> Ends:
        """See `Limit`."""
        cells = bowl_cells(self.h)
        body = _cube_body(value, float(cells.membrane.sum()))
        core = solve(stack(body, MEMBRANE[0]))
        cell = np.flatnonzero(cells.membrane)
        weight = core.shapes[:1, :1] * cells.membrane.ravel()[cell]
        modes = ModeList(cell, weight, np.ones(1), np.zeros(1), core.omega_squared[:1])
        return self._assembled(cells, skin(body, MEMBRANE[0]), modes)

    def expected(self, value: float) -> Ends:
        """See `Limit`."""
        cells = bowl_cells(self.h)
        return self._assembled(cells, (MEMBRANE[0], 0.0, 0.0), NO_MODES)

    def _assembled(self, cells: Cells, wall: tuple[float, float, float], modes: ModeList) -> Ends:
        walls = WallList.uniform(cells.membrane, *wall)
        system = assemble(cells, air_fluid(AIR), time_step(self.h), walls=walls, modes=modes)
        return system, *probes_apart_from(system, np.zeros(cells.shape))


class HeavyStiffCubeWithFrame(HeavyStiffCube):
    """`HeavyStiffCube` with the frame of the grains, which is omitted above a rigid object."""

    title = "cube under the grains' frame, density and Young's modulus → ∞: rigid cube"
    reason = "the frame of grains moves above a heavy object, and is not solved above a rigid one"
    omit = ()


class SlackPinnedMembrane(FromScene):
    """A membrane with tension, which the grains pin."""

    title = "membrane under grains, tension → 0: limp membrane"
    parameter = "stiffness"
    unit = "N/m³"
    values = powers(1e2, 1e-2)
    order = 1.0
    reason = "grains pin a membrane of any tension, and do not pin a membrane without tension"
    known: ClassVar[dict[str, Any]] = {"gripper": {"membrane": {"stiffness_n_m3": 0.0}}}

    def settings(self, value: float) -> dict[str, Any]:
        """See `FromScene`."""
        return {"gripper": {"membrane": {"stiffness_n_m3": value}}}


#: Limits that the model does not reach, because two of its parts do not agree there.
UNREACHED: tuple[type[Limit], ...] = (
    LightObjectWithCore,
    HeavyStiffCubeWithFrame,
    SlackPinnedMembrane,
)
