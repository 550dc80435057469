"""The command that shows and plays recordings, for messages and reports."""

from __future__ import annotations

from collections.abc import Sequence

from ajgdata.types.shell import shell_command


def filter_word(column: str, value: str) -> str:
    """Return the word of a filter of `ajgdata browse` for cells that are `value`.

    >>> filter_word("label", "foam brick")
    'label="foam brick"'
    """
    has_space = not value or any(character.isspace() for character in value)
    return f'{column}="{value}"' if has_space else f"{column}={value}"


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
