"""Issues of the levels of a session: a level that jumps, and swapped channels."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping

import numpy as np

from ajgdata.features.levels import level_jumps, swapped_channels
from ajgdata.types import Finding

#: Levels in dB of full scale of all channels of the file, by recording_id.
Levels = Mapping[str, tuple[float, ...]]


def level_issues(session: str, levels: Levels, objects: Mapping[str, str]) -> list[Finding]:
    """Return a warning for each recording of a session whose level or channel order differs.

    `objects` are the objects by recording_id. Only recordings with equal numbers of channels are
    compared.
    """
    by_count: dict[int, list[str]] = defaultdict(list)
    for name, channels in levels.items():
        by_count[len(channels)].append(name)
    issues = []
    for count, names in by_count.items():
        if not count:
            continue
        table = np.array([levels[name] for name in names], np.float64)
        issues += _jumps(session, names, table, objects)
        issues += _swaps(session, names, table)
    return issues


def _jumps(
    session: str, names: list[str], table: np.ndarray, objects: Mapping[str, str]
) -> list[Finding]:
    """Return a warning for each recording whose loudest channel jumps."""
    jumps = level_jumps(table.max(axis=1), [objects.get(name, "") for name in names])
    fix = (
        "record it again with the gain of the other recordings, or import recordings of each gain "
        "as a session of their own"
    )
    return [
        Finding(
            session,
            name,
            "",
            "warning",
            "level_jump",
            f"{abs(jump):.0f} dB {'louder' if jump > 0 else 'quieter'} than most recordings of "
            "its object in this session",
            fix,
        )
        for name, jump in zip(names, jumps.tolist(), strict=True)
        if jump
    ]


def _swaps(session: str, names: list[str], table: np.ndarray) -> list[Finding]:
    """Return a warning for each recording whose channels are in another order."""
    problem = (
        "its channels seem to be swapped: their levels are in the opposite order of most "
        "recordings of this session"
    )
    fix = "check the cables, swap the channels of the file and import it again, or reject it"
    swapped = swapped_channels(table)
    return [
        Finding(session, name, "", "warning", "channels_swapped", problem, fix)
        for name, is_swapped in zip(names, swapped.tolist(), strict=True)
        if is_swapped
    ]
