"""Files of a folder for the names in a table: exact names first, then looser readings.

Programs change names: macOS stores decomposed letters (Unicode form NFD), Windows ignores case and
writes backslashes, spreadsheets write `001` as `1` and, next to an empty cell, 300 as `300.0`.

>>> files = [Path("Cube.wav"), Path("001.wav")]
>>> find_files(["Cube.wav", "cube.wav", "1.0.wav", "2.wav"], files)["1.0.wav"]
Match(step='zeros of numbers', files=(PosixPath('001.wav'),), taken_by=None)
"""

from __future__ import annotations

import re
import unicodedata
from collections import defaultdict
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

#: Number with leading zeros or a fraction of zeros, within the name of a file.
_NUMBER = re.compile(r"(?<![\d.])0*(\d+)(?:\.0+)?(?![\d.])")


def exact_name(name: str) -> str:
    """Return a path without `./`; blanks remain.

    >>> exact_name("./ a.wav")
    ' a.wav'
    """
    return PurePosixPath(name).as_posix()


def without_blanks(name: str) -> str:
    r"""Return a path with / between folders, without blanks at the ends of its parts.

    Blanks at the ends of the stem count too: a template adds the suffix to the text of a cell.

    >>> without_blanks(".\\wav\\ a\xa0.wav")
    'wav/a.wav'
    """
    parts = [_stripped(part) for part in name.replace("\\", "/").split("/")]
    path = PurePosixPath("/".join(parts))
    return path.with_name(_stripped(path.stem) + path.suffix).as_posix() if path.name else ""


def _stripped(text: str) -> str:
    """Return text without blanks and invisible characters (category Cf) at its ends."""
    first = 0
    last = len(text)
    while first < last and _is_blank(text[first]):
        first += 1
    while first < last and _is_blank(text[last - 1]):
        last -= 1
    return text[first:last]


def _is_blank(character: str) -> bool:
    return character.isspace() or unicodedata.category(character) == "Cf"


def composed_name(name: str) -> str:
    r"""Return a name without blanks, in Unicode form NFC.

    >>> composed_name("u\u0308bung.wav") == "\xfcbung.wav"
    True
    """
    return unicodedata.normalize("NFC", without_blanks(name))


def without_case(name: str) -> str:
    """Return a composed name without a difference of upper and lower case.

    >>> without_case("Cube.WAV")
    'cube.wav'
    """
    return unicodedata.normalize("NFC", composed_name(name).casefold())


def without_zeros(name: str) -> str:
    """Return a name without the leading zeros and the `.0` of its numbers.

    >>> without_zeros("300.0.wav"), without_zeros("take_001.wav"), without_zeros("1.5.wav")
    ('300.wav', 'take_1.wav', '1.5.wav')
    """
    path = PurePosixPath(without_case(name))
    stem = path.as_posix().removesuffix(path.suffix)
    return _NUMBER.sub(lambda match: match[1], stem) + path.suffix


#: The loosest step, which assumes that a spreadsheet changed a number.
LOOSEST_STEP = "zeros of numbers"
#: From the strictest step to the loosest: the differences that a step ignores in addition, and the
#: function that reads a name.
STEPS: dict[str, Callable[[str], str]] = {
    "": exact_name,
    "blanks and \\": without_blanks,
    "Unicode form": composed_name,
    "upper and lower case": without_case,
    LOOSEST_STEP: without_zeros,
}


@dataclass(frozen=True)
class Match:
    """Files that a name of a table can mean, and the ignored differences (`step`, "": none).

    `taken_by` is the name that has the file, because it means the file by a stricter step.
    """

    step: str
    files: tuple[Path, ...]
    taken_by: str | None = None


def find_files(names: Collection[str], files: Collection[Path]) -> dict[str, Match]:
    """Return, for each name, the files of the first step of STEPS that finds any.

    >>> matches = find_files(["a.wav", "A.wav", "b.wav"], [Path("a.wav"), Path("c.wav")])
    >>> matches["A.wav"].taken_by
    'a.wav'
    >>> "b.wav" in matches
    False
    """
    matches: dict[str, Match] = {}
    owners: dict[Path, str] = {}
    for step, reading in STEPS.items():
        open_names = [name for name in names if name not in matches]
        if not open_names:
            break
        by_reading: dict[str, list[Path]] = defaultdict(list)
        for file in files:
            by_reading[reading(file.as_posix())].append(file)
        owners_of_stricter_steps = dict(owners)
        for name in open_names:
            candidates = tuple(by_reading.get(reading(name), ()))
            if not candidates:
                continue
            owner = None
            if len(candidates) == 1:
                owner = owners_of_stricter_steps.get(candidates[0])
                owners.setdefault(candidates[0], name)
            matches[name] = Match(step, candidates, owner)
    return matches
