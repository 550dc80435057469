"""Which recordings stand together in a batch."""

from __future__ import annotations

import numpy as np


def draw_batches(
    instance: np.ndarray,
    grasp: np.ndarray,
    *,
    instances: int,
    recordings: int,
    epochs: int,
    generator: np.random.Generator,
) -> np.ndarray:
    """Row numbers (steps, instances * recordings): `recordings` of each of some things.

    `instance`, `grasp` (n,) are labels. A thing's recordings in a batch are of different grasps as
    long as it has such; a thing with fewer grasps stands there with some of them twice, and such a
    pair counts as none. An epoch is as many batches as hold n recordings. Raises ValueError for
    fewer than two things, and when no thing has two grasps: there is then nothing to learn.
    """
    things = np.unique(instance)
    if len(things) < 2:
        raise ValueError("all recordings are of one thing: an embedding needs at least two")
    of = [_by_grasp(np.flatnonzero(instance == thing), grasp) for thing in things]
    if all(len(grasps) < 2 for grasps in of):
        raise ValueError("no thing was grasped twice: there is no similar pair to learn from")
    chosen = min(instances, len(things))
    per_epoch = -(-len(instance) // (chosen * recordings))
    batches = np.empty((epochs * per_epoch, chosen, recordings), dtype=np.int64)
    for batch in batches:
        for rows, thing in zip(batch, generator.permutation(len(things)), strict=False):
            grasps = of[thing]
            picked = np.resize(generator.permutation(len(grasps)), recordings)
            rows[:] = [generator.choice(grasps[number]) for number in picked]
    return batches.reshape(len(batches), -1)


def _by_grasp(rows: np.ndarray, grasp: np.ndarray) -> list[np.ndarray]:
    return [rows[grasp[rows] == one] for one in np.unique(grasp[rows])]
