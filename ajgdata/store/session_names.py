"""Names of sessions: different values of a folder or table never become one session."""

from __future__ import annotations

import hashlib
import re
from collections import defaultdict
from collections.abc import Collection

#: Digits of the hash that separates names which would otherwise be equal.
HASH_DIGITS = 6
_SIGNED = re.compile(r"([+\-\u2212])(?=[\d.])")
_SIGNS = {"+": "plus", "-": "minus", "\u2212": "minus"}


def slug(text: str) -> str:
    """Return `text` with everything but letters, digits and - replaced by _."""
    return re.sub(r"[^A-Za-z0-9-]+", "_", text).strip("_-") or "x"


def session_names(values: Collection[str]) -> dict[str, str]:
    """Return the name of a session for each value. Names differ even where case is ignored.

    A leading sign becomes a word. A value with characters of other scripts, and all values but one
    that would have one name, get a hash of the value at the end: its own name each time.
    """
    groups: dict[str, list[str]] = defaultdict(list)
    for value in values:
        groups[_plain_name(value).casefold()].append(value)
    names = {}
    for group in groups.values():
        # A value that is a name already keeps it.
        ordered = sorted(group, key=lambda value: (_plain_name(value) != value, value))
        for place, value in enumerate(ordered):
            name = _plain_name(value)
            names[value] = name if place == 0 else f"{name}-{_hash(value)}"
    return names


def is_changed(value: str, name: str) -> bool:
    """Return True if a name differs from its value by more than blanks and punctuation."""
    return slug(value) != name or value.startswith(("-", "+", "\u2212"))


def _plain_name(value: str) -> str:
    sign = _SIGNED.match(value)
    text = _SIGNS[sign[1]] + value[1:] if sign else value
    has_letters_lost = any(c.isalnum() and not c.isascii() for c in text)
    is_empty = not re.search("[A-Za-z0-9]", text)
    if has_letters_lost or is_empty:
        return f"{slug(text)}-{_hash(value)}"
    return slug(text)


def _hash(value: str) -> str:
    return hashlib.sha256(value.encode()).hexdigest()[:HASH_DIGITS]
