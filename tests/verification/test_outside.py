"""Sound from outside: the run the other way round against pressing on the membrane itself."""

import numpy as np

from ajgdata.gripper import Scene, build_plan, simulate
from ajgdata.gripper.medium import Air
from ajgdata.gripper.outside import (
    TRANSFER_BINS,
    diffuse_gain,
    directions,
    patch_velocity,
)

RATE = 44_100


def test_slow_sound_from_outside_is_as_loud_inside_as_the_circuit_says():
    """Below 150 Hz the cavity is a spring of air beside the membrane's own mass, resistance and
    spring, and the hose: p/P = Y/(iωC + Y + A/ρc) with Y = S/(r + iωm + k/iω). The 2 is the
    table's. The air of 90 mm adds (ωL/c)²/6, 1 %; the response is cut 50 dB down."""
    scene = Scene.model_validate({"object": None, "medium": {"kind": "air"}})
    plan = build_plan(scene)
    membrane = scene.gripper.membrane
    air = plan.air
    iw = 2j * np.pi * np.array([1, 2, 3]) * RATE / 2 / (TRANSFER_BINS - 1)
    yields = plan.membrane.area.sum() / (
        membrane.resistance_pa_s_m + iw * membrane.mass_kg_m2 + membrane.stiffness_n_m3 / iw
    )
    bore = scene.gripper.port_bore_mm * 1e-3
    hose = np.pi / 4 * bore**2 / (air.density * air.sound_speed)
    volume = plan.cells.volume.sum() * air.compressibility
    expected = np.sqrt(2) * np.abs(yields / (iw * volume + yields + hose))
    np.testing.assert_allclose(simulate(plan).outside[1:4], expected, rtol=0.015)


def test_two_spots_hear_sound_from_all_directions_as_theory_says():
    """<p²> = 2 (a² + b² + 2 a b sin(kr)/(kr)) for spots r apart. A Fibonacci lattice of N points
    integrates waves of kr < √N with an error below 1/N."""
    apart = 0.05
    spots = np.array([[0.0, 0.01, 0.0], [apart, 0.01, 0.0]])
    velocity = np.outer([1.0, -0.6], np.ones(TRANSFER_BINS)).astype(complex)
    air = Air(22.0)
    hertz = np.linspace(0, RATE / 2, TRANSFER_BINS)
    theory = 2 * (1 + 0.36 - 1.2 * np.sinc(2 * hertz * apart / air.sound_speed))
    ours = diffuse_gain(velocity, spots, air, 1 / RATE) ** 2
    low = 2 * np.pi * hertz / air.sound_speed * apart < np.sqrt(len(directions()))
    assert low.sum() > 100
    np.testing.assert_allclose(ours[low], theory[low], atol=4 / len(directions()))


def test_a_patch_moves_as_its_mass_spring_and_resistance():
    """A force that goes from 0 to 1 N and stays: its spectrum is known, and so is v/F."""
    step = 1 / RATE
    motion = np.array([[0.3, 450.0, 1e5]])
    push = np.ones((1, 3_000))
    velocity = patch_velocity(push, motion, step)[0]
    omega = np.pi * RATE * np.linspace(0, 1, TRANSFER_BINS)[1:]
    force = 1 / (1 - np.exp(-1j * omega * step))
    np.testing.assert_allclose(
        velocity[1:], force / (450 + 1j * omega * 0.3 + 1e5 / (1j * omega)), rtol=1e-12
    )
