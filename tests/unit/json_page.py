"""Keys that docs/json.md documents, and keys of a printed object."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

PAGE = Path(__file__).resolve().parents[2] / "docs" / "json.md"
#: Keys of objects with one key per class.
BY_CLASS = ("probability",)


def tables() -> dict[str, list[str]]:
    """Return the documented keys by command, e.g. `device list` or `compare of several runs`."""
    _, *sections = re.split(r"^## ", PAGE.read_text(encoding="utf-8"), flags=re.M)
    keys: dict[str, list[str]] = {}
    for section in sections:
        command = re.match(r"`ajgdata ([a-z ]+)`(.*)", section)
        cells = re.findall(r"^\| (`.*?) \|", section, flags=re.M)
        keys[command[1] + command[2]] = re.findall(r"`(.+?)`", " ".join(cells))
    return keys


def keys_of(document: dict, prefix: str = "") -> Iterator[str]:
    """Yield each key once; `name[].key` is a key of the objects in the list `name`."""
    for name, value in document.items():
        yield f"{prefix}{name}"
        if isinstance(value, dict) and name not in BY_CLASS:
            yield from keys_of(value, f"{prefix}{name}.")
        if isinstance(value, list) and value and isinstance(value[0], dict):
            first, *others = (list(keys_of(item, f"{prefix}{name}[].")) for item in value)
            assert all(other == first for other in others), "each object has the same keys"
            yield from first


def assert_documented(command: str, document: dict) -> None:
    """Check that the keys of an object are those of the table of its command."""
    assert sorted(keys_of(document)) == sorted(tables()[command])
