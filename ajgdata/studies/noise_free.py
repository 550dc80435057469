"""Noise-free recordings of scenes, their features and errors, and the time of a simulation."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ajgdata.features.spectrum import spectrum
from ajgdata.gripper import SAMPLE_RATE_HZ, SignalChain, excitation_sweep, record
from ajgdata.gripper.signal_chain import ImpulseResponse
from ajgdata.types import FeatureSettings

Real = NDArray[np.floating]
Returned = TypeVar("Returned")
NOISE_FREE_CHAIN = SignalChain(noise_db_spl=None)


def noise_free(response: ImpulseResponse) -> Real:
    """Return the samples (n,) of a recording without noise."""
    return record(response, excitation_sweep(), NOISE_FREE_CHAIN).samples


def unit_feature(samples: Real) -> Real:
    """Return the feature (1025,) of samples, with unit norm."""
    feature = spectrum(samples, SAMPLE_RATE_HZ, FeatureSettings()).astype(np.float64)
    return feature / np.linalg.norm(feature)


def relative_error(values: NDArray[Any], reference: NDArray[Any]) -> float:
    """Return the relative L2 difference of two arrays of one shape."""
    return float(np.linalg.norm(values - reference) / np.linalg.norm(reference))


def timed(calculate: Callable[[], Returned], repeats: int) -> tuple[Returned, float]:
    """Call `calculate` `repeats` times; return the last result and the shortest CPU time (s)."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        result = calculate()
        times.append(time.process_time() - start)
    return result, min(times)
