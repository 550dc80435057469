"""Contact mechanics of grains, membrane, object and support: pure functions, SI units.

What each effect is worth for the sound, and which of them the simulation keeps, is in
docs/contact.md; the simulation takes its frame, its seat and its support from here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ajgdata.gripper.object_materials import Material

Real = NDArray[np.floating]
Complex = NDArray[np.complexfloating]
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

    def moduli(self, stress: ArrayLike, rough: bool = True) -> tuple[Real, Real]:
        """Bulk and shear modulus (Pa, of the shape of `stress`) under an isotropic stress (Pa),
        both ∝ stress^(1/3).

        Walton, J. Mech. Phys. Solids 35 (1987) 213; for rough spheres the same as Digby, J. Appl.
        Mech. 48 (1981) 803, without initial bonds. `rough`: no slip at the contacts
        (Mindlin 1949), otherwise no friction.
        """
        shear = self.grain.young_pa / (2 * (1 + self.grain.poisson))
        lame = 2 * shear * self.grain.poisson / (1 - 2 * self.grain.poisson)
        a = (1 / shear - 1 / (shear + lame)) / (4 * np.pi)
        b = (1 / shear + 1 / (shear + lame)) / (4 * np.pi)
        loaded = (1 - self.porosity) ** 2 * self.coordination**2 * np.asarray(stress, float)
        bulk = np.cbrt(3 * loaded / (np.pi**4 * b**2)) / 6
        return bulk, 0.6 * bulk * ((5 * b + a) / (2 * b + a) if rough else 1.0)

    def frame(self, stress: float) -> Frame:
        """Return the frame under lateral restraint, M = K + 4G/3; sound crosses it at √(M/ρ) ∝
        stress^(1/6)."""
        bulk, shear = self.moduli(max(stress, LOOSEST_PA))
        return Frame(self.density, float(bulk + 4 / 3 * shear), self.grain.loss)


def plane_modulus(young: ArrayLike, poisson: ArrayLike) -> Real:
    """E/(1-ν²) in Pa; the arrays broadcast."""
    return np.asarray(young, float) / (1 - np.square(poisson))


def contact_modulus(one: Material, other: Material) -> float:
    """E* = 1/((1-ν₁²)/E₁ + (1-ν₂²)/E₂) in Pa (Hertz 1882; Johnson 1985, eq. 4.6)."""
    first, second = (plane_modulus(m.young_pa, m.poisson) for m in (one, other))
    return float(1 / (1 / first + 1 / second))


def hertz_approach(force: ArrayLike, radius: ArrayLike, modulus: ArrayLike) -> Real:
    """Approach (m) of a sphere and a half-space: (9F²/(16 R E*²))^(1/3) (Johnson, eq. 4.23).

    Of a force (N), radius (m) and `contact_modulus` E* (Pa); the arrays broadcast.
    """
    return np.cbrt(9 * np.square(force) / (16 * np.asarray(radius) * np.square(modulus)))


def hertz_stiffness(force: ArrayLike, radius: ArrayLike, modulus: ArrayLike) -> Real:
    """dF/dδ of `hertz_approach`, (6 E*² R F)^(1/3) in N/m, twice E* times the contact's radius;
    the arrays broadcast."""
    return np.cbrt(6 * np.square(modulus) * np.asarray(radius) * np.asarray(force))


def mindlin_ratio(poisson: ArrayLike) -> Real:
    """Tangential over normal stiffness of two like spheres that do not slip, 2(1-ν)/(2-ν).

    For an array of Poisson's ratios, of its shape. Mindlin, J. Appl. Mech. 16 (1949) 259.
    """
    return 2 * (1 - np.asarray(poisson, float)) / (2 - np.asarray(poisson, float))


def microslip_loss(tangential: ArrayLike, normal: ArrayLike, friction: ArrayLike) -> Real:
    """Loss factor of a contact that slips at its rim, 2T/(9π μN), T the amplitude of the force.

    Mindlin & Deresiewicz, J. Appl. Mech. 20 (1953) 327: of the stored T²/(2kₜ) a cycle loses
    4T/(9μN), to first order in T/μN. It grows with the amplitude: not linear. The arrays broadcast.
    """
    ratio = np.asarray(tangential, float) / (np.asarray(friction, float) * np.asarray(normal))
    return 2 / (9 * np.pi) * ratio


#: Powers of χ = √(Rδ)/h by which a bonded incompressible layer is stiffer than a half-space.
BONDED = np.array([1.0, 1.133, 1.283, 0.769, 0.0975])


def layer_force(approach: ArrayLike, radius: float, thickness: float, young: float) -> Real:
    """Force (N) that presses a rigid sphere by `approach` (m, any shape) into an incompressible
    layer; its thickness and the radius in m, Young's modulus in Pa.

    16/9 E √R δ^(3/2) (1 + 1.133χ + 1.283χ² + 0.769χ³ + 0.0975χ⁴), χ = √(Rδ)/h: Dimitriadis et
    al., Biophys. J. 82 (2002) 2798, eq. 13, for a layer bonded to a rigid ground; Hertz as χ → 0.
    """
    approach = np.asarray(approach, float)
    stiffer = np.polynomial.polynomial.polyval(np.sqrt(radius * approach) / thickness, BONDED)
    return 16 / 9 * young * np.sqrt(radius) * approach**1.5 * stiffer


def layer_approach(force: float, radius: float, thickness: float, young: float) -> float:
    """Inverse of `layer_force`: by Newton's rule in χ, from above, where it cannot overshoot."""
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
    """dF/dδ of `layer_force` in N/m."""
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


