"""How often the alarm rings while nothing changes, and what rate it states.

References of the simulated day 1 are parted at random: some make the watch, the others are observed
in turn.

    python benchmarks/drift_alarm.py                    # 250 references, 40 s of one core
    python benchmarks/drift_alarm.py --references 100 --partings 20
"""

from __future__ import annotations

import argparse

import numpy as np

from ajgdata.features.spectrum import spectrum
from ajgdata.gripper import SAMPLE_RATE_HZ, Scene, excitation_sweep, record, simulate
from ajgdata.live.drift import DriftWatch
from ajgdata.types import FeatureSettings

#: References of day 1, and how many must agree.
CASES = ((7, 3), (13, 2), (13, 3), (30, 2), (30, 3), (99, 1))


def references(count: int) -> np.ndarray:
    """Return features of the empty gripper (count, f), each with nuisances of its own."""
    sweep, settings = excitation_sweep(), FeatureSettings()
    takes = (
        record(simulate(Scene.model_validate({"grasp": {"seed": seed}})), sweep, seed=seed)
        for seed in range(count)
    )
    return np.array([spectrum(take.samples, SAMPLE_RATE_HZ, settings) for take in takes])


def rates(known: int, in_a_row: int, features: np.ndarray, partings: int) -> tuple[float, float]:
    """Return the share of moments at which the alarm rings, and what it states."""
    generator, rung, stated = np.random.default_rng(known), [], 0.0
    for _ in range(partings):
        order = generator.permutation(len(features))
        watch = DriftWatch(features[order[:known]], in_a_row=in_a_row)
        seen = [watch.observe(one) > 1 for one in features[order[known:]]]
        rung.append(np.mean(seen[in_a_row - 1 :]))
        stated = watch.false_alarm
    return float(np.mean(rung)), stated


def main() -> None:
    """Print a line for each number of references of day 1."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--references", type=int, default=250)
    parser.add_argument("--partings", type=int, default=40)
    given = parser.parse_args()
    features = references(given.references)
    for known, in_a_row in CASES:
        rung, stated = rates(known, in_a_row, features, given.partings)
        print(
            f"{known:3d} references, {in_a_row} in a row: "
            f"{100 * rung:.2f} % of {100 * stated:.2f} %"
        )


if __name__ == "__main__":
    main()
