"""The imprint: where the membrane lies on the object, in columns of the solver's grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.geometry import Cavity
from ajgdata.gripper.grid import FINER, Cells

Real = NDArray[np.floating]
#: A smaller share of contact in a column is rounding noise.
LEAST_CONTACT = 1e-6


@dataclass(frozen=True)
class Imprint:
    """The membrane on the object, in the columns (n,) of the grid that it touches.

    `column` is the flat index (y, x), `area` the area of contact seen from above (m²). `floor` and
    `surface` are the heights of the membrane and of the grains' surface (m). `lowest` is the layer
    of the lowest open cell.
    """

    column: NDArray[np.int64]
    area: Real
    floor: Real
    surface: Real
    lowest: NDArray[np.int64]

    @property
    def total(self) -> float:
        """Area in m²."""
        return float(self.area.sum())

    @property
    def depth(self) -> float:
        """Mean depth of the grains over the imprint, m."""
        if not self.total:
            return 0.0
        return float(np.sum(self.area * (self.surface - self.floor)) / self.total)

    def lowest_cells(self, cells: Cells) -> NDArray[np.int64]:
        """Return the flat index (n,) of the lowest open cell in each column."""
        return self.lowest * cells.shape[1] * cells.shape[2] + self.column


def find_imprint(cavity: Cavity, cells: Cells) -> Imprint:
    """Return the imprint of the object in a cavity."""
    y, x = np.meshgrid(_fine(cells.y, cells.h), _fine(cells.x, cells.h), indexing="ij")
    contact = _column_means(cavity.sampled(cavity.object_contact, x, y))
    floor = _column_means(cavity.sampled(cavity.floor, x, y))
    surface = np.maximum(_column_means(cavity.sampled(cavity.surface, x, y)), floor)
    is_open = (cells.volume > 0) & (cells.area_z + np.roll(cells.area_z, 1, 0) > 0)
    column = np.flatnonzero((contact > LEAST_CONTACT) & is_open.any(0))
    lowest = is_open.reshape(len(cells.z), -1)[:, column].argmax(0)
    area = contact.ravel()[column] * cells.h**2
    return Imprint(column, area, floor.ravel()[column], surface.ravel()[column], lowest)


def _fine(axis: Real, h: float) -> Real:
    """Return the positions (m) of samples, FINER per cell, along an axis of cells of width `h`."""
    return (np.arange(len(axis) * FINER) + 0.5) * h / FINER + axis[0] - h / 2


def _column_means(fine: Real) -> Real:
    """Return the mean of the samples in each column of the grid."""
    ny, nx = fine.shape
    return fine.reshape(ny // FINER, FINER, nx // FINER, FINER).mean(axis=(1, 3))
