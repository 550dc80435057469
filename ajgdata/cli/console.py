"""Functions that print to standard output and standard error of the commands."""

from __future__ import annotations

import json
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from io import TextIOWrapper
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape

#: Largest number of names per reason that are printed without the option `--all`.
MAX_SHOWN = 5
#: Exit code of a command that finished with a result that needs attention.
ATTENTION = 3
#: The argument `everything` of `shortened`, as an option of a command.
AllOption = Annotated[bool, typer.Option("--all", help="list all, not only a few of each kind")]
#: The option of commands that can print JSON (docs/json.md lists the keys).
JsonOption = Annotated[
    bool,
    typer.Option("--json", help="print JSON instead of text (page: JSON output)"),
]
out = Console(emoji=False, highlight=False)
err = Console(stderr=True, emoji=False, highlight=False)


def print_any_character() -> None:
    """Let standard output print characters outside its encoding as escapes, such as \\u2192.

    Standard error does so already. On Windows, output to a file or another program has an encoding
    with 256 characters.
    """
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


def say(text: str) -> None:
    """Print a line without wrapping it. The text may contain markup of rich."""
    out.print(text, soft_wrap=True)


def warn(text: str) -> None:
    """Print a line to standard error without wrapping it. The text may contain markup of rich."""
    err.print(text, soft_wrap=True)


def print_facts(facts: Mapping[str, str], width: int = 0) -> None:
    """Print topics and values in two columns; the first has at least `width` characters."""
    width = max(width, *map(len, facts))
    for topic, value in facts.items():
        say(f"{escape(topic):{width}}  {escape(value)}")


def print_json(document: Mapping[str, Any]) -> None:
    """Print one JSON object: indented on a terminal, otherwise in one line.

    The keys keep their order. JSON has no NaN and no infinity: these numbers become null.
    """
    from ajgdata.store.tables import plain

    content = plain(document)
    indent = 2 if sys.stdout.isatty() else None
    text = json.dumps(content, ensure_ascii=False, indent=indent)
    try:
        text.encode(sys.stdout.encoding or "utf-8")
    except UnicodeEncodeError:  # for example on Windows, if the output is a pipe
        text = json.dumps(content, indent=indent)
    print(text, flush=True)


def shortened(lines: Iterable[tuple[str, str]], *, everything: bool) -> Iterator[tuple[str, str]]:
    """Yield (name, reason) pairs, grouped by reason.

    Unless `everything`, a reason with many names has MAX_SHOWN names and the number of other names.
    """
    names_by_reason: dict[str, list[str]] = defaultdict(list)
    for name, reason in lines:
        names_by_reason[reason].append(name)
    for reason, names in names_by_reason.items():
        # A line with the number of other names is not printed for one name.
        is_short = len(names) <= MAX_SHOWN + 1
        shown = names if everything or is_short else names[:MAX_SHOWN]
        for name in shown:
            yield name, reason
        n_more = len(names) - len(shown)
        if n_more:
            yield f"and {n_more} more", f"{reason} (--all shows them)"
