"""The command that shows and plays recordings, for messages and reports."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ajgdata.types.shell import shell_command

#: Names and values that a filter can have without quotes.
_PLAIN_NAME = re.compile(r'[^\s"!<>=~]+')
_PLAIN_VALUE = re.compile(r'[^\s"]+')


def filter_word(column: str, value: str) -> str:
    """Return the word of a filter of `ajgdata browse` for cells that are `value`.

    >>> filter_word("label", "foam brick")
    'label="foam brick"'
    >>> filter_word("mass g", '5" disk')
    '"mass g"="5"" disk"'
    """
    name = column if _PLAIN_NAME.fullmatch(column) else _quoted(column)
    return f"{name}={value if _PLAIN_VALUE.fullmatch(value) else _quoted(value)}"


def _quoted(text: str) -> str:
    """Return a text in quotes, with each quote in it doubled."""
    return '"' + text.replace('"', '""') + '"'


def browse_command(
    dataset: str,
    words: Sequence[str],
    *,
    predictions: str = "",
    sort: str = "",
    is_checked: bool = False,
) -> str:
    """Return the command that opens the recordings of a data set that match all `words`.

    `predictions` are task and model, and `sort` is a column. If `is_checked`, the command checks
    the recordings first.
    """
    arguments = ["ajgdata", "browse", dataset]
    if is_checked:
        arguments.append("--check")
    if predictions:
        arguments += ["--predictions", predictions]
    if words:
        arguments += ["--filter", " ".join(words)]
    if sort:
        arguments.append(f"--sort={sort}")
    return shell_command(arguments)
