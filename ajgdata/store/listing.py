"""Short lists of texts in messages."""

from __future__ import annotations

from collections.abc import Sequence

#: Examples in a remark about many files.
EXAMPLES = 3


def listed(texts: Sequence[str], count: int = EXAMPLES) -> str:
    """Return the first `count` texts and the number of the remaining texts.

    >>> listed(["a.wav", "b.wav", "c.wav", "d.wav", "e.wav"])
    'a.wav, b.wav, c.wav and 2 more'
    """
    remaining = f" and {len(texts) - count} more" if len(texts) > count else ""
    return ", ".join(texts[:count]) + remaining
