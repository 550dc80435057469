"""The operator that is marched, read off the kernel: its limit and resonances."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array, diags_array
from scipy.sparse.linalg import eigsh

from ajgdata.gripper.solver import at_rest, march
from ajgdata.gripper.system import System
from ajgdata.studies.domains import SILENT

Real = NDArray[np.floating]


def operator(system: System) -> csc_array:
    """Return A in p₊ - 2p + p₋ = -A p of a lossless `system`, cell by cell from what the kernel
    does.

    A step from rest leaves p - A p. Unit pressures far enough apart not to be confused are
    marched at once. Raises ValueError if the kernel reaches further than three cells.
    """
    live = np.flatnonzero(system.mass.ravel())
    number = np.full(system.mass.size, -1)
    number[live] = np.arange(len(live))
    trial = np.zeros(system.mass.size)
    trial[live] = np.random.default_rng(0).standard_normal(len(live))
    wanted = applied(system, trial)[live]
    for reach in (1, 3):
        matrix = _probed(system, live, number, reach)
        if np.max(np.abs(matrix @ trial[live] - wanted)) < 1e-12 * np.max(np.abs(wanted)):
            return matrix
    raise ValueError("the kernel reaches further than three cells")


def applied(system: System, p: Real) -> Real:
    """Return A p of `operator` for a pressure in all cells, both (cells,)."""
    state = at_rest(system)
    state.p[:] = p
    march(system, state, SILENT, SILENT, np.zeros(0), 1)
    return p - state.p


def _probed(
    system: System, live: NDArray[np.int64], number: NDArray[np.int64], reach: int
) -> csc_array:
    """A, if it couples cells along the axes no further apart than `reach`."""
    period, where = 2 * reach + 1, np.unravel_index(live, system.shape)
    colour = np.ravel_multi_index([i % period for i in where], (period,) * 3)
    strides = (system.shape[1] * system.shape[2], system.shape[2], 1)
    # Of each axis and of nothing: the end of a row is no neighbour of the next.
    hops = [(0, 0)] + [(axis, n) for axis in range(3) for n in range(-reach, reach + 1) if n]
    rows, columns, values = [], [], []
    for shade in np.unique(colour):
        ones = live[colour == shade]
        unit = np.zeros(system.mass.size)
        unit[ones] = 1.0
        column = applied(system, unit)
        for axis, n in hops:
            offset, place = n * strides[axis], where[axis][colour == shade] + n
            near = ones[(place >= 0) & (place < system.shape[axis])]
            near = near[number[near + offset] >= 0]
            rows.append(number[near + offset])
            columns.append(number[near])
            values.append(column[near + offset])
    entries = (np.concatenate(rows), np.concatenate(columns))
    matrix = coo_array((np.concatenate(values), entries), shape=(len(live), len(live))).tocsc()
    matrix.eliminate_zeros()
    return matrix


def fastest(system: System) -> float:
    """Largest eigenvalue of `operator`; marching is stable up to 4, where sin²(ωΔt/2) is 1."""
    mass = system.mass.ravel()
    root = np.sqrt(mass[mass > 0])
    matrix = diags_array(root) @ operator(system) @ diags_array(1 / root)
    start = np.random.default_rng(0).standard_normal(len(root))
    return float(eigsh(matrix.tocsr(), 1, which="LA", v0=start, return_eigenvectors=False)[0])
