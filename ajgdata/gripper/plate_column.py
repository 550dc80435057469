"""A plate on the rim of a concave piece of rubber, with the grains on it.

On a line of support a plate bends as it bounces: its own modes (`bending.ring_modes`) stand in for
the column below the imprint. The grains' seat and frame stand on its mean displacement there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from ajgdata.gripper.bending import PlateModes
from ajgdata.gripper.column import Bed, Body, StackModes, grain_stack

Real = NDArray[np.floating]


def bent_modes(
    modes: PlateModes, shapes: Real, area: Real, body: Body, bed: Bed | None
) -> StackModes:
    """Return the modes of a plate, and of the grains on it if there is a `bed`.

    `shapes` (N, columns) are the plate's over the columns of the imprint, of `area` (m²). In its
    modal coordinates the plate has unit masses and the springs ω²; the imprint moves by the mean of
    the shapes, through which the grains are joined to it.
    """
    mean = shapes @ area / area.sum()
    if bed is None:
        return StackModes(modes.square, modes.loss, mean[:, None], shapes)
    grains, count = grain_stack(body, bed), len(modes.square)
    joined = np.zeros((len(grains.mass), count + len(grains.mass) - 1))
    joined[0, :count] = mean
    joined[1:, count:] = np.eye(len(grains.mass) - 1)
    mass, stiffness, damping = (
        joined.T @ matrix @ joined + np.diag(np.pad(of_plate, (0, len(matrix) - 1)))
        for matrix, of_plate in (
            (grains.mass, np.ones(count)),
            (grains.stiffness, modes.square),
            (grains.damping, modes.loss * modes.square),
        )
    )
    square, vectors = eigh(stiffness, mass)
    square = np.maximum(square, np.finfo(float).eps * square[-1])
    loss = np.einsum("in,ij,jn->n", vectors, damping, vectors) / square
    return StackModes(square, loss, (joined @ vectors).T, vectors[:count].T @ shapes)
