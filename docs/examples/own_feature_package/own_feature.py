"""A feature of another package: the level of a recording in octave bands."""

from typing import ClassVar, Literal

import numpy as np
import xarray as xr
from pydantic import Field

from ajgdata import FeatureKind


class OctaveSettings(FeatureKind):
    """Settings of the feature `octaves`, and the name of the function that computes it."""

    function: ClassVar[str] = "own_feature:octave_levels"
    kind: Literal["octaves"] = Field("octaves", description="level in octave bands")
    lowest_hz: float = Field(125.0, gt=0, description="centre of the lowest band in Hz")
    bands: int = Field(7, ge=1, description="number of bands")

    def least_samples(self, sample_rate_hz: float) -> int:
        """Return the samples of ten periods of the lowest band."""
        return round(10 * sample_rate_hz / self.lowest_hz)


def octave_levels(sound, settings):
    """Return levels in dB (channel, octave) of `sound.samples` (channels, n)."""
    centre_hz = settings.lowest_hz * 2.0 ** np.arange(settings.bands)
    power = np.square(np.abs(np.fft.rfft(sound.samples)))
    frequency = np.fft.rfftfreq(sound.samples.shape[1], 1 / sound.sample_rate_hz)
    band = np.floor(np.log2(np.maximum(frequency, 1e-9) / centre_hz[0]) + 0.5)
    energy = np.stack([power[:, band == number].sum(axis=1) for number in range(settings.bands)], 1)
    level = 10 * np.log10(np.maximum(energy, 1e-12 * energy.max()))
    octave = xr.Variable("octave", centre_hz, {"units": "Hz", "long_name": "centre of the octave"})
    return xr.DataArray(level, dims=("channel", "octave"), coords={"octave": octave})
