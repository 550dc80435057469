"""The feature of one recording, or of many, as an array with named dimensions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

FREQUENCY = "frequency"
CHANNEL = "channel"
COLUMN = "column"
_FREQUENCY_ATTRS = {
    "units": "Hz",
    "standard_name": "sound_frequency",
    "long_name": "frequency",
}
_CHANNEL_ATTRS = {"units": "1", "long_name": "microphone, counted from 1"}
_COLUMN_ATTRS = {"long_name": "column of the imported table"}


@dataclass(frozen=True, eq=False)
class Axis:
    """A dimension of a feature: its name, its coordinates (length,), and their attributes.

    The attributes are those of CF: `units`, `long_name`.
    """

    name: str
    values: np.ndarray
    attrs: Mapping[str, str] = field(default_factory=dict)

    def equals(self, other: Axis) -> bool:
        """Return whether both axes have the same name and the same coordinates."""
        return self.name == other.name and np.array_equal(self.values, other.values)


@dataclass(frozen=True, eq=False)
class FeatureArray:
    """The feature of one recording: values with one dimension for each of `axes`.

    `doubts` are problems of a recording that is used nevertheless, as (code, problem, fix).
    """

    values: np.ndarray
    axes: tuple[Axis, ...]
    doubts: tuple[tuple[str, str, str], ...] = ()


class TableRow(NamedTuple):
    """A row of an imported table, counted from 1 below the header, and the sha256 of its values in
    `columns`."""

    path: Path
    number: int
    columns: tuple[str, ...]
    sha256: str


def frequency_axis(frequency_hz: np.ndarray) -> Axis:
    """Return the axis of frequencies (f,) in Hz."""
    return Axis(FREQUENCY, frequency_hz, _FREQUENCY_ATTRS)


def channel_axis(microphones: tuple[int, ...]) -> Axis:
    """Return the axis of microphones, which are counted from 1."""
    return Axis(CHANNEL, np.array(microphones, np.int32), _CHANNEL_ATTRS)


def column_axis(columns: tuple[str, ...]) -> Axis:
    """Return the axis of the columns of an imported table, with their names as coordinates."""
    return Axis(COLUMN, np.array(columns, np.str_), _COLUMN_ATTRS)


def same_axes(first: tuple[Axis, ...], second: tuple[Axis, ...]) -> bool:
    """Return whether features with these axes compare."""
    return len(first) == len(second) and all(map(Axis.equals, first, second))
