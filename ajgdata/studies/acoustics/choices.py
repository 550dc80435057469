"""What each choice of losses, transducers and noise does to the feature, and what it costs."""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.features.spectrum import frequencies_hz, spectrum
from ajgdata.gripper import SAMPLE_RATE_HZ, Scene, SignalChain, excitation_sweep, record, simulate
from ajgdata.gripper.parameters import PARAMETERS
from ajgdata.gripper.scene import Numerics
from ajgdata.studies import TIMED
from ajgdata.types import FeatureSettings
from ajgdata.types.table import Column, Table, Value

Real = NDArray[np.floating]
#: Below it the default grid is to be trusted.
TRUSTED_HZ = 6_000
QUIET: dict[str, Any] = {"noise_db_spl": None}
LOUD: dict[str, Any] = {"noise_db_spl": None, "external_noise_dba": 80.0}
#: What is held, in which medium.
HELD = (("cube_20p7", "plastic"), ("sphere80_wood", "plastic"), (None, "air"))
#: The same times for all: stopping earlier or later would be heard as a change.
NUMERICS = {"decay_db": 160.0, "max_time_s": 0.1}


class Choice(NamedTuple):
    """What is changed: settings of the gripper and of the signal chain, from those `beside`."""

    name: str
    gripper: dict[str, Any]
    signal: dict[str, Any]
    beside: dict[str, Any] = QUIET
    gripper_beside: dict[str, Any] | None = None


def all_choices() -> list[Choice]:
    """Return the choices; ranges are those of the table of parameters."""
    ranges = {one.setting: (one.low, one.high) for one in PARAMETERS}
    least, most = ranges["gripper.wall_admittance"]
    made = [
        Choice("losses at the walls: least", {"wall_admittance": least}, QUIET),
        Choice("losses at the walls: most", {"wall_admittance": most}, QUIET),
        Choice("speaker of flat volume velocity", {}, {**QUIET, "driver": "velocity"}),
    ]
    first, second = ranges["signal.resonances_hz.0"], ranges["signal.resonances_hz.1"]
    for end, name in enumerate(("lowest", "highest")):
        resonances = {**QUIET, "resonances_hz": (first[end], second[end])}
        made.append(Choice(f"resonances of the speaker: {name}", {}, resonances))
    low, high = ranges["signal.resonances_q.0"]
    for q, name in ((low, "most"), (high, "least")):
        made.append(
            Choice(f"damping of the speaker: {name}", {}, {**QUIET, "resonances_q": (q, q)})
        )
    limp = {**LOUD, "outside": "mass_law"}
    made.append(Choice("80 dB(A) outside: mass law instead of the membrane", {}, limp, LOUD))
    made.append(Choice("self-noise of the microphone: none", {}, QUIET, {}))
    cases: dict[str, Any] = {"bodies": {}}
    upright: dict[str, Any] = {"bodies": {"tilt_deg": 0.0}}
    made.append(Choice("cases of the transducers", upright, QUIET))
    made.append(Choice("tilt of their faces, 25°", cases, QUIET, QUIET, upright))
    return made


def _heard(held: str | None, medium: str, gripper: dict[str, Any], grid: dict[str, Any]) -> Any:
    given = {"object": held, "medium": {"kind": medium}, "gripper": gripper}
    scene = Scene.model_validate({**given, "numerics": {**NUMERICS, **grid}})
    begin = time.process_time()
    response = simulate(scene)
    return response, time.process_time() - begin


def _feature(response: Any, signal: dict[str, Any]) -> Real:
    take = record(response, excitation_sweep(), SignalChain.model_validate(signal), seed=0)
    return spectrum(take.samples, SAMPLE_RATE_HZ, FeatureSettings()).astype(np.float64)


def choices(quick: bool = False) -> Table:
    """Return the change of the feature by each choice, in the whole band and below 6 kHz."""
    low = frequencies_hz(SAMPLE_RATE_HZ, FeatureSettings()) < TRUSTED_HZ
    grid = {"dx_mm": 6.0} if quick else {}
    rows: list[dict[str, Value]] = []
    for held, medium in HELD[:1] if quick else HELD:
        _heard(held, medium, {}, {**grid, "max_time_s": 0.001})  # compiles the kernels
        default = _heard(held, medium, {}, grid)
        for choice in all_choices():
            (beside, seconds), (response, taken) = (
                _heard(held, medium, gripper, grid) if gripper else default
                for gripper in (choice.gripper_beside or {}, choice.gripper)
            )
            before = _feature(beside, choice.beside)
            after = _feature(response, choice.signal)
            rows.append(
                {
                    "choice": choice.name,
                    "scene": f"{held or 'nothing'}, {medium}",
                    "change": _distance(before, after),
                    "change_low": _distance(before[low], after[low]),
                    "tolerance": Numerics().tolerance,
                    "time_ratio": taken / seconds,
                }
            )
    return Table(
        "choices",
        "What each choice does to the feature",
        "Each choice against the default: relative L2 of the feature, scaled to unit norm, of a"
        " sweep without noise, or with the noise that is named; in the whole band and below"
        f" {TRUSTED_HZ / 1000:g} kHz. What changes it by less than the tolerance need not be known."
        f" Time: with the choice over without. {TIMED}",
        (
            Column("choice", "Choice"),
            Column("scene", "Scene"),
            Column("change", "Change"),
            Column("change_low", "Below 6 kHz"),
            Column("tolerance", "Tolerance"),
            Column("time_ratio", "Time with / without"),
        ),
        tuple(rows),
    )


def _distance(before: Real, after: Real) -> float:
    one, two = (feature / np.linalg.norm(feature) for feature in (before, after))
    return float(np.linalg.norm(two - one))
