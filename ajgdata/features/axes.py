"""What spectra of two stores must share: a model of the one is else at a loss with the other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

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
