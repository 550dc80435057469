"""Levels of the recordings of a session: recordings whose level jumps, and swapped channels.

Both compare a recording with the other recordings of its session, because no level is wrong by
itself.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

#: Least jump in dB: a factor of two in amplitude, the smallest step of switches of gain. Grasps of
#: one object have a standard deviation of 0.25 dB (simulated) to 4 dB (touched by hand).
JUMP_DB = 6.0
#: A jump exceeds the usual deviation from the median of the group by this number of standard
#: deviations.
_DEVIATIONS = 6
#: The quarter of deviations that is nearest to the median is free of jumps, even if half of the
#: recordings jump. A quarter of a normal distribution is within 0.319 standard deviations.
_NEAREST = 0.25
_NEAREST_DEVIATION = 0.319
#: Least number of recordings of a group that can show which one is unusual.
MIN_GROUP_RECORDINGS = 3
#: Least difference of two channels in dB. Differences within a session have a standard deviation of
#: 5 dB (hammer hits, stereo); a swap changes this difference by 12 dB or more.
SWAP_DB = 6.0
#: Least part of the recordings of a session with the usual order of two channels. Channels of equal
#: mean level, whose difference has a standard deviation of 5 dB, have each order in 12 %; two
#: microphones on both sides of the gripper may have each order in half of the recordings.
USUAL_ORDER = 2 / 3


def level_jumps(level_db: NDArray[np.float64], groups: Sequence[str]) -> NDArray[np.float64]:
    """Return by how many dB each recording (n,) of a session jumps; 0 if it does not.

    `groups` are the names of what sounds alike: object and classes. A level is compared with the
    median of the recordings of its group; only if no group has MIN_GROUP_RECORDINGS or more, all
    recordings are compared. A recording without a group, and a level that is not finite, never
    jump.
    """
    names = np.asarray(groups, dtype=np.str_)
    used = np.isfinite(level_db) & (names != "")
    alike = [np.flatnonzero(used & (names == name)) for name in np.unique(names)]
    large = [group for group in alike if len(group) >= MIN_GROUP_RECORDINGS]
    if not large and np.count_nonzero(used) >= MIN_GROUP_RECORDINGS:
        large = [np.flatnonzero(used)]
    jumps = np.zeros(len(level_db))
    if not large:
        return jumps
    deviations = []
    for group in large:
        ordered = np.sort(level_db[group])
        median = ordered[(len(group) - 1) // 2]  # a recording: never between two levels
        jumps[group] = level_db[group] - median
        deviations.append(np.sort(np.abs(jumps[group]))[1:])  # without the median itself
    usual = float(np.quantile(np.concatenate(deviations), _NEAREST)) / _NEAREST_DEVIATION
    return np.where(np.abs(jumps) >= max(JUMP_DB, _DEVIATIONS * usual), jumps, 0.0)


def swapped_channels(levels_db: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which recordings (n,) of levels (n, channels) have two channels swapped.

    In USUAL_ORDER of the recordings of the session, one of the two channels is louder by SWAP_DB or
    more. In a swapped recording, the other channel is louder by SWAP_DB or more.
    """
    count, channels = levels_db.shape
    swapped = np.zeros(count, bool)
    for first in range(channels):
        for second in range(first + 1, channels):
            difference = levels_db[:, first] - levels_db[:, second]
            order = np.where(np.abs(difference) >= SWAP_DB, np.sign(difference), 0)
            for usual in (-1, 1):
                if np.count_nonzero(order == usual) >= USUAL_ORDER * count:
                    swapped |= order == -usual
    return swapped
