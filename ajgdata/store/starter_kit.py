"""File names `<n>_<label>` of the starter kit, and other names that only have this form."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

#: Path of a recording: running number, label (everything after the first underscore), suffix.
STARTER_KIT = r"(?:.*/)?(?P<n>\d+)_(?P<label>[^/]+)\.[^./]+"
#: Least part of the file names of a folder that have the form. A smaller part is an accident, e.g.
#: hexadecimal names with digits only (Speech Commands: `00176480_nohash_0.wav`, 2 % of the names).
MIN_MATCHING = 1 / 2
#: Numbers that recorders and telephones derive from the clock: YYMMDD or YYYYMMDD, with or without
#: HHMM or HHMMSS; DDMMYYYY; Unix time of 2001 to 2033 in seconds or milliseconds.
_CLOCK = re.compile(
    r"(?:19|20)?\d\d(?:0[1-9]|1[0-2])(?:0[1-9]|[12]\d|3[01])(?:[0-2]\d[0-5]\d(?:[0-5]\d)?)?"
    r"|(?:0[1-9]|[12]\d|3[01])(?:0[1-9]|1[0-2])(?:19|20)\d\d"
    r"|1\d{9}(?:\d{3})?"
)
#: A date whose fields are separated, e.g. `2026_03_29_cube.wav`.
_SEPARATE_DATE = re.compile(r"(?:19|20)\d\d_(?:0[1-9]|1[0-2])_(?:0[1-9]|[12]\d|3[01])(?!\d).*")
#: A label with a decimal point or a sign is a measured value, e.g. `7.5` (a position in cm).
_MEASURED = re.compile(r"[+\u2212-]\d+|[+\u2212-]?\d+\.\d+")
_NUMBER = re.compile(r"[+\u2212-]?\d+(?:\.\d+)?")
#: Least part of the recordings whose label occurs again. Texts are rarely equal by accident, so a
#: quarter is sufficient. Equal digits are frequent (times, counters), so half is required.
MIN_REPEATED_TEXTS = 1 / 4
MIN_REPEATED_DIGITS = 1 / 2
#: In a folder with fewer recordings, each text can occur once: a first trial with a few objects.
MIN_FOLDER_RECORDINGS = 6


def starter_kit_objection(files: Sequence[Path]) -> str:
    """Return the reason why file names are not of the starter kit; "" if they are.

    `files` (n,) are paths of audio files relative to their folder. In the starter kit a running
    number identifies a recording, a label occurs in several recordings, and number 0 is the played
    sound. So the names are *not* of the starter kit if

    - fewer than half of them have the form `<n>_<label>`. A label that begins with `_` does not
      count, because `__` separates fields (Freesound: `12345__user__name.wav`);
    - half of the numbers are dates or times: recorders name files in this way;
    - a label occurs with number 0 and with other numbers: the numbers begin at 0, and recordings
      would be skipped as played sounds;
    - the labels have no letters (times, counters) and fewer than half of the recordings share
      their label. Positions in mm are accepted, because each position is recorded several times;
    - the labels are texts, there are six recordings or more, and fewer than a quarter of the
      recordings share their label: names or descriptions of files, not classes.

    Labels with a decimal point or a sign are measured values, which may all be different. If there
    are any, whole numbers are also measured values.
    """
    matches = [re.fullmatch(STARTER_KIT, path.as_posix()) for path in files]
    pairs = [(match["n"], match["label"]) for match in matches if match]
    pairs = [(number, label) for number, label in pairs if not label.startswith("_")]
    if not pairs:
        return "file names are not <n>_<label>.wav"
    if len(pairs) < MIN_MATCHING * len(files):
        return f"only {len(pairs)} of {len(files)} file names are <n>_<label>.wav"
    prefix = "file names only look like <n>_<label>.wav: "
    clock = [
        f"{number}_{label}"
        for number, label in pairs
        if _CLOCK.fullmatch(number) or _SEPARATE_DATE.fullmatch(f"{number}_{label}")
    ]
    if len(clock) >= len(pairs) / 2:
        return prefix + f"the numbers are dates or times, e.g. {clock[0]!r}"
    recorded = Counter(label for number, label in pairs if int(number) > 0)
    played = {label for number, label in pairs if int(number) == 0}
    both = sorted(played & set(recorded))
    if both:
        return prefix + f"{both[0]!r} has number 0, which is the played sound, and other numbers"
    reason = _label_objection(recorded)
    return prefix + reason if reason else ""


def _label_objection(recorded: Counter[str]) -> str:
    """Return the reason why labels are not classes or measured values; "" if they are.

    `recorded` has the number of recordings of each label.
    """
    is_measured = any(_MEASURED.fullmatch(label) for label in recorded)
    repeated = sum(
        count
        for label, count in recorded.items()
        if count > 1 or (is_measured and _NUMBER.fullmatch(label))
    )
    total = recorded.total()
    are_digits = not any(character.isalpha() for label in recorded for character in label)
    if are_digits and repeated < MIN_REPEATED_DIGITS * total:
        return f"the labels are digits that rarely repeat, e.g. {min(recorded)!r}"
    if total >= MIN_FOLDER_RECORDINGS and repeated < MIN_REPEATED_TEXTS * total:
        return f"most of {len(recorded)} labels occur once, e.g. {min(recorded)!r}"
    return ""
