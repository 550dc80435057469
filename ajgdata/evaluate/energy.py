"""Energy of the sound that comes back, against that of a reference, e.g. of the empty gripper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ajgdata.evaluate.agreement import UNDEFINED, Interval
from ajgdata.evaluate.intervals import MIN_GRASPS, resampled_counts, spread_interval
from ajgdata.types import NotPossibleError


@dataclass(frozen=True)
class RelativeEnergy:
    """Energy of one class of recordings, 1 being that of the reference on the same object.

    `mean` and `sd` (ddof = 1, NaN for one group) are over groups, each counting once; `by_object`
    is the mean of each object's groups.
    """

    label: str
    groups: int
    mean: float
    sd: float
    interval: Interval  #: over groups
    by_object: dict[str, float]


def band_energy(
    power: np.ndarray, frequency_hz: np.ndarray, band_hz: tuple[float, float]
) -> np.ndarray:
    """Return the energy (n,) of power spectra (n, f), summed over low <= frequency <= high.

    Raises ValueError for a band without a frequency.
    """
    low, high = band_hz
    inside = (frequency_hz >= low) & (frequency_hz <= high)
    if not inside.any():
        raise NotPossibleError(f"no frequency lies within {low:g} to {high:g} Hz")
    return np.asarray(power, np.float64)[:, inside].sum(axis=1)


def relative_energies(
    energy: np.ndarray, label: np.ndarray, group: np.ndarray, matched: np.ndarray, reference: str
) -> list[RelativeEnergy]:
    """Return energies of every label against those labelled `reference`, the reference first.

    `energy`, `label`, `group`, `matched` (n,): recordings of one group (a grasp) are averaged, then
    divided by the mean over the groups of the reference with the same `matched` (the object), so
    that what objects differ by does not count as spread. Raises ValueError where there is no such
    group.
    """
    firsts = np.unique(group, return_index=True)[1]
    means = np.array([energy[group == group[first]].mean() for first in firsts])
    of_label, of_object = label[firsts].astype(str), matched[firsts].astype(str)
    ratio = np.empty(len(firsts))
    for name in np.unique(of_object).tolist():
        here = of_object == name
        base = means[here & (of_label == reference)]
        if not base.size or base.mean() <= 0:
            raise NotPossibleError(f"no energy of {reference!r} to compare with on {name!r}")
        ratio[here] = means[here] / base.mean()
    compared = [name for name in np.unique(of_label).tolist() if name != reference]
    intervals = _intervals(means, of_label, of_object, [reference, *compared])
    energies = []
    for name, interval in zip([reference, *compared], intervals, strict=True):
        chosen = of_label == name
        values, objects = ratio[chosen], np.unique(of_object[chosen]).tolist()
        sd = float(values.std(ddof=1)) if len(values) > 1 else float("nan")
        each = {item: float(ratio[chosen & (of_object == item)].mean()) for item in objects}
        mean = float(values.mean())
        energies.append(RelativeEnergy(name, len(values), mean, sd, interval, each))
    return energies


def _intervals(
    means: np.ndarray, of_label: np.ndarray, of_object: np.ndarray, labels: Sequence[str]
) -> list[Interval]:
    """Return the interval over groups of each label's energy. The first label is the reference,
    whose groups are also resampled. A resample without a reference of some object has no value; an
    interval of which fewer than half of the resamples have one is undefined."""
    resampled: list[np.ndarray] = []
    for drawn in resampled_counts(len(means)):
        ratio = np.empty_like(drawn)
        with np.errstate(invalid="ignore", divide="ignore"):
            for name in np.unique(of_object):
                base = drawn[:, (of_object == name) & (of_label == labels[0])]
                own = means[(of_object == name) & (of_label == labels[0])]
                here = of_object == name
                ratio[:, here] = means[here] * (base.sum(axis=1) / (base @ own))[:, None]
            chosen = [of_label == label for label in labels]
            resampled.append(np.array([
                (drawn[:, c] * ratio[:, c]).sum(axis=1) / drawn[:, c].sum(axis=1) for c in chosen
            ]))  # fmt: skip
    counts = [int(np.sum(of_label == label)) for label in labels]
    return [
        spread_interval(energies)
        if min(count, counts[0]) >= MIN_GRASPS and np.isfinite(energies).mean() >= 0.5
        else UNDEFINED
        for energies, count in zip(np.concatenate(resampled, axis=1), counts, strict=True)
    ]
