"""One recording -> its feature, whatever the kind: the only way in which features are made."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from numpy.typing import NDArray

from ajgdata.features.spectrum import Float32, spectrum
from ajgdata.features.transfer_function import Deconvolution
from ajgdata.types import FeatureSettings, NotPossibleError


def feature_maker(
    settings: FeatureSettings, sample_rate_hz: float, excitation: NDArray[Any] | None
) -> Callable[[NDArray[Any]], Float32]:
    """Return what makes the feature (n_bins,) of a recording (n,), of the kind of the settings.

    Raises NotPossibleError where what was played, (m,), is needed and unknown or silent.
    """
    if settings.kind == "stft":
        return partial(spectrum, sample_rate_hz=sample_rate_hz, settings=settings)
    if excitation is None:
        raise NotPossibleError(f"features.kind {settings.kind} needs the played sound")
    solver = Deconvolution(excitation, settings.window)
    return partial(solver.feature, sample_rate_hz=sample_rate_hz, settings=settings)
