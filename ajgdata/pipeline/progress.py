"""Progress: a bar that shows itself only when the wait is noticed, and lines for jobs."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from rich.progress import Progress

Item = TypeVar("Item")
#: Takes the number of items, returns what is to be called when one is done.
Started = Callable[[int], Callable[[], object]]
PATIENCE_S = 2.0


@contextmanager
def bar(what: str, patience_s: float = PATIENCE_S) -> Iterator[Started]:
    """Yield a function to be called with the number of items when it is known.

    It returns what is to be called when an item is done. A bar on the terminal says how far the
    work is, from `patience_s` seconds after its start on.
    """
    start = time.monotonic()
    with ExitStack() as shown:

        def started(total: int) -> Callable[[], object]:
            done, update = 0, None

            def show() -> None:
                nonlocal update
                if update is None and time.monotonic() - start >= patience_s:
                    progress = shown.enter_context(_bar())
                    update = partial(progress.update, progress.add_task(what, total=total))
                if update is not None:
                    update(completed=done)

            def advance() -> None:
                nonlocal done
                done += 1
                show()

            show()
            return advance

        yield started


def _bar() -> Progress:
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    console = Console(stderr=True, emoji=False, highlight=False)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    return Progress(*columns, console=console, transient=True, disable=not console.is_terminal)


def when_slow(items: Sequence[Item], what: str, patience_s: float = PATIENCE_S) -> Iterator[Item]:
    """Yield the items one by one, with a bar if that takes longer than `patience_s` seconds."""
    with bar(what, patience_s) as started:
        advance = started(len(items))
        for item in items:
            yield item
            advance()


def lines(what: str, parts: int = 10) -> Started:
    """Return a function like that of `bar`, which writes `parts` lines in all to the terminal.

    Jobs of the workflow run side by side: their bars would overwrite one another.
    """

    def started(total: int) -> Callable[[], object]:
        done = 0

        def advance() -> None:
            nonlocal done
            done += 1
            if done * parts // total > (done - 1) * parts // total:
                tell(f"{what}: {done} of {total}")

        return advance

    return started


def tell(line: str) -> None:
    """Print a line on the terminal although the output of the job goes to its log."""
    print(line, file=sys.__stderr__, flush=True)
