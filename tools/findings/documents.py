"""Blocks between markers in Markdown: found, checked, replaced."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path

#: Markers stand on lines of their own.
_BEGIN = re.compile(r"^<!-- findings: (?P<name>\S+) -->\n", flags=re.M)
END = "<!-- /findings -->\n"


def documents(root: Path) -> list[Path]:
    """Return README and every page of the docs."""
    return [root / "README.md", *sorted((root / "docs").rglob("*.md"))]


def blocks_of(text: str) -> dict[str, str]:
    """Return what stands between the markers, by name. Raises ValueError for a marker that is not
    closed, closed twice, or named twice."""
    found: dict[str, str] = {}
    for name, start, end in _places(text):
        if name in found:
            raise ValueError(f"findings {name!r} stand twice")
        found[name] = text[start:end]
    return found


def rewritten(text: str, content: Callable[[str, str], str]) -> str:
    """Return `text` with each block replaced by `content(name, block)`, all else as it is."""
    parts, done = [], 0
    for name, start, end in _places(text):
        parts += [text[done:start], content(name, text[start:end])]
        done = end
    return "".join([*parts, text[done:]])


def outside(text: str) -> str:
    """Return `text` without its blocks."""
    return rewritten(text, lambda name, block: "")


def _places(text: str) -> Iterator[tuple[str, int, int]]:
    """Name, first and last position of each block."""
    at = 0
    for begin in _BEGIN.finditer(text):
        end = text.find(END, begin.end())
        if begin.start() < at or end < 0 or _BEGIN.search(text, begin.end(), end):
            raise ValueError(f"findings {begin['name']!r} are not closed with {END.strip()}")
        if END in text[at : begin.start()]:
            raise ValueError(f"{END.strip()} before findings {begin['name']!r} closes nothing")
        yield begin["name"], begin.end(), end
        at = end + len(END)
    if END in text[at:]:
        raise ValueError(f"the last {END.strip()} closes nothing")
