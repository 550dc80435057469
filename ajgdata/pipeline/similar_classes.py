"""Classes whose names differ only in spelling: probably one class, written in several ways."""

from __future__ import annotations

import re
import unicodedata
from collections import defaultdict
from collections.abc import Mapping

#: Blanks, hyphens and underscores between letters: `steel ball`, `steel_ball`, `steel-ball`.
_SEPARATOR = re.compile(r"(?<=[^\W\d_])[\s_-]+(?=[^\W\d_])")
#: Blanks between a letter and a digit: `cube 1`, `cube1`. Hyphens can be signs of numbers.
_BLANK = re.compile(r"(?<=[^\W\d_])\s+(?=\d)|(?<=\d)\s+(?=[^\W\d_])")


def spelling_key(name: str) -> str:
    r"""Return a name without case, Unicode form, separators of words, and dots at its end.

    >>> {spelling_key(name) for name in ("Cube", "CUBE.", " cube ", "cu\u200bbe")}
    {'cube'}
    >>> spelling_key("t-30") == spelling_key("t30")
    False
    """
    text = unicodedata.normalize("NFKC", unicodedata.normalize("NFKC", name).casefold())
    visible = "".join(c for c in text if unicodedata.category(c) != "Cf")
    plain = " ".join(visible.split()).strip(" .,;:")
    return _BLANK.sub("", _SEPARATOR.sub("", plain)) or name


def similar_classes(counts: Mapping[str, int]) -> list[dict[str, int]]:
    """Return the groups of classes with one `spelling_key`, each class with its count.

    The commonest class of a group comes first.

    >>> similar_classes({"cube": 3, "Cube": 20, "ball": 7})
    [{'Cube': 20, 'cube': 3}]
    """
    groups: dict[str, dict[str, int]] = defaultdict(dict)
    for name, count in sorted(counts.items(), key=lambda item: (-item[1], item[0])):
        groups[spelling_key(name)][name] = count
    return [group for group in groups.values() if len(group) > 1]
