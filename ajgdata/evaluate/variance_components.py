"""How much of a feature's variance lies between objects, sessions, grasps and recordings."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ajgdata.types import NotPossibleError


class VarianceComponents(NamedTuple):
    """Variances, summed over the feature's bins, in squares of the length of the mean feature.

    NaN where nothing tells one from the next below, which then holds both.
    """

    object: float
    session: float
    object_in_session: float
    grasp: float
    recording: float


def balanced(
    feature: np.ndarray, objects: np.ndarray, sessions: np.ndarray, grasps: np.ndarray
) -> np.ndarray:
    """Return features (objects, sessions, grasps, recordings, f) from rows (n, f) and names (n,).

    Of objects that all sessions have, and of each as many grasps, and of these as many recordings,
    as all have, the first by name. A grasp of one recording stands back where there are two of more
    everywhere: it would leave one of all. Raises NotPossibleError where fewer than two objects or
    grasps are left.
    """
    cells = {
        (one, session): [np.flatnonzero(grasps == g) for g in np.unique(grasps[there])]
        for one in np.unique(objects)
        for session in np.unique(sessions)
        if (there := (objects == one) & (sessions == session)).any()
    }
    repeated = {key: [rows for rows in some if len(rows) > 1] for key, some in cells.items()}
    if all(len(some) > 1 for some in repeated.values()):
        cells = repeated
    every = np.unique(sessions)
    whole = [one for one in np.unique(objects) if all((one, s) in cells for s in every)]
    kept = [cells[one, session] for one in whole for session in every]
    count = min((len(some) for some in kept), default=0)
    if len(whole) < 2 or count < 2:
        raise NotPossibleError("it needs two objects with two grasps each in every session")
    repeats = min(len(rows) for some in kept for rows in some[:count])
    chosen = np.array([rows[:repeats] for some in kept for rows in some[:count]])
    return feature[chosen.reshape(len(whole), len(every), count, repeats)]


def variance_components(feature: np.ndarray) -> VarianceComponents:
    """Return the components of features (objects, sessions, grasps, recordings, f).

    Objects and sessions are crossed, grasps nested in both, recordings in grasps, all random:
    each mean square of the analysis of variance is set equal to its expectation (Searle, Casella &
    McCulloch 1992, Variance Components, ch. 4). What comes out negative is 0.
    """
    given = feature.astype(float)
    objects, sessions, grasps, repeats, _ = given.shape
    of_grasp = given.mean(3, keepdims=True)
    cell = of_grasp.mean(2, keepdims=True)
    of_object, of_session = cell.mean(1, keepdims=True), cell.mean(0, keepdims=True)
    mean = of_object.mean(0, keepdims=True)
    both = cell - of_object - of_session + mean
    # Degrees of freedom, and rows that each deviation stands for.
    squares = {
        "recording": (given - of_grasp, objects * sessions * grasps * (repeats - 1), 1),
        "grasp": (of_grasp - cell, objects * sessions * (grasps - 1), repeats),
        "object_in_session": (both, (objects - 1) * (sessions - 1), repeats * grasps),
        "session": (of_session - mean, sessions - 1, repeats * grasps * objects),
        "object": (of_object - mean, objects - 1, repeats * grasps * sessions),
    }
    ms = {
        key: rows * float(np.sum(deviation**2)) / free if free else np.nan
        for key, (deviation, free, rows) in squares.items()
    }
    below = {
        "grasp": 0.0 if repeats == 1 else ms["recording"],
        "object_in_session": ms["grasp"],
        "session": ms["object_in_session"],
        "object": ms["grasp"] if sessions == 1 else ms["object_in_session"],
    }
    size = float(np.sum(mean**2))
    found = {key: max(ms[key] - below.get(key, 0.0), 0.0) / squares[key][2] / size for key in ms}
    return VarianceComponents(
        **{key: value if squares[key][1] else np.nan for key, value in found.items()}
    )
