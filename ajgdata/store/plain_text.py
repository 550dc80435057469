"""Labels as plain text: texts that look the same are the same."""

from __future__ import annotations

import unicodedata
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence

_SHOWN = 5


def plain_text(text: str) -> str:
    """Return text in NFC, with single spaces and without invisible characters.

    Invisible are format and control characters (Unicode categories Cf and Cc), such as the
    zero-width space.
    """
    if text.isascii() and text.isprintable() and "  " not in text:
        return text.strip()
    words = " ".join(unicodedata.normalize("NFC", text).split())
    return "".join(c for c in words if unicodedata.category(c) not in ("Cf", "Cc")).strip()


class Cleaner:
    """Applies `plain_text` to the cells of a table and counts the texts that changed."""

    def __init__(self) -> None:
        self._changed: dict[str, Counter[str]] = defaultdict(Counter)

    def __call__(self, row: Mapping[str, str]) -> dict[str, str]:
        """Return the cells of one row as plain text."""
        cleaned = {column: plain_text(text) for column, text in row.items()}
        for column, text in row.items():
            if cleaned[column] != text.strip():
                self._changed[column][text] += 1
        return cleaned

    def notes(self) -> list[str]:
        """Return a line for each column whose text changed."""
        return [
            f"{column}: invisible characters or irregular spaces were removed from "
            f"{sum(texts.values())} cells: {listed([ascii(text) for text in texts])}"
            for column, texts in self._changed.items()
        ]


def listed(texts: Sequence[str]) -> str:
    """Return the first texts and the number of the remaining texts."""
    more = f" and {len(texts) - _SHOWN} more" if len(texts) > _SHOWN else ""
    return ", ".join(texts[:_SHOWN]) + more
