"""Names and parameters of the draws: a Latin hypercube over the ranges of what is not known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from ajgdata.gripper import derive_seed
from ajgdata.gripper.parameters import PARAMETERS, Parameter

#: Of all draws; fixed before any was made.
SEED = 2603
#: What is not drawn: the protocol, which the rows set themselves; parts that the default gripper
#: does not have, and which their numbers would add; a servo, which no row listens to; and what only
#: the old model of the speaker has.
NOT_DRAWN = (
    "grasp.angle_deg",
    "grasp.offset_",
    "signal.external_noise_dba",
    "gripper.bodies.",
    "signal.motor.",
    "signal.peaks_",
    "signal.rolloff_hz",
)


def drawn_parameters(parameters: Sequence[Parameter] = PARAMETERS) -> tuple[Parameter, ...]:
    """Return the parameters that differ between draws: those of a range, but NOT_DRAWN."""
    return tuple(
        one for one in parameters if one.low < one.high and not one.setting.startswith(NOT_DRAWN)
    )


def stratified(count: int, setting: str, seed: int = SEED) -> NDArray[np.float64]:
    """Return one number in [0, 1) for each of `count` draws, (count,): one in each `count`-th.

    Columns of different settings are independent permutations, which together are a Latin
    hypercube (McKay, Beckman & Conover 1979, Technometrics 21, 239). Each has a seed of its own
    name, so that a setting more changes no other.
    """
    sampler = qmc.LatinHypercube(1, rng=derive_seed("draws", seed, setting))
    return np.asarray(sampler.random(count)[:, 0], np.float64)


def hypercube(count: int, parameters: Sequence[Parameter], seed: int = SEED) -> NDArray[np.float64]:
    """Return the places of all draws in their ranges, (count, parameters) in [0, 1)."""
    columns = [stratified(count, one.setting, seed) for one in parameters]
    return np.column_stack(columns) if columns else np.empty((count, 0))


def value_at(parameter: Parameter, place: float) -> float:
    """Return the value at a place in [0, 1] of the parameter's range, on its scale; six digits.

    >>> value_at(Parameter("a", "fixed", 1.0, 100.0, "log", "estimate", "none"), 0.5)
    10.0
    """
    low, high = parameter.low, parameter.high
    share = (high / low) ** place if parameter.scale == "log" else None
    value = low + (high - low) * place if share is None else low * share
    return float(f"{value:.6g}")


def place_of(parameter: Parameter, value: float) -> float:
    """Return where in its range, 0 to 1 on its scale, a value lies: the inverse of `value_at`."""
    if parameter.scale == "log":
        return float(np.log(value / parameter.low) / np.log(parameter.high / parameter.low))
    return (value - parameter.low) / (parameter.high - parameter.low)


def values_of(number: int, count: int, seed: int = SEED) -> dict[str, float]:
    """Return the parameters of the draw `number` of `count`, by setting."""
    parameters = drawn_parameters()
    places = hypercube(count, parameters, seed)[number]
    return {
        one.setting: value_at(one, float(place))
        for one, place in zip(parameters, places, strict=True)
    }
