"""Names of sessions: different values of a folder or table become different sessions."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from ajgdata.types.names import is_device_name

#: Digits of the hash at the end of names that would otherwise be equal.
HASH_DIGITS = 6
#: Name of a value without Latin letters and digits, before its hash.
NAMELESS = "session"
_SIGNED = re.compile(r"([+\-\u2212])(?=[\d.])")
_SIGNS = {"+": "plus", "-": "minus", "\u2212": "minus"}


def slug(text: str) -> str:
    """Return `text` with everything but letters, digits and - replaced by _."""
    return re.sub(r"[^A-Za-z0-9-]+", "_", text).strip("_-") or "x"


@dataclass(frozen=True)
class KnownSession:
    """A session of the data set: its value at the import, and the paths of its recordings in the
    imported folder.

    `text` is None for a session that was recorded, or that an older version imported.
    """

    text: str | None
    files: Collection[str] = ()


def stored_session_names(
    values: Collection[str],
    known: Mapping[str, KnownSession] = MappingProxyType({}),
    files: Mapping[str, Collection[str]] = MappingProxyType({}),
) -> dict[str, str]:
    """Return the name of a session for each value. Names differ even if case is ignored.

    A leading sign becomes a word. The name of a value ends with a hash of the value if the value
    has characters of other scripts or is the name of a device on Windows. If several values would
    have one name, all of them except one have a hash. `known` are the sessions of the data set by
    name. A value keeps its name in later imports, and no other value gets this name. `files` are
    the paths of recordings by value.

    >>> stored_session_names(["run 1", "run_1", "-5"])
    {'run_1': 'run_1', '-5': 'minus5', 'run 1': 'run_1-b945d8'}
    >>> stored_session_names(["run_1"], {"run_1": KnownSession("run 1")})
    {'run_1': 'run_1-37ddff'}
    """
    by_text = {session.text: name for name, session in known.items() if session.text is not None}
    names = {value: by_text[value] for value in sorted(values) if value in by_text}
    used = {name.casefold() for name in known}
    # First the values that are names, which do not change.
    new_values = sorted(
        set(values) - set(names), key=lambda value: (_plain_name(value) != value, value)
    )
    for value in new_values:
        name = _name_in_older_version(value, files.get(value, ()), known, names.values())
        if not name:
            name = _plain_name(value)
            if name.casefold() in used:
                name = f"{name}-{_hash(value)}"
        names[value] = name
        used.add(name.casefold())
    return names


def _name_in_older_version(
    value: str, files: Collection[str], known: Mapping[str, KnownSession], used: Collection[str]
) -> str:
    """Return the name of a known session without a text that belongs to a value; "" without one.

    Older versions replaced all signs and all letters of other scripts. If the name is not the
    present one, the session has to contain one of the `files`.
    """
    for name in (_plain_name(value), slug(value)):
        session = known.get(name)
        if session is None or session.text is not None or name in used:
            continue
        if name == _plain_name(value) or set(files) & set(session.files):
            return name
    return ""


def is_changed(value: str, name: str) -> bool:
    """Return True if a name differs from its value by more than blanks and punctuation."""
    return slug(value) != name or value.startswith(("-", "+", "\u2212"))


def _plain_name(value: str) -> str:
    """Return the name of a value, if no other value would have the same name."""
    sign = _SIGNED.match(value)
    text = _SIGNS[sign[1]] + value[1:] if sign else value
    loses_letters = any(character.isalnum() and not character.isascii() for character in text)
    is_empty = not re.search("[A-Za-z0-9]", text)
    if loses_letters or is_empty:
        readable = NAMELESS if is_empty else slug(text)
        return f"{readable}-{_hash(value)}"
    name = slug(text)
    return f"{name}-{_hash(value)}" if is_device_name(name) else name


def _hash(value: str) -> str:
    return hashlib.sha256(value.encode()).hexdigest()[:HASH_DIGITS]
