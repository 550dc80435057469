"""From gripper to gripper: what a classifier of one is worth on another, in different spaces."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from sklearn.neighbors import KNeighborsClassifier

#: Of a thing there may be one calibration grasp: more neighbours than one would outvote it.
NEAREST = 1


@dataclass(frozen=True, eq=False)
class Draw:
    """Rows of a gripper: `calibration` in the order in which grasps are given to the classifier,
    one of each thing at a time, and `test`."""

    calibration: tuple[np.ndarray, ...]
    test: np.ndarray


def calibration_draws(
    thing: np.ndarray, grasp: np.ndarray, rows: np.ndarray, grasps: int, seed: int
) -> Iterator[Draw]:
    """Yield disjoint choices of test grasps, the others being there to calibrate with.

    `thing`, `grasp` (n,) are labels, `rows` those of one gripper; of each thing `grasps` are for
    calibration and as many as then are left of the rarest thing are tested on. There are as many
    draws as fit without testing a grasp twice; the order is drawn from `seed`. Raises ValueError
    where a thing has no grasp left to test on.
    """
    generator = np.random.default_rng(seed)
    orders = []
    for label in np.unique(thing[rows]):
        names = np.unique(grasp[rows][thing[rows] == label])
        if len(names) <= grasps:
            raise ValueError(f"{label!r} has {len(names)} grasps, all needed to calibrate")
        orders.append([rows[grasp[rows] == name] for name in generator.permutation(names)])
    fewest = min(map(len, orders))
    tested = fewest - grasps
    for start in range(0, fewest - tested + 1, tested):
        turned = [order[start:] + order[:start] for order in orders]
        yield Draw(
            tuple(np.concatenate([order[tested + n] for order in turned]) for n in range(grasps)),
            np.concatenate([part for order in turned for part in order[:tested]]),
        )


def transfer_accuracy(
    space: np.ndarray, thing: np.ndarray, base: np.ndarray, draw: Draw, grasps: int
) -> float:
    """Return the accuracy on the test rows of `draw`, by the nearest of the rows `base` and of so
    many calibration grasps. `space` (n, d), `thing` (n,)."""
    known: Sequence[np.ndarray] = [base, *draw.calibration[:grasps]]
    rows = np.concatenate(known)
    model = KNeighborsClassifier(NEAREST).fit(space[rows], thing[rows])
    return float(np.mean(model.predict(space[draw.test]) == thing[draw.test]))
