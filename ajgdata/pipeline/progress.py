"""A progress bar that shows itself only when the wait is long enough to be noticed."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
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
