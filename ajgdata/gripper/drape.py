"""A membrane under tension over an obstacle: it lies on what it can follow, and bridges the rest.

A membrane of tension T that a pressure p presses down has the height w, with
T ∇·(∇w/√(1+|∇w|²)) = p where it touches nothing, and w = the obstacle elsewhere (Laplace 1806;
obstacle problem, Kinderlehrer & Stampacchia 1980). Beside a straight edge it is a cylinder of
radius T/p, over a round hole a sphere of radius 2T/p.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.numba_cache import njit

Real = NDArray[np.floating]
#: Coarsest first; each level begins with the one before, and ends nearer to the solution.
LEVELS = (8, 4, 2, 1)
#: Sweeps on each level, and between two looks at the slopes.
SWEEPS = {8: 80, 4: 60, 2: 60, 1: 16}
LOOK = 4
#: Of successive over-relaxation (Young 1954), for gaps of some 20 samples.
OMEGA = 1.7


def bridged(obstacle: Real, step: float, radius: float) -> Real:
    """Return the height (ny, nx) in m of a membrane over `obstacle`, of its shape and unit.

    `step` (m) is the distance of samples, `radius` T/p in m. At the border the membrane is level
    across it. A fixed number of sweeps: the height follows the obstacle without jumps.
    """
    height: Real = np.zeros((1, 1))
    for coarser in LEVELS:
        below = np.ascontiguousarray(obstacle[::coarser, ::coarser])
        first = height.size == 1
        height = below.copy() if first else np.maximum(_finer(height, below.shape), below)
        wide = coarser * step
        _relax(height, below, wide**2 / radius, wide, SWEEPS[coarser])
    return height


def _finer(height: Real, shape: tuple[int, int]) -> Real:
    """The heights at every second sample, filled in between them by the mean."""
    fine = np.repeat(np.repeat(height, 2, axis=0), 2, axis=1)
    fine[1:-1:2] = (fine[1:-1:2] + fine[2::2]) / 2
    fine[:, 1:-1:2] = (fine[:, 1:-1:2] + fine[:, 2::2]) / 2
    return fine[: shape[0], : shape[1]]


@njit(nogil=True, cache=True)
def _slack(height, step, right, down):
    """1/√(1+|∇w|²) in the faces to the right (rows, columns - 1) and down (rows - 1, columns)."""
    rows, columns = height.shape
    square = step * step
    for i in range(rows):
        above, below = max(i - 1, 0), min(i + 1, rows - 1)
        for j in range(columns - 1):
            along = height[i, j + 1] - height[i, j]
            across = height[below, j] + height[below, j + 1] - height[above, j]
            across = (across - height[above, j + 1]) / 4
            right[i, j] = 1 / np.sqrt(1 + (along * along + across * across) / square)
    for i in range(rows - 1):
        for j in range(columns):
            left, beyond = max(j - 1, 0), min(j + 1, columns - 1)
            along = height[i + 1, j] - height[i, j]
            across = height[i, beyond] + height[i + 1, beyond] - height[i, left]
            across = (across - height[i + 1, left]) / 4
            down[i, j] = 1 / np.sqrt(1 + (along * along + across * across) / square)


@njit(nogil=True, cache=True)
def _relax(height, obstacle, load, step, sweeps):
    """Projected over-relaxation in place, red samples before black ones."""
    rows, columns = height.shape
    right, down = np.zeros((rows, columns)), np.zeros((rows, columns))
    for sweep in range(sweeps):
        if sweep % LOOK == 0:
            _slack(height, step, right, down)
        for colour in range(2):
            for i in range(rows):
                for j in range((i + colour) % 2, columns, 2):
                    total = pulled = 0.0
                    if j > 0:
                        total += right[i, j - 1]
                        pulled += right[i, j - 1] * height[i, j - 1]
                    if j < columns - 1:
                        total += right[i, j]
                        pulled += right[i, j] * height[i, j + 1]
                    if i > 0:
                        total += down[i - 1, j]
                        pulled += down[i - 1, j] * height[i - 1, j]
                    if i < rows - 1:
                        total += down[i, j]
                        pulled += down[i, j] * height[i + 1, j]
                    wanted = (pulled - load) / total
                    new = height[i, j] + OMEGA * (wanted - height[i, j])
                    height[i, j] = max(new, obstacle[i, j])
