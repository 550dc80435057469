"""Changed copies of a recording: shift, added noise and gain.

A copy of the samples x is

    y[i] = 10**(gain_db / 20) (x[i - shift] + a n[i]),

with zeros where x has no sample. The noise n has the level a, so that the ratio of the mean powers
of the shifted recording and of a n is `snr_db`, or so that the RMS of a n is `level_dbfs`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ajgdata.types.augment import AddedNoise, Augment

Real = NDArray[np.float64]
#: Function that returns noise of a shape (..., n), drawn with a generator.
Noise = Callable[[np.random.Generator, tuple[int, ...]], Real]


def changed_copy(
    samples: NDArray[np.floating],
    sample_rate_hz: float,
    settings: Augment,
    generator: np.random.Generator,
    noise: Noise | None = None,
) -> Real:
    """Return a changed copy (..., n) of the samples (..., n) of one recording.

    All channels have the same shift, noise level and gain. `noise` replaces the noise of the
    settings if their source is a data set.

    >>> import numpy as np
    >>> from ajgdata.features.augment import changed_copy
    >>> from ajgdata.types.augment import Augment
    >>> settings = Augment(shift_ms=(1, 1), gain_db=(20, 20))
    >>> changed_copy(np.array([0.1, 0.2, 0.3]), 1000, settings, np.random.default_rng(0))
    array([0., 1., 2.])
    """
    copy = np.asarray(samples, np.float64)
    if settings.shift_ms is not None:
        shift_s = generator.uniform(*settings.shift_ms) / 1000
        copy = shifted(copy, round(shift_s * sample_rate_hz))
    if settings.noise is not None:
        added = noise or computed_noise(settings.noise.source)
        copy = copy + scaled_noise(added(generator, copy.shape), copy, settings.noise, generator)
    if settings.gain_db is not None:
        copy = copy * 10 ** (generator.uniform(*settings.gain_db) / 20)
    return copy


def shifted(samples: Real, count: int) -> Real:
    """Return samples (..., n) that begin `count` samples later, or earlier if it is negative.

    Samples that leave the recording are lost, and zeros replace the missing samples.
    """
    length = samples.shape[-1]
    result = np.zeros_like(samples)
    kept = max(length - abs(count), 0)
    if count >= 0:
        result[..., length - kept :] = samples[..., :kept]
    else:
        result[..., :kept] = samples[..., length - kept :]
    return result


def computed_noise(source: str) -> Noise:
    """Return the function for `white` or `pink` noise."""
    return {"white": white_noise, "pink": pink_noise}[source]


def white_noise(generator: np.random.Generator, shape: tuple[int, ...]) -> Real:
    """Return Gaussian noise of a shape, with the same power at all frequencies."""
    return generator.standard_normal(shape)


def pink_noise(generator: np.random.Generator, shape: tuple[int, ...]) -> Real:
    """Return Gaussian noise of a shape (..., n), whose power is proportional to 1 / frequency.

    It has no offset.
    """
    transform = np.fft.rfft(white_noise(generator, shape))
    number = np.arange(transform.shape[-1])
    transform[..., 0] = 0
    transform[..., 1:] /= np.sqrt(number[1:])
    return np.fft.irfft(transform, shape[-1])


def scaled_noise(
    noise: Real, samples: Real, settings: AddedNoise, generator: np.random.Generator
) -> Real:
    """Return noise (..., n) with a level from the range of the settings, for `samples` (..., n).

    A silent recording has no noise at any signal-to-noise ratio.
    """
    if settings.snr_db is not None:
        level = mean_power(samples) * 10 ** (-generator.uniform(*settings.snr_db) / 10)
    else:
        assert settings.level_dbfs is not None, "the other way to state the level"
        level = 10 ** (generator.uniform(*settings.level_dbfs) / 10)
    return noise * np.sqrt(level / mean_power(noise))


def mean_power(samples: Real) -> float:
    """Return the mean square of samples (..., n)."""
    return float(np.mean(np.square(samples)))
