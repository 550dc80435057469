"""Progress on the terminal: a bar for commands, lines for jobs of the workflow."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TypeVar

Item = TypeVar("Item")
#: Takes the number of items, returns the function to call when an item is done.
Started = Callable[[int], Callable[[], object]]


@contextmanager
def bar(text: str) -> Iterator[Started]:
    """Yield a function to call with the number of items when it is known.

    It returns the function to call when an item is done. A bar shows the progress if standard error
    is a terminal.
    """
    from rich.console import Console
    from rich.progress import Progress  # 0.1 s

    console = Console(stderr=True, emoji=False, highlight=False)
    with Progress(console=console, transient=True, disable=not sys.stderr.isatty()) as progress:

        def started(total: int) -> Callable[[], object]:
            task = progress.add_task(text, total=total)
            return lambda: progress.advance(task)

        yield started


def tracked(items: Sequence[Item], text: str) -> Iterator[Item]:
    """Yield the items in turn, with a bar."""
    with bar(text) as started:
        advance = started(len(items))
        for item in items:
            yield item
            advance()


def tell(line: str) -> None:
    """Print a line on the terminal although the output of the job goes to its log."""
    clear_line()
    print(line, file=sys.__stderr__, flush=True)


def clear_line() -> None:
    """Erase the bar of the run, which the main process draws again below the next line."""
    if sys.__stderr__ and sys.__stderr__.isatty():
        print("\r\x1b[K", end="", file=sys.__stderr__, flush=True)