def rest(
    force: float,
    area: float,
    object_: Material,
    radius: float,
    rubber: tuple[Material, float] | None,
) -> Spring:
    """Return the spring under a sphere of `radius` (m) that `force` (N) presses down, per `area`
    (m²).

    On the rigid ground the sphere itself gives way (`hertz_stiffness`); on `rubber`, a sheet of
    some thickness, the sheet does (`layer_stiffness`): it is a thousand times softer.
    """
    if rubber is None:
        plane = plane_modulus(object_.young_pa, object_.poisson)
        return Spring(float(hertz_stiffness(force, radius, plane)) / area, object_.loss)
    sheet, thickness = rubber
    return Spring(layer_stiffness(force, radius, thickness, sheet.young_pa) / area, sheet.loss)


def resonance_hz(stiffness: ArrayLike, mass: ArrayLike) -> Real:
    """√(k/m)/2π in Hz of stiffness (N/m) and mass (kg); the arrays broadcast."""
    return np.sqrt(np.asarray(stiffness, float) / np.asarray(mass)) / (2 * np.pi)


def thermal_admittance(
    omega: ArrayLike, effusivity_ratio: ArrayLike, sound_speed: float = 344.4
) -> Complex:
    """ρc/Z of the thermal boundary layer, (γ-1)√(iωα)/c / (1 + e_air/e_wall), of the shape of
    `omega` (rad/s).

    Pierce, Acoustics (1981), eq. 10-4.12, for an isothermal wall; continuity of temperature and
    heat flow with a wall of finite effusivity e = √(κρc_p) gives the last factor.
    """
    diffusivity = 2.13e-5
    isothermal = 0.4 * np.sqrt(1j * np.asarray(omega) * diffusivity) / sound_speed
    return np.asarray(isothermal / (1 + np.asarray(effusivity_ratio)))


def stack_admittance(
    omega: ArrayLike,
    frame: Frame,
    depth: float,
    seat: Spring,
    mass_per_area: float,
    support: Spring | None,
) -> Complex:
    """Velocity per pressure (m/s/Pa, of the shape of `omega` in rad/s) of the top of the grains,
    pressed against a held object.

    A line of length `depth` (m) and impedance √(ρM) that ends on seat, object (a mass per area)
    and support in series; no `support`: the rigid ground holds the object.
    """
    omega = np.asarray(omega, float)
    iw = 1j * omega
    ground = np.zeros(omega.shape, complex)
    if support is not None:
        held = support.stiffness_n_m3 * (1 + 1j * support.loss) / iw
        ground = 1 / (held + iw * mass_per_area)
    end = iw / (seat.stiffness_n_m3 * (1 + 1j * seat.loss)) + ground
    modulus = frame.modulus_pa * (1 + 1j * frame.loss)
    impedance, wave = np.sqrt(frame.density * modulus), omega * np.sqrt(frame.density / modulus)
    tangent = 1j * np.tan(wave * depth)
    return np.asarray((end + tangent / impedance) / (1 + impedance * end * tangent))
