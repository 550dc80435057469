"""How fast the gripper falls silent: its decay time by octave, for a laboratory to compare."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfilt

from ajgdata.gripper import SAMPLE_RATE_HZ, Scene, simulate
from ajgdata.gripper.parameters import PARAMETERS, default_of
from ajgdata.types.table import Column, Table, Value

Real = NDArray[np.floating]
WALLS = "gripper.wall_admittance"
OCTAVES_HZ = (250, 500, 1_000, 2_000, 4_000, 8_000)
QUICK_HZ = (1_000, 4_000)
#: Levels (dB) between which the decay is fitted, as T20 of ISO 3382-2.
FITTED_DB = (-5.0, -25.0)
#: A filter of bandwidth B, run backwards, adds nothing to decay times above 4 / B (Jacobsen &
#: Rindel 1987, Journal of Sound and Vibration 117).
LEAST_CYCLES = 4.0


def decay_time(response: Real, octave_hz: float, rate_hz: int = SAMPLE_RATE_HZ) -> float | None:
    """Return the time (s) in which the level of `response` (n,) falls by 60 dB in one octave.

    Backward integration (Schroeder 1965) of the response filtered backwards, a line through what
    lies between -5 and -25 dB, times three. None where the filter's own decay would be measured.
    """
    edges = octave_hz / np.sqrt(2), octave_hz * np.sqrt(2)
    sections = butter(4, edges, "bandpass", fs=rate_hz, output="sos")
    padded = np.concatenate([np.zeros(round(10 * rate_hz / octave_hz)), response])
    energy = np.cumsum(sosfilt(sections, padded[::-1]) ** 2)[::-1]
    level = 10 * np.log10(np.maximum(energy / energy[0], 1e-30))
    fitted = np.flatnonzero((level <= FITTED_DB[0]) & (level >= FITTED_DB[1]))
    slope = np.polyfit(fitted / rate_hz, level[fitted], 1)[0]
    found = float(-60 / slope)
    return found if found > LEAST_CYCLES / (edges[1] - edges[0]) else None


def decays(quick: bool = False) -> Table:
    """Return the decay time of each octave, empty and filled, over the range of the losses."""
    row = next(one for one in PARAMETERS if one.setting == WALLS)
    walls = {"least": row.low, "default": float(default_of(WALLS)), "most": row.high}
    octaves = QUICK_HZ if quick else OCTAVES_HZ
    rows: list[dict[str, Value]] = []
    for medium in ("air", "plastic"):
        for name, admittance in walls.items():
            heard = simulate(_scene(medium, admittance, quick)).samples
            times = {f"hz_{hz}": decay_time(heard, hz) for hz in octaves}
            rows.append({"medium": medium, "losses": name, "admittance": admittance, **times})
    return Table(
        "decay",
        "How fast the gripper falls silent",
        "Time in which the level at the microphone falls by 60 dB, by octave, of the gripper that"
        " hangs free, empty or filled, with the least, the default and the most losses at its"
        " walls. Where a laboratory's gripper lies says which losses are its own. Empty: shorter"
        " than the octave's filter can tell. Coarse grids add no losses of their own.",
        (
            Column("medium", "Filled with"),
            Column("losses", "Losses"),
            Column("admittance", "rho c / z"),
            *(Column(f"hz_{hz}", f"{hz:,} Hz", "s") for hz in octaves),
        ),
        tuple(rows),
    )


def _scene(medium: str, admittance: float, quick: bool) -> Scene:
    # Half of what decays by 60 dB is what a line needs; grains leave little to wait for.
    numerics: dict[str, Any] = {"decay_db": 80.0, "max_time_s": 0.2 if quick else 0.8}
    if quick:
        numerics["dx_mm"] = 6.0
    gripper = {"wall_admittance": admittance}
    given = {"object": None, "medium": {"kind": medium}, "gripper": gripper, "numerics": numerics}
    return Scene.model_validate(given)
