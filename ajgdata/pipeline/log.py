"""Logs of jobs: all output goes to the log, an error also to the terminal, in one line."""

from __future__ import annotations

import gc
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path

from ajgdata.store.trouble import machine_trouble
from ajgdata.types import DataError

#: Objects made before garbage is looked for: importing torch makes so many that looking each 700th
#: takes a tenth of its time or more, and what a job needs is imported in it.
GARBAGE = 20_000


@contextmanager
def _seldom_collecting() -> Iterator[None]:
    """Look for garbage seldom."""
    before = gc.get_threshold()
    gc.set_threshold(max(before[0], GARBAGE), *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)


@contextmanager
def logged(log: str) -> Iterator[None]:
    """Send the output of a job to `log`. A DataError ends the process
    with its line; so does what the machine lacks. A bug ends it with a traceback."""
    Path(log).parent.mkdir(parents=True, exist_ok=True)
    with Path(log).open("w", encoding="utf-8", buffering=1) as stream:
        try:
            told = redirect_stdout(stream), redirect_stderr(stream)
            with told[0], told[1], _seldom_collecting():
                yield
        except DataError as error:
            stream.write(f"{error}\n")
            sys.exit(str(error))
        except BaseException as error:
            traceback.print_exc(file=stream)
            if known := machine_trouble(error):
                sys.exit(str(known))
            raise
