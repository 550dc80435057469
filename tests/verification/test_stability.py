"""Stiff and extreme cases: each is bounded."""

from dataclasses import replace

import numpy as np
import pytest

from ajgdata.studies.energy import fastest
from ajgdata.studies.extreme_cases import Trial, of_bowl, trials
from ajgdata.studies.stability import judge

#: Of the trials of the study: all lossless modes and time steps, and every fourth other one.
TRIALS = {
    f"{trial.group}: {trial.name}": trial
    for number, trial in enumerate(trials(quick=True))
    if trial.group in ("mode", "time step", "long run") or number % 4 == 0
}
#: float32 keeps 24 bits; the largest difference seen comes from phases that drift apart by
#: as much a step, over a run of 1,000 steps of waves of a few steps each.
SINGLE = 1_000 * 2.0**-24 * 2 * np.pi


@pytest.mark.parametrize("name", TRIALS)
def test_each_is_bounded(name):
    verdict = judge(TRIALS[name])
    assert verdict["outcome"] == "bounded" and verdict["passed"], verdict
    # The growth that the leapfrog has at the limit of its grid.
    assert 1 < verdict["transient"] < (1e4 if "enlarged" in name else 30)
    assert verdict["growth"] <= 1 + 1e-12
    assert verdict["difference_single"] < SINGLE
    assert verdict["added_volume"] < 0.02 or "enlarged" in name


def at_ratio(system, ratio, largest):
    """`system` with a time step of `ratio` of the largest stable one and no cell enlarged."""
    factor = 4 * ratio**2 / largest
    gains = {name: factor * getattr(system.faces, name) for name in ("gain_x", "gain_y", "gain_z")}
    return replace(system, faces=system.faces._replace(**gains))


def test_cells_not_enlarged_are_caught_growing():
    """The judgement can say no: the bowl of the study, a thousandth above its limit."""

    largest = fastest(of_bowl(packing=None)(np.float64)[0])

    def build(dtype):
        system, source, receiver = of_bowl(packing=None)(dtype)
        return at_ratio(system, 1.001, largest), source, receiver

    verdict = judge(Trial("g", "n", build, 2_000))
    assert verdict["outcome"] == "grows"
