"""One recording -> its feature, whatever its kind; settings that features must share."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from numpy.typing import NDArray

from ajgdata.features.spectrum import Float32, spectrum
from ajgdata.types import FeatureSettings, NotPossibleError

#: Of a spectrum; the rest of the feature settings moves no bin and scales none.
SPECTRUM = ("kind", "window", "hop", "window_shape", "quantity", "normalisation", "band_hz")
#: Of a transfer function, which has neither hop nor window shape.
RESPONSE = ("kind", "window", "quantity", "normalisation", "band_hz")
RATE = "audio.sample_rate_hz"


def differing_axes(
    one: Mapping[str, Mapping[str, Any]], other: Mapping[str, Mapping[str, Any]]
) -> list[tuple[str, Any, Any]]:
    """Return the settings in which the features of two stores differ, with both values.

    Each of the two is what a store says of itself: `audio` and `features` as JSON has them. The
    frequencies of the bins follow from sample rate, window and band.
    """
    kinds = {one.get("features", {}).get("kind"), other.get("features", {}).get("kind")}
    keys = RESPONSE if kinds == {"transfer_function"} else SPECTRUM
    pairs = [(RATE, "audio", "sample_rate_hz")] + [(f"features.{k}", "features", k) for k in keys]
    values = [(name, one.get(p, {}).get(k), other.get(p, {}).get(k)) for name, p, k in pairs]
    return [(name, a, b) for name, a, b in values if a != b]


def feature_maker(
    settings: FeatureSettings, sample_rate_hz: float, excitation: NDArray[Any] | None
) -> Callable[[NDArray[Any]], Float32]:
    """Return what makes the feature (n_bins,) of a recording (n,), of the kind of the settings.

    Raises NotPossibleError where what was played, (m,), is needed and unknown or silent.
    """
    if settings.kind == "stft":
        return partial(spectrum, sample_rate_hz=sample_rate_hz, settings=settings)
    from ajgdata.features.transfer_function import Deconvolution  # scipy: not while planning

    if excitation is None:
        raise NotPossibleError(f"features.kind {settings.kind} needs the played sound")
    solver = Deconvolution(excitation, settings.window)
    return partial(solver.feature, sample_rate_hz=sample_rate_hz, settings=settings)
