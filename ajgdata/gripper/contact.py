"""Contact mechanics of grains, membrane, object and support: pure functions, SI units.

The simulation takes its frame of the grains, its seat and its support from here. docs/contact.md
lists how each effect changes the sound, and which effects the simulation includes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ajgdata.gripper.objects import Material

Real = NDArray[np.floating]
#: Acceleration of gravity, m/s².
GRAVITY = 9.81
#: Material of each kind of grains. Densities are those of the paper's balls (0.2 g with 6 mm, and
#: 0.36 g with 4.5 mm), all other values are from handbooks. Modulus and loss factor of coffee, a
#: brittle foam, are estimates.
GRAIN_SOLIDS = {
    "plastic": Material(density_kg_m3=1_770.0, young_pa=2.5e9, poisson=0.35, loss=0.04),
    "metal": Material(density_kg_m3=7_550.0, young_pa=200e9, poisson=0.30, loss=0.002),
    "coffee": Material(density_kg_m3=1_200.0, young_pa=5e8, poisson=0.30, loss=0.10),
}
#: Least force per area (Pa) on the frame of the grains: the weight of one or two grains.
LOOSEST_PA = 10.0


class Frame(NamedTuple):
    """The grains as a solid: density (kg/m³), modulus under lateral restraint (Pa), loss factor."""

    density: float
    modulus_pa: float
    loss: float


class Spring(NamedTuple):
    """Stiffness per area (N/m³) and its loss factor."""

    stiffness_n_m3: float
    loss: float


@dataclass(frozen=True)
class Latex:
    """The membrane as an elastic layer: density (kg/m³), thickness (m), Young's modulus (Pa), loss
    factor. The values are estimates: natural rubber at small strain."""

    density = 1_000.0

    thickness: float = 0.3e-3
    young: float = 1.5e6
    loss: float = 0.1


@dataclass(frozen=True)
class Pack:
    """A random packing of equal spheres of one material; their diameter is in m.

    `coordination` is the number of contacts per grain. A poured packing is near 6, the isostatic
    number of frictionless spheres (O'Hern et al., Phys. Rev. E 68, 2003).
    """

    diameter: float
    porosity: float
    grain: Material
    coordination: float = 6.0

    @property
    def density(self) -> float:
        """Density of the packing without its air, kg/m³."""
        return self.grain.density_kg_m3 * (1 - self.porosity)

    @property
    def seats_per_m2(self) -> float:
        """Grains per area that touch a wall: number density times one diameter, 6(1-φ)/(πd²)."""
        return 6 * (1 - self.porosity) / (np.pi * self.diameter**2)

    def moduli(self, stress: ArrayLike) -> tuple[Real, Real]:
        """Return bulk and shear modulus (Pa, of the shape of `stress`) under an isotropic `stress`
        (Pa); both are proportional to stress^(1/3).

        The spheres are rough, so their contacts do not slip (Mindlin 1949): Walton, J. Mech. Phys.
        Solids 35 (1987) 213, which equals Digby, J. Appl. Mech. 48 (1981) 803, without bonds.
        """
        shear = self.grain.young_pa / (2 * (1 + self.grain.poisson))
        lame = 2 * shear * self.grain.poisson / (1 - 2 * self.grain.poisson)
        a = (1 / shear - 1 / (shear + lame)) / (4 * np.pi)
        b = (1 / shear + 1 / (shear + lame)) / (4 * np.pi)
        loaded = (1 - self.porosity) ** 2 * self.coordination**2 * np.asarray(stress, float)
        bulk = np.cbrt(3 * loaded / (np.pi**4 * b**2)) / 6
        return bulk, 0.6 * bulk * ((5 * b + a) / (2 * b + a))

    def frame(self, stress: float) -> Frame:
        """Return the frame under lateral restraint, M = K + 4G/3, at an isotropic `stress` (Pa).

        The speed of sound in it, √(M/ρ), is proportional to stress^(1/6).
        """
        bulk, shear = self.moduli(max(stress, LOOSEST_PA))
        return Frame(self.density, float(bulk + 4 / 3 * shear), self.grain.loss)


def plane_modulus(young: ArrayLike, poisson: ArrayLike) -> Real:
    """Return the plane modulus E/(1-ν²) in Pa; the arrays broadcast."""
    return np.asarray(young, float) / (1 - np.square(poisson))


#: Coefficients of the powers of χ = √(Rδ)/h: force on a bonded incompressible layer of thickness h
#: in units of the force on a half-space.
BONDED = np.array([1.0, 1.133, 1.283, 0.769, 0.0975])
#: Coefficients of the powers of χ for the force in units of 16/9 E h³/R, and of its derivative.
_FORCE = np.concatenate([np.zeros(3), BONDED])
_SLOPE = np.polynomial.polynomial.polyder(_FORCE)


def layer_approach(force: float, radius: float, thickness: float, young: float) -> float:
    """Return the approach δ (m) of a rigid sphere that `force` (N) presses into a layer.

    Radius of the sphere and thickness of the layer are in m, Young's modulus in Pa. The layer is
    incompressible and bonded to a rigid ground, so F = 16/9 E √R δ^(3/2) (1 + 1.133χ + 1.283χ² +
    0.769χ³ + 0.0975χ⁴) with χ = √(Rδ)/h (Dimitriadis et al., Biophys. J. 82, 2002, 2798, eq. 13;
    Hertz for χ → 0). Newton's method solves for χ; it starts above the root, where it cannot
    overshoot.
    """
    scale = 16 / 9 * young * thickness**3 / radius
    chi = np.cbrt(force / scale)
    for _ in range(60):
        value = np.polynomial.polynomial.polyval(chi, _FORCE) - force / scale
        step = value / np.polynomial.polynomial.polyval(chi, _SLOPE)
        chi -= step
        if abs(step) <= 1e-14 * chi:
            break
    return float((chi * thickness) ** 2 / radius)


def layer_stiffness(force: float, radius: float, thickness: float, young: float) -> float:
    """Return the stiffness dF/dδ (N/m) of the layer of `layer_approach` under `force` (N)."""
    chi = np.sqrt(radius * layer_approach(force, radius, thickness, young)) / thickness
    slope = np.polynomial.polynomial.polyval(chi, _SLOPE)
    # F = s χ³(...) with s = 16/9 E h³/R and dχ/dδ = R/(2 h² χ).
    return float(16 / 9 * young * thickness / 2 * slope / chi)


def spread_compliance(modulus: ArrayLike, radius: ArrayLike) -> Real:
    """Return the mean displacement per force (m/N) of a half-space under a disc.

    The pressure on the disc is uniform. With the plane modulus E* = E/(1-ν²) in Pa and the radius a
    in m, the result is 16/(3π² E* a) (Love 1929; Johnson, eq. 3.29). The arrays broadcast.
    """
    return 16 / (3 * np.pi**2 * np.asarray(modulus, float) * np.asarray(radius))


def seat(stress: float, pack: Pack, solid: Material | None, latex: Latex = Latex()) -> Spring:
    """Return the spring between the lowest grains and the object, under `stress` (Pa).

    The object is a `solid`, or rigid for None. Each grain presses with the force stress/seats. The
    latex yields (`layer_stiffness`), and so do grain and object under a patch of contact
    (`spread_compliance`). The radius of the patch is √(Rδ) in the latex, or that of Hertz,
    (3FR/4E*)^(1/3), if it is larger; without latex, the compliance is 8 % higher than that of
    Hertz. The springs are in series: their compliances add, and each loss factor is weighted by its
    share of the compliance.
    """
    force = max(stress, LOOSEST_PA) / pack.seats_per_m2
    radius = pack.diameter / 2
    solids = [pack.grain] if solid is None else [pack.grain, solid]
    moduli = [float(plane_modulus(m.young_pa, m.poisson)) for m in solids]
    patch = float(np.cbrt(3 * force * radius * sum(1 / modulus for modulus in moduli) / 4))
    compliance = 0.0
    loss_compliance = 0.0
    if latex.thickness:
        approach = layer_approach(force, radius, latex.thickness, latex.young)
        patch = max(patch, float(np.sqrt(radius * approach)))
        compliance = 1 / layer_stiffness(force, radius, latex.thickness, latex.young)
        loss_compliance = compliance * latex.loss
    for material, modulus in zip(solids, moduli, strict=True):
        surface = float(spread_compliance(modulus, patch))
        compliance += surface
        loss_compliance += surface * material.loss
    return Spring(pack.seats_per_m2 / compliance, loss_compliance / compliance)
