"""Deconvolution: what was played + what was heard -> impulse response and transfer function.

With x the excitation, y the recording (n samples each, begun together) and h the response, which
shall have ended after M samples, the model is y = X h + noise, X the n × M convolution matrix of x.
Estimated is the regularised least-squares solution

    h = (XᵀX + λ I)⁻¹ Xᵀy,     λ = 10⁻⁴ Σ x²

It uses the recording as it was cut: XᵀX is the covariance of those samples, not the Toeplitz matrix
of an endless recording, so that the end of the sound, which was not heard to die away, makes no
error; and a line spectrum needs no more than M lines. (Division of spectra, y/x bin by bin, has
both faults.) Xᵀ X has the eigenvalues |X(f)|², the energy density of the excitation at a frequency:
on average Σ x², so that λ lies 40 dB below the mean, and shrinks the response at f by the share
λ/(|X(f)|² + λ): by 10⁻⁴ where the density is the mean's, to nothing outside the band. White noise
of variance σ² then adds σ²/|X(f)|² to |H(f)|² for each of the M values: the noise of the estimate
is that of the recording over the energy played, whatever the excitation (A. Tikhonov 1963; S.
Müller and P. Massarani, "Transfer-function measurement with sweeps", J. Audio Eng. Soc. 49, 2001).

M is the window of the settings; an eighth of it lies before time 0, so that a latency wrong by that
much, or an alignment to the strongest arrival, takes nothing away.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from ajgdata.features.spectrum import Float32, in_band, normalised
from ajgdata.types import FeatureSettings, NotPossibleError

Real = NDArray[np.float64]
#: λ over the excitation's mean energy density: -40 dB.
REGULARISATION = 1e-4


class Deconvolution:
    """Solver for recordings of one excitation (m,): factorised once, about 0.3 s for 2048 taps.

    Recordings shall have `length` samples (default: as many as the excitation); to one that is
    shorter or longer, `impulse_response` makes another solver. Raises ValueError for an excitation
    that is silent, not finite or not (m,).

    >>> import numpy as np
    >>> from ajgdata.features.transfer_function import Deconvolution
    >>> played = np.sign(np.random.default_rng(0).standard_normal(4000))
    >>> heard = 0.5 * np.concatenate([np.zeros(3), played[:-3]])  # half as loud, 3 samples late
    >>> response = Deconvolution(played, taps=64).impulse_response(heard)
    >>> int(response.argmax()) - 64 // 8, round(float(response.max()), 3)
    (3, 0.5)
    """

    def __init__(self, excitation: NDArray[Any], taps: int, *, length: int | None = None) -> None:
        played = np.asarray(excitation, np.float64)
        if played.ndim != 1 or not played.any() or not np.isfinite(played).all():
            raise NotPossibleError(
                "deconvolution needs an excitation (m,) that is finite and not silent"
            )
        self.taps, self.lead = taps, taps // 8
        self.length = len(played) if length is None else length
        self._excitation = played
        # The response is estimated from `lead` samples before time 0: the recording is late by it,
        # and what came before it is not known.
        rows = self.length + self.lead
        self._played = np.zeros(rows)
        kept = min(len(played), rows)
        self._played[:kept] = played[:kept]
        covariance = _covariance(self._played, taps, self.lead)
        level = REGULARISATION * float(np.sum(np.square(played)))
        covariance[np.diag_indices(taps)] += level
        self._factor = cho_factor(covariance, lower=True, overwrite_a=True, check_finite=False)

    def impulse_response(self, recording: NDArray[Any]) -> Real:
        """Return the response (taps,) of a recording (n,); time 0 is at index taps // 8.

        Raises ValueError for a recording that is not (n,) or not finite.
        """
        from scipy.signal import fftconvolve  # half a second

        heard = np.asarray(recording, np.float64)
        if heard.ndim != 1 or not np.isfinite(heard).all():
            raise ValueError(f"need finite samples of shape (n,), got {heard.shape}")
        if len(heard) != self.length:
            other = Deconvolution(self._excitation, self.taps, length=len(heard))
            return other.impulse_response(heard)
        late = np.concatenate([np.zeros(self.lead), heard])
        correlation = fftconvolve(late, self._played[::-1])[len(late) - 1 :][: self.taps]
        right = np.zeros(self.taps)
        right[: len(correlation)] = correlation
        return np.asarray(cho_solve(self._factor, right, check_finite=False))

    def transfer_function(self, recording: NDArray[Any]) -> NDArray[np.complex128]:
        """Return H (taps/2 + 1,), full scale heard per full scale played, phase as of time 0."""
        response = np.roll(self.impulse_response(recording), -self.lead)
        return np.asarray(scipy.fft.rfft(response))

    def feature(
        self, recording: NDArray[Any], sample_rate_hz: float, settings: FeatureSettings
    ) -> Float32:
        """Return |H| or |H|² (n_bins,), within the band and normalised as a spectrum is."""
        size = np.abs(self.transfer_function(recording))
        power = size**2 if settings.quantity == "power" else size
        return normalised(in_band(power, sample_rate_hz, settings), settings.normalisation)


def _covariance(played: Real, taps: int, first: int) -> Real:
    """Return XᵀX (taps, taps) of samples (n,): Σ_t x[t - i] x[t - j] over t from `first` to n.

    Each element below the first row is the one up and left of it, with the product that comes in
    and without the one that leaves: R[i+1, j+1] = R[i, j] + x[f-1-i] x[f-1-j] - x[n-1-i] x[n-1-j].
    """
    from scipy.signal import fftconvolve

    before = np.concatenate([np.zeros(taps), played])
    entering = before[first : first + taps][::-1]  # x[f - 1], x[f - 2], ...
    leaving = before[len(played) : len(played) + taps][::-1]
    counted = np.concatenate([np.zeros(first), played[first:]])
    whole = fftconvolve(counted, played[::-1])[len(played) - 1 :][:taps]
    covariance = np.zeros((taps, taps))
    covariance[0, : len(whole)] = whole
    for row in range(taps - 1):
        change = entering[row] * entering[row:-1] - leaving[row] * leaving[row:-1]
        covariance[row + 1, row + 1 :] = covariance[row, row:-1] + change
    return covariance + np.triu(covariance, 1).T
