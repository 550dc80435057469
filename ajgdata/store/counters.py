"""Numbers of grasps and samples: `1`, `01` and `1.0` are one number."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Collection

_WHOLE = re.compile(r"0*(\d+)(?:\.0*)?", re.ASCII)


def canonical(text: str) -> str:
    """Return a whole number without leading zeros and fraction; any other text is unchanged.

    `1e3`, `0x1`, `A01`, `-1` and `1.5` are other texts.
    """
    return whole_number(text) or text


def whole_number(text: str) -> str:
    """Return the digits of a whole number without leading zeros and fraction; "" for other texts.

    >>> whole_number("007.0")
    '7'
    """
    match = _WHOLE.fullmatch(text.strip())
    return match[1] if match else ""


def joined_spellings(texts: Collection[str]) -> dict[str, str]:
    """Return the canonical number of each text whose number is spelled in several ways.

    Numbers with one spelling are not in the mapping: `01` is unchanged if `1` does not occur.
    """
    spellings: dict[str, set[str]] = defaultdict(set)
    for text in texts:
        spellings[canonical(text)].add(text)
    several = {number: forms for number, forms in spellings.items() if len(forms) > 1}
    return {form: number for number, forms in several.items() for form in forms}


def grasp_key(grasp_id: str) -> tuple[str, ...]:
    """Return the parts of a grasp_id with the canonical spelling of their numbers."""
    return tuple(canonical(part) for part in grasp_id.split("/"))
