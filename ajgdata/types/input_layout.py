"""Meaning of the columns of a model's input."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Covariate:
    """A covariate of a trained model: its name and unit, and the range of its training values."""

    name: str
    unit: str
    least: float
    largest: float


@dataclass(frozen=True, eq=False)
class InputLayout:
    """The columns of an input (n, f + c): the f values of a feature, and then c covariates.

    `dimensions` has the coordinates of each dimension of the feature by name; the last dimension
    varies fastest. `covariates` are the names of the covariates.

    >>> import numpy as np
    >>> from ajgdata.types.input_layout import InputLayout
    >>> layout = InputLayout({"time": np.arange(3.0), "mel": np.arange(4)}, ("force_n",))
    >>> layout.shape, layout.feature(np.zeros((10, 13))).shape
    ((3, 4), (10, 12))
    """

    dimensions: Mapping[str, np.ndarray]
    covariates: tuple[str, ...] = ()

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the feature of one recording."""
        return tuple(len(values) for values in self.dimensions.values())

    def feature(self, inputs: np.ndarray) -> np.ndarray:
        """Return the feature (n, f) in inputs (n, f + c)."""
        return inputs[:, : math.prod(self.shape)]
