"""Progress on the terminal: a bar for commands, lines for jobs of the workflow."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from typing import TypeVar

from rich.console import Console
from rich.progress import track

Item = TypeVar("Item")


def tracked(items: Sequence[Item], text: str) -> Iterator[Item]:
    """Yield the items in turn; a bar shows the progress if standard error is a terminal."""
    console = Console(stderr=True, emoji=False, highlight=False)
    hidden = not sys.stderr.isatty()
    yield from track(items, text, console=console, transient=True, disable=hidden)


def tell(line: str) -> None:
    """Print a line on the terminal although the output of the job goes to its log."""
    clear_line()
    print(line, file=sys.__stderr__, flush=True)


def clear_line() -> None:
    """Erase the bar of the run, which the main process draws again below the next line."""
    if sys.__stderr__ and sys.__stderr__.isatty():
        print("\r\x1b[K", end="", file=sys.__stderr__, flush=True)
