"""The plan of a scene: what each part of its physics is worth for the feature, before any marching.

The estimate is a circuit. A part that gives way by ΔY (m³/s per Pa) at the surface of the grains
changes what the microphone hears by about ΔY Z, where Z (Pa s/m³) is how far the cavity answers a
volume velocity: its compliance ρc²/(ωV) beside the yielding membrane at low frequencies, its
diffuse field ρω/√(πA) with the absorbing area A above. What lies under the grains is reached
through them, there and back. The effect is the largest of the means over third octaves and over the
band in which the feature has its energy, times SAFETY: a relative change (L2) of the amplitude of
the response in a band, or of the feature; studies/omissions.py measures what it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.column import StackModes
from ajgdata.gripper.medium import Air, Packing, wave
from ajgdata.gripper.scene_model import PartName
from ajgdata.gripper.walls import WEAKEST

Real = NDArray[np.floating]
Complex = NDArray[np.complexfloating]
#: 95 % of the energy of the feature lie here: a sweep's energy falls as the cavity's modes rise.
FEATURE_BAND_HZ = (1_000.0, 14_000.0)
#: Centres of third octaves (IEC 61260-1, base 10) from 63 Hz, where heavy objects bounce on rubber.
BANDS_HZ = 10 ** (np.arange(18, 42) / 10)
#: Lower and upper edge of a band over its centre.
EDGES = (10**-0.05, 10**0.05)
#: Frequencies in each band.
POINTS = 12
#: Features have unit norm and no negative value, so that no two differ by more.
FURTHEST = float(np.sqrt(2))
#: On whole scenes the circuit errs by a factor of up to four, so that with this the effect is
#: rather over- than underestimated (measured in studies/omissions.py).
SAFETY = 2.5
OMEGA = 2 * np.pi * np.outer(BANDS_HZ, np.geomspace(*EDGES, 2 * POINTS + 1)[1::2]).ravel()
#: Relative distance of these frequencies.
APART = OMEGA[1] / OMEGA[0] - 1
#: No solid loses less.
LEAST_LOSS = 1e-4


def _weights() -> Real:
    """Weights (bands + 1, ω) of the means over each band, and over that of the feature."""
    bands = np.repeat(np.eye(len(BANDS_HZ)), POINTS, axis=1) / POINTS
    low, high = (2 * np.pi * edge for edge in FEATURE_BAND_HZ)
    feature = OMEGA * ((low <= OMEGA) & (high >= OMEGA))
    return np.vstack([bands, feature / feature.sum()])


WEIGHTS = _weights()


@dataclass(frozen=True)
class Part:
    """One part of the physics: kept or left out, its effect as a relative change of a third octave
    or of the feature, whichever is larger (None where there is nothing to estimate), and why."""

    name: PartName
    kept: bool
    effect: float | None
    why: str


@dataclass(frozen=True)
class Circuit:
    """The cavity as the imprint sees it: `answer` Z (Pa s/m³) at OMEGA, the bed's wavenumber k
    (None without grains), its depth (m), the imprint's area (m²), and its radius in 1/k of air."""

    answer: Real
    wavenumber: Complex | None
    depth: float
    area: float
    reach: Real

    def profile(self, rise: Real) -> Complex:
        """Pressure at the fractions `rise` (k,) of the bed over that on its surface: (k, ω)."""
        if self.wavenumber is None:
            return np.ones((len(rise), len(OMEGA)), complex)
        phase = self.wavenumber * self.depth
        return np.cos(phase * rise[:, None]) / np.cos(phase)

    def skin(self, wall: tuple[float, float, float]) -> Complex:
        """Admittance (ω,) of a locally reacting wall of mass, resistance and stiffness per area
        (SI) under the grains, seen at their surface."""
        mass, resistance, stiffness = wall
        # No wall at all is a vacuum, and like the solver's walls not quite one.
        impedance = WEAKEST + 1j * OMEGA * mass + resistance + stiffness / (1j * OMEGA)
        return np.asarray(self.area / impedance * self.profile(np.zeros(1))[0] ** 2)

    def modes(self, modes: StackModes) -> Complex:
        """Admittance of each mode, seen at the surface of the grains: (N, ω)."""
        shape = modes.shape
        if shape.shape[1] == 1:
            driven = shape * self.profile(np.zeros(1))
        else:
            rise = np.linspace(0.0, 1.0, shape.shape[1] - 1)
            middle = np.concatenate([[0.0], (rise[1:] + rise[:-1]) / 2])
            driven = shape[:, -1:] - np.diff(shape, axis=1) @ self.profile(middle)
        return self._moving(modes.square, modes.loss, driven)

    def bent(self, square: Real, loss: Real, mean: Real, uneven: Real) -> Complex:
        """Admittance of modes (N,) under the grains, of which the imprint moves by `mean` (N,) and,
        root mean square, by `uneven` (N,) about it."""
        whole = self._moving(square, loss, mean[:, None] * self.profile(np.zeros(1)))
        return whole + self.uneven(square, loss, uneven)

    def uneven(self, square: Real, loss: Real, uneven: Real) -> Complex:
        """Admittance of what modes (N,) move about their mean, root mean square (N,): it meets
        those waves of the field that are as long as it is, and averages none away."""
        driven = uneven[:, None] * self.profile(np.zeros(1))
        return self._resonance(square, loss) * (self.area * driven) ** 2

    def _moving(self, square: Real, loss: Real, driven: Complex) -> Complex:
        # A piston wider than the wavelength averages most of a diffuse field away (the directivity
        # of a disc, (2 J1(x)/x)² over all directions, as a rational function of ka).
        met = 1 / (1 + self.reach**2 / 2)
        return np.asarray(self._resonance(square, loss) * met * (self.area * driven) ** 2)

    def _resonance(self, square: Real, loss: Real) -> Complex:
        """Velocity per force of modes of unit mass: (N, ω)."""
        natural, width = square[:, None], np.maximum(loss, APART)[:, None]
        damping = 1j * width * np.sqrt(natural) * OMEGA
        motion = 1j * OMEGA / (natural - OMEGA**2 + damping)
        # A resonance narrower than the frequencies are apart is widened, and keeps its mean square.
        within = np.abs(OMEGA / np.sqrt(natural) - 1) < width
        raised = np.sqrt(width / np.maximum(loss[:, None], LEAST_LOSS))
        return np.asarray(motion * np.where(within, raised, 1.0))

    def effects(self, change: Complex) -> Real:
        """Relative change of each band, and of the feature (bands + 1,), by an admittance (ω,) in
        m³/s per Pa at OMEGA."""
        size = np.abs(change) * self.answer
        return np.minimum(SAFETY * np.sqrt(WEIGHTS @ (size / (1 + size)) ** 2), FURTHEST)

    def effect(self, change: Complex) -> float:
        """The largest of `effects`."""
        return float(self.effects(change).max())


def circuit(
    air: Air,
    volume: float,
    absorbing: float,
    packing: Packing | None,
    depth: float,
    area: float,
    beside: Complex | float = 0.0,
) -> Circuit:
    """Circuit of a cavity of `volume` (m³) of air and an absorbing area (m²); what yields `beside`
    the part in question (m³/s per Pa at OMEGA) is the membrane."""
    impedance = air.density * air.sound_speed
    lumped = 1 / np.abs(1j * OMEGA * volume / (air.density * air.sound_speed**2) + beside)
    diffuse = air.density * OMEGA / np.sqrt(np.pi * absorbing)
    answer, wavenumber = np.hypot(lumped, diffuse), None
    if packing is not None and depth > 0:
        wavenumber, bed = wave(*packing.jca(OMEGA, air), OMEGA)
        # Pressure on the bed over that on a rigid wall, (1 + R)/2, on the way in and out.
        surface = bed / (1j * np.tan(wavenumber * depth))
        answer = answer * np.abs(surface / (surface + impedance)) ** 2
    reach = OMEGA / air.sound_speed * np.sqrt(area / np.pi)
    return Circuit(answer, wavenumber, depth, area, reach)
