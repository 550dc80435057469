"""Issues of the levels of a session: a level that jumps, and swapped channels."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Mapping

import numpy as np

from ajgdata.features.levels import level_jumps, swapped_channels
from ajgdata.types import Finding, Target
from ajgdata.types.settings import Microphone, numbers_of

#: Levels in dB of full scale of all channels of the file, by recording_id.
Levels = Mapping[str, tuple[float, ...]]


def level_issues(
    session: str,
    levels: Levels,
    table: Mapping[str, Mapping[str, str]],
    targets: Mapping[str, Target],
    microphone: Microphone,
) -> list[Finding]:
    """Return a warning for each recording of a session whose level or channel order differs.

    `table` are the rows of recordings.csv by recording_id; recordings with the same object and
    classes are compared, at the level of `microphone`. Only recordings with equal numbers of
    channels are compared.
    """
    groups = {name: _group(table[name], targets) for name in levels}
    by_count: dict[int, list[str]] = defaultdict(list)
    for name, channels in levels.items():
        by_count[len(channels)].append(name)
    issues = []
    for count, names in by_count.items():
        if not count:
            continue
        channels_db = np.array([levels[name] for name in names], np.float64)
        used_db = _used_db(channels_db, microphone)
        issues += _jumps(session, names, used_db, [groups[name] for name in names])
        issues += _swaps(session, names, channels_db)
    return issues


def _group(row: Mapping[str, str], targets: Mapping[str, Target]) -> str:
    """Return the object and the classes of a recording as one text; "" if it has none.

    A class may be louder than another one of the same object, as a full box and an empty box.
    """
    classes = [name for name, target in targets.items() if target.kind == "classification"]
    values = [row.get(name, "") for name in dict.fromkeys(("object", *classes))]
    return json.dumps(values) if any(values) else ""


def _used_db(channels_db: np.ndarray, microphone: Microphone) -> np.ndarray:
    """Return the level (n,) in dB of the microphone that the features use; for several, that of
    their mean power. `channels_db` are the levels (n, channels)."""
    numbers = numbers_of(microphone)
    if len(numbers) == 1:
        return channels_db[:, numbers[0] - 1]
    if numbers:
        channels_db = channels_db[:, [number - 1 for number in numbers]]
    power = 10 ** (channels_db / 10)
    with np.errstate(divide="ignore"):  # silence has -inf
        return 10 * np.log10(power.mean(axis=1))


def _jumps(session: str, names: list[str], used_db: np.ndarray, groups: list[str]) -> list[Finding]:
    """Return a warning for each recording (n,) whose level jumps."""
    jumps = level_jumps(used_db, groups)
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
            "the same object and classes in this session",
            fix,
        )
        for name, jump in zip(names, jumps.tolist(), strict=True)
        if jump
    ]


def _swaps(session: str, names: list[str], channels_db: np.ndarray) -> list[Finding]:
    """Return a warning for each recording whose channels are in another order."""
    problem = (
        "its channels seem to be swapped: their levels are in the opposite order of most "
        "recordings of this session"
    )
    fix = "check the cables, swap the channels of the file and import it again, or reject it"
    swapped = swapped_channels(channels_db)
    return [
        Finding(session, name, "", "warning", "channels_swapped", problem, fix)
        for name, is_swapped in zip(names, swapped.tolist(), strict=True)
        if is_swapped
    ]
