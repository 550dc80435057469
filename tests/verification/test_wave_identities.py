"""What holds at round-off, whatever the grid."""

import numpy as np
import pytest
from wave_cases import AIR, bowl, box, closed, energies, lossy_bowl, random_state

from ajgdata.gripper.solver import Probe, at_rest, march


def test_energy_is_constant_in_a_closed_cavity_with_cut_cells():
    _, system = closed(bowl(), 4e-3, 0.031, -0.031, 0.036)
    assert system.raised_cells > 0.02  # there are cut cells that need the stabilisation
    energy = energies(system, random_state(system), 2_000)
    assert np.ptp(energy) < 2_000**0.5 * 50 * np.finfo(float).eps * energy[0]


def test_energy_never_grows_with_drag_poles_and_walls():
    system = lossy_bowl(4e-3)
    energy = energies(system, random_state(system), 1_000)
    assert np.all(np.diff(energy) <= 1e-13 * energy[0])
    assert energy[-1] < 0.5 * energy[0]
    assert np.all(energy > 0)


def _at(system, flat):
    return Probe(np.array([flat], np.uint64), np.ones(1))


def _two_cells(system):
    live = np.flatnonzero(system.mass.ravel())
    return live[len(live) // 7], live[-len(live) // 5]


def test_speaker_and_microphone_may_change_places():
    system = lossy_bowl(4e-3)
    a, b = _two_cells(system)
    pulse = np.array([1.0])
    there = march(system, at_rest(system), _at(system, a), _at(system, b), pulse, 800)
    back = march(system, at_rest(system), _at(system, b), _at(system, a), pulse, 800)
    assert np.max(np.abs(there)) > 0
    assert np.max(np.abs(there - back)) < 1e-12 * np.max(np.abs(there))


def test_the_response_is_linear():
    system = lossy_bowl(4e-3)
    a, b = (_at(system, n) for n in _two_cells(system))
    x, y = np.random.default_rng(1).standard_normal((2, 300))
    one, two, both = (
        march(system, at_rest(system), a, b, drive, 600) for drive in (x, y, 2 * x - 3 * y)
    )
    assert np.max(np.abs(both - (2 * one - 3 * two))) < 1e-12 * np.max(np.abs(both))


def test_a_box_mode_has_the_dispersion_of_the_scheme():
    h, counts, orders = 4e-3, (12, 8, 10), (3, 2, 1)
    cells, system = closed(box(*(n * h for n in counts)), h, 7 * h, 0.0, counts[2] * h)
    live = cells.volume > 0
    assert live.sum() == np.prod(counts)
    waves = [np.pi * m / (n * h) for m, n in zip(orders, counts, strict=True)]
    x, y, z = (
        np.cos(k * (axis + shift))
        for k, axis, shift in zip(
            waves, (cells.x, cells.y, cells.z), (6 * h, 4 * h, 0.0), strict=True
        )
    )
    state = at_rest(system)
    state.p[:] = (live * z[:, None, None] * y[None, :, None] * x[None, None, :]).ravel()
    courant = AIR.sound_speed * system.dt / h
    twice_cosine = 2 - 4 * courant**2 * sum(np.sin(k * h / 2) ** 2 for k in waves)
    silent = Probe(np.zeros(1, np.uint64), np.zeros(1))
    history = []
    for _ in range(200):
        march(system, state, silent, silent, np.zeros(0), 1)
        history.append(state.p.copy())
    p = np.array(history)
    residual = p[2:] - twice_cosine * p[1:-1] + p[:-2]
    # 200 steps of round-off in the leapfrog grow at most linearly.
    assert np.max(np.abs(residual)) < 200 * 16 * np.finfo(float).eps


@pytest.mark.parametrize(
    ("steps", "dtype"),
    [
        (100_000, np.float32),
        (100_000, np.float64),
        pytest.param(1_000_000, np.float32, marks=pytest.mark.slow),
    ],
)
def test_long_runs_do_not_grow(steps, dtype):
    system = lossy_bowl(6e-3, dtype)
    _, rigid = closed(bowl(), 6e-3, 0.031, -0.031, 0.036)
    a, b = (_at(system, n) for n in _two_cells(system))
    lossy = march(system, at_rest(system), a, b, np.ones(1), steps)
    first, last = np.abs(lossy[:1_000]).max(), np.abs(lossy[-1_000:]).max()
    assert last < 1e-2 * first
    # Without losses nothing decays, and nothing may grow either: 1 % is far above the round-off
    # of 1e5 steps (a random walk of 1e5^½ 1e-16), far below any instability.
    if dtype is np.float64:
        state = random_state(rigid)
        before = energies(rigid, state, 1)[0]
        march(rigid, state, a, b, np.zeros(0), steps)
        assert energies(rigid, state, 1)[0] == pytest.approx(before, rel=1e-10)
