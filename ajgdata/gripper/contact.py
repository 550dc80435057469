"""Contact mechanics of grains, membrane, object and support: pure functions, SI units.

What each effect is worth for the sound, and which of them the simulation keeps, is in
docs/contact.md; the simulation takes its frame, its seat and its support from here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ajgdata.gripper.objects import Material

Real = NDArray[np.floating]
#: m/s².
GRAVITY = 9.81
#: What grains are made of. Densities: the paper's balls, 0.2 g of 6 mm and 0.36 g of 4.5 mm, and
#: handbook values else; the modulus and loss of coffee, a brittle foam, are estimates.
GRAIN_SOLIDS = {
    "plastic": Material(density_kg_m3=1_770.0, young_pa=2.5e9, poisson=0.35, loss=0.04),
    "metal": Material(density_kg_m3=7_550.0, young_pa=200e9, poisson=0.30, loss=0.002),
    "coffee": Material(density_kg_m3=1_200.0, young_pa=5e8, poisson=0.30, loss=0.10),
}
#: Forces per area below this (Pa) are the weight of a grain or two: no frame is looser.
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
    """The membrane as an elastic layer; small-strain values of natural rubber (estimate)."""

    density = 1_000.0

    thickness: float = 0.3e-3
    young: float = 1.5e6
    loss: float = 0.1


@dataclass(frozen=True)
class Pack:
    """A random packing of equal spheres of one material.

    `coordination`: contacts per grain; 6 is the isostatic count of frictionless spheres, which a
    poured packing is near (O'Hern et al., Phys. Rev. E 68, 2003).
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
        """Grains that touch a wall per area: number density times one diameter, 6(1-φ)/(πd²)."""
        return 6 * (1 - self.porosity) / (np.pi * self.diameter**2)

    def moduli(self, stress: ArrayLike) -> tuple[Real, Real]:
        """Bulk and shear modulus (Pa, of the shape of `stress`) under an isotropic stress (Pa),
        both ∝ stress^(1/3).

        Walton, J. Mech. Phys. Solids 35 (1987) 213; for rough spheres the same as Digby, J. Appl.
        Mech. 48 (1981) 803, without initial bonds: no slip at the contacts (Mindlin 1949).
        """
        shear = self.grain.young_pa / (2 * (1 + self.grain.poisson))
        lame = 2 * shear * self.grain.poisson / (1 - 2 * self.grain.poisson)
        a = (1 / shear - 1 / (shear + lame)) / (4 * np.pi)
        b = (1 / shear + 1 / (shear + lame)) / (4 * np.pi)
        loaded = (1 - self.porosity) ** 2 * self.coordination**2 * np.asarray(stress, float)
        bulk = np.cbrt(3 * loaded / (np.pi**4 * b**2)) / 6
        return bulk, 0.6 * bulk * ((5 * b + a) / (2 * b + a))

    def frame(self, stress: float) -> Frame:
        """Return the frame under lateral restraint, M = K + 4G/3; sound crosses it at √(M/ρ) ∝
        stress^(1/6)."""
        bulk, shear = self.moduli(max(stress, LOOSEST_PA))
        return Frame(self.density, float(bulk + 4 / 3 * shear), self.grain.loss)


def plane_modulus(young: ArrayLike, poisson: ArrayLike) -> Real:
    """E/(1-ν²) in Pa; the arrays broadcast."""
    return np.asarray(young, float) / (1 - np.square(poisson))


#: Powers of χ = √(Rδ)/h by which a bonded incompressible layer is stiffer than a half-space.
BONDED = np.array([1.0, 1.133, 1.283, 0.769, 0.0975])


def layer_approach(force: float, radius: float, thickness: float, young: float) -> float:
    """Approach (m) of a rigid sphere that `force` (N) presses into an incompressible layer; its
    thickness and the radius in m, Young's modulus in Pa.

    Inverts F = 16/9 E √R δ^(3/2) (1 + 1.133χ + 1.283χ² + 0.769χ³ + 0.0975χ⁴), χ = √(Rδ)/h:
    Dimitriadis et al., Biophys. J. 82 (2002) 2798, eq. 13, for a layer bonded to a rigid ground;
    Hertz as χ → 0. By Newton's rule in χ, from above, where it cannot overshoot.
    """
    scale = 16 / 9 * young * thickness**3 / radius
    powers = np.concatenate([np.zeros(3), BONDED])
    slope = np.polynomial.polynomial.polyder(powers)
    chi = np.cbrt(force / scale)
    for _ in range(60):
        value = np.polynomial.polynomial.polyval(chi, powers) - force / scale
        step = value / np.polynomial.polynomial.polyval(chi, slope)
        chi -= step
        if abs(step) <= 1e-14 * chi:
            break
    return float((chi * thickness) ** 2 / radius)


def layer_stiffness(force: float, radius: float, thickness: float, young: float) -> float:
    """Return dF/dδ of the layer of `layer_approach` in N/m."""
    chi = np.sqrt(radius * layer_approach(force, radius, thickness, young)) / thickness
    powers = np.concatenate([np.zeros(3), BONDED])
    slope = np.polynomial.polynomial.polyval(chi, np.polynomial.polynomial.polyder(powers))
    # F = s χ³(...), χ = √(Rδ)/h, dχ/dδ = R/(2 h² χ), s = 16/9 E h³/R.
    return float(16 / 9 * young * thickness / 2 * slope / chi)


def spread_compliance(modulus: ArrayLike, radius: ArrayLike) -> Real:
    """Mean sinking per force (m/N) of a half-space of plane modulus E/(1-ν²) under a disc of
    uniform pressure, 16/(3π² E* a) (Love 1929; Johnson, eq. 3.29). Modulus in Pa, radius a in m;
    the arrays broadcast."""
    return 16 / (3 * np.pi**2 * np.asarray(modulus, float) * np.asarray(radius))


def seat(stress: float, pack: Pack, object_: Material | None, latex: Latex = Latex()) -> Spring:
    """Return the spring between the lowest grains and the object: latex, then both solids'
    surfaces.

    Each grain bears stress/seats on the latex (`layer_stiffness`), which hands the force on over
    a patch of radius a = √(Rδ), or Hertz's (3FR/4E*)^(1/3) where that is wider, under which both
    solids give way (`spread_compliance`; without latex 8 % more than Hertz). In series compliances
    add, and losses by their share. `object_` None is rigid.
    """
    per_grain, radius = max(stress, LOOSEST_PA) / pack.seats_per_m2, pack.diameter / 2
    solids = [pack.grain] if object_ is None else [pack.grain, object_]
    surfaces = [float(plane_modulus(m.young_pa, m.poisson)) for m in solids]
    patch = float(np.cbrt(3 * per_grain * radius * sum(1 / e for e in surfaces) / 4))
    give = lossy = 0.0
    if latex.thickness:
        layer = per_grain, radius, latex.thickness, latex.young
        patch = max(patch, float(np.sqrt(radius * layer_approach(*layer))))
        give = 1 / layer_stiffness(*layer)
        lossy = give * latex.loss
    for solid, surface in zip(solids, surfaces, strict=True):
        compliance = float(spread_compliance(surface, patch))
        give, lossy = give + compliance, lossy + compliance * solid.loss
    return Spring(pack.seats_per_m2 / give, lossy / give)
