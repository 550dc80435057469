"""The feature of a recording, of any kind that `types.features.FEATURES` lists.

The class of the settings names a function `compute(sound, settings)`. It gets a `FeatureInput`, and
returns a `FeatureArray` or an xarray.DataArray, whose dimensions and coordinates depend only on the
settings, the sample rate and the microphones. It raises ValueError for a sound without this
feature. Equal arguments give equal results.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import numpy as np

from ajgdata.store.feature_array import (
    CHANNEL,
    Axis,
    FeatureArray,
    TableRow,
    channel_axis,
    column_axis,
)
from ajgdata.types import AudioSettings, DataError, FeatureKind
from ajgdata.types.extras import optional_packages


@dataclass(frozen=True, eq=False)
class FeatureInput:
    """What a feature is computed from.

    - `samples`: (channels, n), float32, full scale ±1; one row per microphone of the data set
    - `sample_rate_hz`: rate of the samples
    - `microphones`: numbers of the channels, counted from 1; (1,) for the mean of all channels
    - `played`: samples (m,) of the sound that the session played; None if it is not known
    """

    samples: np.ndarray
    sample_rate_hz: int
    microphones: tuple[int, ...] = (1,)
    played: np.ndarray | None = None

    @property
    def channels(self) -> Axis:
        """Return the axis of the rows of `samples`."""
        return channel_axis(self.microphones)


class FeatureComputer:
    """Computes the features of recordings with the settings of a data set.

    `folder` is that of its dataset.yaml: files that the settings name are relative to it.
    """

    def __init__(self, audio: AudioSettings, features: FeatureKind, folder: Path = Path()) -> None:
        self.audio = audio
        self._settings = features.in_folder(folder)
        self.least_samples = features.least_samples(audio.sample_rate_hz)
        self.needs_played = features.needs_played
        self.needs_waveform = features.needs_waveform
        self.reaching_hz = features.reaching_hz(audio.sample_rate_hz)

    @cached_property
    def _function(self) -> Callable[..., Any]:
        with optional_packages(f"features.kind {self._settings.kind}"):
            function: Callable[..., Any] = resolve_name(self._settings.function)
        return function

    @cached_property
    def axes(self) -> tuple[Axis, ...]:
        """The dimensions of a feature: those of a short noise.

        Raises DataError if no recording can have the feature, for example because a file of the
        settings is missing.
        """
        columns = self._settings.table_columns
        if columns:
            return (column_axis(columns),)
        shape = (len(self.audio.microphones), self.least_samples)
        noise = np.random.default_rng(0).uniform(-1, 1, self.least_samples)
        samples = np.broadcast_to(noise, shape).astype(np.float32)
        try:
            return self._computed(samples, samples[0]).axes
        except ValueError as error:
            where = f"features.kind {self._settings.kind}"
            raise DataError(where, str(error), "change features in dataset.yaml") from None

    def __call__(self, samples: np.ndarray, played: np.ndarray | None = None) -> FeatureArray:
        """Return the feature of samples (n,), or (channels, n) of several microphones.

        `played` (m,) are the samples of the played sound. The values are float32, and a feature of
        one microphone has no dimension `channel`. Raises ValueError for a recording without this
        feature, for example if it is shorter than one window.
        """
        result = self._computed(samples, played)
        expected = tuple(len(axis.values) for axis in self.axes)
        if result.values.shape != expected:
            kind = self._settings.kind
            raise ValueError(
                f"the feature {kind} has the shape {result.values.shape}, not {expected}"
            )
        if not np.isfinite(result.values).all():
            raise ValueError(f"the feature {self._settings.kind} has NaN or infinity")
        return result

    def from_table(self, row: TableRow) -> FeatureArray:
        """Return the feature in a row of an imported table.

        Raises ValueError for a row without this feature, and DataError for a table that cannot be
        used, or that changed since the import.
        """
        values: np.ndarray = self._function(row, self._settings)
        return FeatureArray(values.astype(np.float32), self.axes)

    def _computed(self, samples: np.ndarray, played: np.ndarray | None) -> FeatureArray:
        """Return the feature, float32, without a dimension for a single microphone."""
        if not self.needs_waveform:
            kind = self._settings.kind
            raise ValueError(f"the feature {kind} is not computed from a sound")
        audio = self.audio
        sound = FeatureInput(
            np.atleast_2d(samples), audio.sample_rate_hz, audio.microphones, played
        )
        result = self._function(sound, self._settings)
        if not isinstance(result, FeatureArray):
            result = _from_data_array(result)
        values = np.asarray(result.values, np.float32)
        axes = result.axes
        if not isinstance(audio.microphone, tuple) and axes[0].name == CHANNEL:
            values = values[0]
            axes = axes[1:]
        return FeatureArray(values, axes, result.doubts)


def _from_data_array(array: Any) -> FeatureArray:
    """Return the feature in an xarray.DataArray. A dimension without coordinates is numbered."""
    axes = tuple(
        Axis(str(name), array[name].values, {k: str(v) for k, v in array[name].attrs.items()})
        for name in array.dims
    )
    return FeatureArray(array.values, axes)
