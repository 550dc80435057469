"""Energy of recordings relative to a reference, e.g. to recordings of the empty gripper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ajgdata.evaluate.agreement import UNDEFINED, Interval
from ajgdata.evaluate.intervals import MIN_GRASPS, resampled_counts, spread_interval
from ajgdata.types import NotPossibleError


@dataclass(frozen=True)
class RelativeEnergy:
    """Energy of recordings with one label, relative to the reference for the same object.

    `mean` and `sd` (ddof = 1, NaN for one group) are over groups, each with equal weight.
    `by_object` has the mean over the groups of each object.
    """

    label: str
    groups: int
    mean: float
    sd: float
    interval: Interval  #: 95 % interval of the mean over groups
    by_object: dict[str, float]


def band_energy(
    power: np.ndarray, frequency_hz: np.ndarray, band_hz: tuple[float, float]
) -> np.ndarray:
    """Return the energy (n,) of power spectra (n, f): the sum over low <= frequency <= high.

    `frequency_hz` (f,) are the frequencies of the bins; `band_hz` is (low, high). Raises ValueError
    for a band without a frequency.
    """
    low, high = band_hz
    inside = (frequency_hz >= low) & (frequency_hz <= high)
    if not inside.any():
        raise NotPossibleError(f"no frequency lies within {low:g} to {high:g} Hz")
    return np.asarray(power, np.float64)[:, inside].sum(axis=1)


def relative_energies(
    energy: np.ndarray, label: np.ndarray, group: np.ndarray, objects: np.ndarray, reference: str
) -> list[RelativeEnergy]:
    """Return the relative energy of each label; that of the label `reference` is first.

    `energy`, `label`, `group` and `objects` (n,) describe recordings. The energy of a group (a
    grasp) is the mean over its recordings, divided by the mean over the reference groups of the
    same object. Differences between objects therefore do not count as spread. Raises ValueError for
    an object without a reference.
    """
    firsts = np.unique(group, return_index=True)[1]
    means = np.array([energy[group == group[first]].mean() for first in firsts])
    group_label = label[firsts].astype(str)
    group_object = objects[firsts].astype(str)
    ratio = np.empty(len(firsts))
    for name in np.unique(group_object).tolist():
        here = group_object == name
        base = means[here & (group_label == reference)]
        if not base.size or base.mean() <= 0:
            raise NotPossibleError(f"no energy of {reference!r} to compare with on {name!r}")
        ratio[here] = means[here] / base.mean()
    compared = [name for name in np.unique(group_label).tolist() if name != reference]
    labels = [reference, *compared]
    intervals = _intervals(means, group_label, group_object, labels)
    energies = []
    for name, interval in zip(labels, intervals, strict=True):
        own = group_label == name
        values = ratio[own]
        by_object = {
            item: float(ratio[own & (group_object == item)].mean())
            for item in np.unique(group_object[own]).tolist()
        }
        energies.append(
            RelativeEnergy(
                label=name,
                groups=len(values),
                mean=float(values.mean()),
                sd=float(values.std(ddof=1)) if len(values) > 1 else float("nan"),
                interval=interval,
                by_object=by_object,
            )
        )
    return energies


def _intervals(
    means: np.ndarray, group_label: np.ndarray, group_object: np.ndarray, labels: Sequence[str]
) -> list[Interval]:
    """Return the 95 % interval of the mean relative energy of each label, the reference first.

    Arrays are (groups,). Each resample draws groups of all labels, also of the reference. It has no
    value if it has no reference group of some object. An interval is undefined if fewer than half
    of the resamples have a value, or if there are fewer than MIN_GRASPS groups.
    """
    is_reference = group_label == labels[0]
    blocks: list[np.ndarray] = []
    for drawn in resampled_counts(len(means)):
        ratio = np.empty_like(drawn)  # (resamples, groups)
        with np.errstate(invalid="ignore", divide="ignore"):
            for name in np.unique(group_object):
                here = group_object == name
                base = drawn[:, here & is_reference]
                scale = base.sum(axis=1) / (base @ means[here & is_reference])
                ratio[:, here] = means[here] * scale[:, None]
            by_label = []
            for label in labels:
                own = group_label == label
                total = (drawn[:, own] * ratio[:, own]).sum(axis=1)
                by_label.append(total / drawn[:, own].sum(axis=1))
        blocks.append(np.array(by_label))
    counts = [int(np.sum(group_label == label)) for label in labels]
    intervals = []
    for resampled, count in zip(np.concatenate(blocks, axis=1), counts, strict=True):
        is_enough = min(count, counts[0]) >= MIN_GRASPS and np.isfinite(resampled).mean() >= 0.5
        intervals.append(spread_interval(resampled) if is_enough else UNDEFINED)
    return intervals
