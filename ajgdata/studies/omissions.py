"""Parts that a plan leaves out: their estimate, the error really made, and the time saved.

The error is the largest relative change (L2) of the amplitude in any third octave from 63 Hz up, or
of the feature, which is made of more of them and hides what a narrow band loses.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ajgdata.features.spectrum import spectrum
from ajgdata.gripper import (
    SAMPLE_RATE_HZ,
    Scene,
    SignalChain,
    build_plan,
    excitation_sweep,
    record,
    simulate,
)
from ajgdata.gripper.effect_estimates import BANDS_HZ, EDGES
from ajgdata.gripper.scene_model import PartName
from ajgdata.gripper.solver_plan import Plan
from ajgdata.studies import TIMED
from ajgdata.types import FeatureSettings
from ajgdata.types.table import Column, Table, Value

Real = NDArray[np.floating]
#: Objects of the library, and what they rest on.
SAMPLE = (
    ("cube_10p0", "rigid"),
    ("cube_20p7", "rigid"),
    ("sphere80_metal", "rigid"),
    ("sphere80_metal", "concave"),
    ("sphere80_wood", "concave"),
    ("sphere80_styrofoam", "concave"),
    ("sphere30_plastic", "concave"),
    ("foam_brick", "rigid"),
    ("plate_metal", "concave"),
    ("plate_wood", "concave"),
    ("plate_wood", "rubber"),
    ("plate_styrofoam", "concave"),
    ("bar", "rigid"),
    ("tennis_ball", "rigid"),
)
QUICK = (("cube_20p7", "rigid"), ("sphere80_wood", "concave"), ("plate_wood", "rubber"))
MECHANICS: tuple[PartName, ...] = ("motion", "elastic", "compliance", "film", "frame")
ALL: tuple[PartName, ...] = ("membrane", *MECHANICS)
#: Leaves out all that is not kept by name: no two features differ by more.
NOTHING = 2.0
DX_MM = 4.0
#: Longer than any scene of the default marches; the slowest bounce rings for 50 ms.
TIME_S = 0.1
TOTAL = "all that is left out"


@dataclass(frozen=True)
class OmissionCase:
    """An object of the library on a support."""

    thing: str
    support: str
    dx_mm: float = DX_MM

    def plan(self, keep: tuple[PartName, ...] = (), tolerance: float = NOTHING) -> Plan:
        """The plan that solves `keep` and what is worth more than `tolerance`."""
        # All for the same time: stopping a little earlier or later would be heard as a change.
        grid = {"dx_mm": self.dx_mm, "decay_db": 160.0, "max_time_s": TIME_S}
        numerics = {**grid, "keep": keep, "tolerance": tolerance}
        given = {"object": self.thing, "support": {"kind": self.support}, "numerics": numerics}
        return build_plan(Scene.model_validate(given))


@dataclass(frozen=True)
class Heard:
    """A recording without noise: feature of unit norm, amplitudes at each Hz in third octaves, and
    the process time of the response in seconds."""

    feature: Real
    bands: tuple[Real, ...]
    seconds: float

    def change(self, other: Heard) -> tuple[float, float, float]:
        """Change to `other`: of the feature, the largest of a band, and its centre in Hz."""
        feature = float(np.linalg.norm(self.feature - other.feature))
        pairs = zip(self.bands, other.bands, strict=True)
        changes = [float(np.linalg.norm(a - b) / np.linalg.norm(a)) for a, b in pairs]
        worst = int(np.argmax(changes))
        return feature, changes[worst], float(BANDS_HZ[worst])


def heard(plan: Plan) -> Heard:
    """Record the plan's response without noise."""
    begin = time.process_time()
    response = simulate(plan)
    seconds = time.process_time() - begin
    take = record(response, excitation_sweep(), SignalChain(noise_db_spl=None), seed=0)
    feature = spectrum(take.samples, SAMPLE_RATE_HZ, FeatureSettings()).astype(np.float64)
    amplitude = np.abs(np.fft.rfft(take.samples))
    frequency = np.fft.rfftfreq(len(take.samples), 1 / SAMPLE_RATE_HZ)
    limits = np.searchsorted(frequency, np.multiply.outer(BANDS_HZ, EDGES))
    bands = tuple(amplitude[low:high] for low, high in limits)
    return Heard(feature / np.linalg.norm(feature), bands, seconds)


def without(part: PartName) -> tuple[tuple[PartName, ...], tuple[PartName, ...]]:
    """Return the parts kept with and without `part`. The frame carries the object's modes with it,
    so that they are judged where there is no frame."""
    kept = tuple(p for p in ALL if p != "frame") if part in ("motion", "elastic") else ALL
    return kept, tuple(p for p in kept if p != part)


def omission_rows(case: OmissionCase) -> list[dict[str, Value]]:
    """One row a part, and a last one for all that the default plan leaves out."""
    default = case.plan(tolerance=0.01)
    known: dict[tuple[PartName, ...], Heard] = {}

    def solved(keep: tuple[PartName, ...]) -> Heard:
        if keep not in known:
            known[keep] = heard(case.plan(keep))
        return known[keep]

    estimates = {part.name: part for part in default.parts}
    on = {"rigid": "the ground", "rubber": "a sheet of rubber", "concave": "concave rubber"}
    named: dict[str, Value] = {"scene": f"{case.thing} on {on[case.support]}", "tolerance": 0.01}
    rows: list[dict[str, Value]] = []
    for part in ALL:
        full, less = (solved(keep) for keep in without(part))
        estimate = estimates[part]
        rows.append(
            named
            | {"part": part, "estimate": estimate.effect, "kept": estimate.kept}
            | _compared(full, less)
        )
    chosen = _compared(solved(ALL), heard(default))
    return [*rows, named | {"part": TOTAL, "estimate": None, "kept": None} | chosen]


def _compared(full: Heard, less: Heard) -> dict[str, Value]:
    feature, band, centre = full.change(less)
    return {
        "measured": max(feature, band),
        "feature": feature,
        "band_hz": round(centre),
        "time_ratio": less.seconds / full.seconds,
    }


def tables(quick: bool = False) -> tuple[Table, ...]:
    """Omissions over the sample of scenes."""
    # Compiled kernels, before anything is timed.
    simulate(OmissionCase("cube_20p7", "rigid", 6.0).plan(ALL))
    rows = [
        row for case in (QUICK if quick else SAMPLE) for row in omission_rows(OmissionCase(*case))
    ]
    return (
        Table(
            "omissions",
            "What leaving a part out does to the sound, simulated",
            "The estimate is made before anything is solved, the change is measured: the largest"
            " relative change (L2) of the amplitude in any third octave from 63 Hz to 12.5 kHz, or"
            f" of the feature, of a noise-free sweep, {DX_MM:g} mm grid. Parts are left out where"
            " the estimate is below the tolerance; the frame takes the object's modes with it."
            f" Time: without the part over with it. {TIMED}",
            (
                Column("scene", "Scene"),
                Column("part", "Part"),
                Column("estimate", "Estimate"),
                Column("measured", "Measured change, largest of all bands"),
                Column("band_hz", "In the third octave at", "Hz"),
                Column("feature", "Measured change of the feature"),
                Column("kept", "Kept"),
                Column("tolerance", "Tolerance"),
                Column("time_ratio", "Time without / with"),
            ),
            tuple(rows),
        ),
    )
