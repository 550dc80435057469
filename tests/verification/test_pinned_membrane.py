"""Why grains return more than the empty gripper at low frequencies: they hold the membrane."""

import numpy as np
import pytest

from ajgdata.gripper import SAMPLE_RATE_HZ, Scene, simulate
from ajgdata.gripper.solver_plan import build_plan
from ajgdata.gripper.system import System

#: Third octaves in which a wave is longer than ten times the gripper is deep.
BANDS_HZ = ((56, 71), (71, 89), (89, 112), (112, 141), (141, 178), (178, 224))
HERTZ = np.arange(1.0, 300.0)
CUBE = {"kind": "cube", "edge_mm": 25}


def _lumped(system: System) -> np.ndarray:
    """Pressure per volume velocity at HERTZ of a cavity that is smaller than any wave: its
    compliance beside that of all its walls."""
    walls = system.walls
    half = system.dt / 2
    admittance, inertia, spring, coupling = (
        np.asarray(part, float)
        for part in (walls.admittance, walls.inertia, walls.half_spring, walls.coupling)
    )
    area = coupling / admittance / np.asarray(system.capacities.yield_, float)[walls.cell]
    iw = 2j * np.pi * HERTZ[:, None]
    impedance = iw * inertia * half + (1 / admittance - inertia - spring) + spring / half / iw
    return 1 / (iw[:, 0] * system.mass.sum() + (area / impedance).sum(axis=1))


def _levels(medium: str) -> tuple[np.ndarray, np.ndarray]:
    """Level (dB) in each of BANDS_HZ of the simulated response and of the lumped one."""
    numerics = {"decay_db": 80, "dx_mm": 5}
    scene = Scene.model_validate({"object": CUBE, "medium": {"kind": medium}, "numerics": numerics})
    samples = simulate(scene).samples
    spectrum = np.fft.rfft(samples, SAMPLE_RATE_HZ)[1 : len(HERTZ) + 1]
    both = (np.abs(values) ** 2 for values in (spectrum, _lumped(build_plan(scene).system)))
    marched, lumped = (
        np.array([10 * np.log10(power[low - 1 : high].mean()) for low, high in BANDS_HZ])
        for power in both
    )
    return marched, lumped


def test_grains_return_more_than_the_empty_gripper_because_they_hold_its_membrane():
    """The circuit, in which grains do nothing but hold the membrane, has the whole effect.

    The circuit lacks the heat that grains take out of slow sound, at most γ = 1.4 (2.9 dB), and the
    air of 90 mm that moves with the membrane, 0.11 kg/m² beside 0.3 (2.7 dB)."""
    air, air_lumped = _levels("air")
    marched, lumped = _levels("plastic")
    assert np.all(marched[:5] - air[:5] > 10)
    assert marched - air == pytest.approx(lumped - air_lumped, abs=2.9 + 2.7)
