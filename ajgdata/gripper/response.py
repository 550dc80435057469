"""What a scene does to sound: plain data, without the solver that makes it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.floating]


@dataclass(frozen=True)
class ImpulseResponse:
    """Pressure (Pa) at the microphone per volume velocity (m³/s) at the speaker.

    p[n] = Σ samples[m] q[n - m + latency_samples]; the latency is that of the linear-phase
    decimation filter. `static` is what the response settles at, for ever on this time scale,
    because the balloon holds the volume that the speaker pushed in; `samples` goes on to zero
    without it. Convolve the input with `samples`, then add `static` times its running sum.
    `provenance` says how it was computed; it is as deterministic as `samples`. `membrane_kg_m2` is
    what holds sound from outside back.
    """

    samples: Real
    static: float
    sample_rate_hz: int
    latency_samples: int
    provenance: dict[str, Any]
    membrane_kg_m2: float
