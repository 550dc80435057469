"""Progress: a bar that shows itself only when the wait is noticed, and lines for jobs."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

Item = TypeVar("Item")
PATIENCE_S = 2.0


def when_slow(items: Sequence[Item], what: str, patience_s: float = PATIENCE_S) -> Iterator[Item]:
    """The items one by one; after `patience_s` seconds a bar on the terminal says how far it is."""
    start, bar, task = time.monotonic(), None, None
    try:
        for done, item in enumerate(items):
            if bar is None and time.monotonic() - start > patience_s:
                from rich.console import Console
                from rich.progress import Progress

                console = Console(stderr=True)
                bar = Progress(console=console, transient=True, disable=not console.is_terminal)
                task = bar.add_task(what, total=len(items))
                bar.start()
            if bar is not None and task is not None:
                bar.update(task, completed=done)
            yield item
    finally:
        if bar is not None:
            bar.stop()


def lines(what: str, parts: int = 10) -> Callable[[int], Callable[[], object]]:
    """A line on the terminal at each of `parts` parts of the work, past any redirection.

    Jobs of the workflow run side by side: their bars would overwrite one another.
    """

    def started(total: int) -> Callable[[], object]:
        done = 0

        def advance() -> None:
            nonlocal done
            done += 1
            if done * parts // total > (done - 1) * parts // total:
                print(f"{what}: {done} of {total}", file=sys.__stderr__, flush=True)

        return advance

    return started
