"""Grains, seat, object and support in series against springs, lines and a chain of masses."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ajgdata.gripper.contact import (
    Frame,
    Spring,
    resonance_hz,
    stack_admittance,
    thermal_admittance,
)

FRAME, SEAT, SUPPORT = Frame(1060.0, 2.2e7, 0.04), Spring(2.5e8, 0.1), Spring(6e7, 0.15)
OMEGA = 2 * np.pi * np.array([150.0, 700.0, 2_000.0, 5_000.0])


def test_at_rest_all_springs_give_way_in_series():
    omega = np.array([2 * np.pi * 1e-3])
    frame = Frame(1060.0, 2.2e7, 0.0)
    soft = stack_admittance(omega, frame, 0.02, Spring(2.5e8, 0.0), 900.0, Spring(6e7, 0.0))
    give = 0.02 / 2.2e7 + 1 / 2.5e8 + 1 / 6e7
    assert soft[0] / (1j * omega[0]) == pytest.approx(give, rel=1e-9)


def test_no_grains_leave_an_object_on_its_support():
    bare = stack_admittance(OMEGA, FRAME, 0.0, Spring(1e30, 0.0), 40.0, SUPPORT)
    exact = 1 / (1j * OMEGA * 40.0 + 6e7 * (1 + 0.15j) / (1j * OMEGA))
    assert bare == pytest.approx(exact, rel=1e-12)
    assert resonance_hz(4 * np.pi**2 * 9.0, 1.0) == pytest.approx(3.0)


def test_a_chain_of_many_masses_does_the_same():
    count, depth = 2_000, 0.02
    h, modulus = depth / count, FRAME.modulus_pa * (1 + 1j * FRAME.loss)
    lines = stack_admittance(OMEGA, FRAME, depth, SEAT, 75.0, SUPPORT)
    for omega, line in zip(OMEGA, lines, strict=True):
        # From the ground upwards: compliances add in velocity, masses in impedance.
        impedance = SUPPORT.stiffness_n_m3 * (1 + 1j * SUPPORT.loss) / (1j * omega)
        impedance += 1j * omega * 75.0
        impedance = 1 / (1 / impedance + 1j * omega / (SEAT.stiffness_n_m3 * (1 + 1j * SEAT.loss)))
        for _ in range(count):
            impedance += 1j * omega * FRAME.density * h / 2
            impedance = 1 / (1 / impedance + 1j * omega * h / modulus)
            impedance += 1j * omega * FRAME.density * h / 2
        # Trapezoidal chain: (k h)²/12 of the phase, below 1e-6 at 5 kHz, times the resonance.
        assert line == pytest.approx(1 / impedance, rel=1e-5)


@given(
    st.floats(10, 20_000),
    st.floats(0, 0.05),
    st.floats(1e3, 1e15),
    st.floats(1e-9, 1e6),
    st.one_of(st.none(), st.floats(0, 1e15)),
)
@settings(max_examples=60, derandomize=True, deadline=None)
def test_a_stack_is_passive(frequency, depth, stiffness, mass, support):
    held = None if support is None else Spring(support, 0.1)
    omega = np.array([2 * np.pi * frequency])
    admittance = stack_admittance(omega, FRAME, depth, Spring(stiffness, 0.1), mass, held)
    assert np.isfinite(admittance) and admittance.real >= -1e-12 * abs(admittance)


def test_the_thermal_layer_grows_with_the_root_and_vanishes_on_an_insulator():
    low, high = thermal_admittance(OMEGA[:1], 0.0), thermal_admittance(4 * OMEGA[:1], 0.0)
    assert high == pytest.approx(2 * low) and low.real > 0
    assert abs(thermal_admittance(OMEGA[:1], 1e6)[0]) < 1e-9
