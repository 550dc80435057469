"""Stiff and extreme cases: each is bounded, and the study covers grids, precisions, long runs."""

from dataclasses import replace

import numpy as np
import pytest

from ajgdata.studies.accuracy import GRIDS_MM
from ajgdata.studies.energy import fastest
from ajgdata.studies.extreme_cases import DX_MM, LONG_STEPS, H, Trial, from_bowl, trials
from ajgdata.studies.stability import (
    INTERVAL,
    UNIT_ROUNDOFF,
    EnergyRun,
    energy_run,
    judge,
    neighbouring_grids,
    recorded_steps,
    tables,
    worst_trials,
)

#: Of the trials of the study: all lossless modes and time steps, and every fourth other one.
TRIALS = {
    f"{trial.group}: {trial.name}": trial
    for number, trial in enumerate(trials(quick=True))
    if trial.group in ("mode", "time step", "all parts") or number % 4 == 0
}
#: float32 keeps 24 bits; the largest difference seen comes from phases that drift apart by
#: as much a step, over a run of 1,000 steps of waves of a few steps each.
SINGLE = 1_000 * 2.0**-24 * 2 * np.pi


@pytest.mark.parametrize("name", TRIALS)
def test_each_is_bounded(name):
    verdict = judge(TRIALS[name])
    assert verdict["outcome"] == "bounded" and verdict["passed"], verdict
    # The growth that the leapfrog has at the limit of its grid.
    assert 1 < verdict["transient"] < (1e4 if "enlarged" in name else 60)
    assert verdict["growth"] <= 1 + 1e-12
    assert verdict["gain"] <= UNIT_ROUNDOFF[np.float64]
    assert verdict["gain_single"] <= UNIT_ROUNDOFF[np.float32]
    assert verdict["difference_single"] < SINGLE
    assert verdict["added_volume"] < 0.02 or "enlarged" in name


def at_ratio(system, ratio, largest):
    """`system` with a time step of `ratio` of the largest stable one and no cell enlarged."""
    factor = 4 * ratio**2 / largest
    gains = {name: factor * getattr(system.faces, name) for name in ("gain_x", "gain_y", "gain_z")}
    return replace(system, faces=system.faces._replace(**gains))


def growing(dtype):
    """The bowl of the study, a thousandth above the limit of its time step."""
    largest = fastest(from_bowl(packing=None)(np.float64)[0])
    system, source, receiver = from_bowl(packing=None)(dtype)
    return at_ratio(system, 1.001, largest), source, receiver


def test_cells_not_enlarged_are_caught_growing():
    assert judge(Trial("g", "n", growing, 2_000))["outcome"] == "grows"


def test_the_default_grid_and_its_neighbours_are_tested():
    assert neighbouring_grids(GRIDS_MM, DX_MM) == (5.2, 4.2, 3.75)
    assert neighbouring_grids((6.0, 4.2), 4.2) == (6.0, 4.2)
    (coarse,) = (trial for trial in trials(True, 5.2) if trial.name == "rigid cube")
    assert coarse.dx_mm == 5.2
    cells = {dx: next(trials(True, dx)).build(np.float64)[0].mass.size for dx in (5.2, 4.2)}
    assert cells[5.2] < cells[4.2]


def test_a_gain_within_a_run_is_seen_although_the_energy_falls_later():
    run = EnergyRun(np.zeros(1), np.array([1, 101, 201]), np.array([1.0, 1.5, 0.5]))
    assert run.growth == 0.5 and run.gain == pytest.approx(0.005)
    assert not run.is_bounded(1e-3) and run.is_bounded(0.01)


def test_energies_are_recorded_at_logarithmic_steps_that_are_far_apart():
    recorded = recorded_steps(LONG_STEPS)
    assert recorded[0] == 1 and recorded[-1] == LONG_STEPS
    assert np.diff(recorded).min() >= INTERVAL - 1
    short = energy_run(from_bowl(packing=None, h=H)(np.float64), 1_000)
    assert len(short.energy) == len(recorded_steps(1_000)) == 5
    # The pulse takes one step, and each energy one.
    assert len(short.pressure) == 1_000 - 1 - 4


def test_the_worst_cases_are_those_with_the_largest_growth_in_either_precision():
    tested = [Trial("g", name, growing, 1) for name in "abc"]
    units = ((0.1, 0.2), (0.1, 0.9), (0.5, 0.1))
    rows = [
        {
            "steps": 10,
            "growth": 1 + 10 * double * UNIT_ROUNDOFF[np.float64] * 10,
            "growth_single": 1 + 10 * single * UNIT_ROUNDOFF[np.float32] * 10,
        }
        for double, single in units
    ]
    assert [trial.name for trial in worst_trials(tested, rows, 2)] == ["b", "c"]
    same_case = [
        replace(trial, name="a", dx_mm=dx) for trial, dx in zip(tested, (1, 2, 3), strict=True)
    ]
    assert [trial.dx_mm for trial in worst_trials(same_case, rows, 2)] == [2]


@pytest.mark.slow
def test_the_whole_study_holds():
    """All grids, both precisions, 10⁶ steps of the worst cases, and all limits."""
    by_name = {table.name: table for table in tables()}
    for name in ("limits", "long_runs", "stability"):
        failed = [row for row in by_name[name].rows if not row["passed"]]
        assert by_name[name].rows and failed == []
    assert set(by_name["stability"].column("dx_mm")) == {5.2, 4.2, 3.75}
    assert set(by_name["long_runs"].column("steps")) == {LONG_STEPS}
    assert len(by_name["unreached"].rows) == 3
