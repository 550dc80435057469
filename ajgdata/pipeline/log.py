"""Logs of jobs: all output goes to the log, an error also to the terminal, in one line."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path

from ajgdata.store.trouble import machine_trouble
from ajgdata.types import DataError


@contextmanager
def logged(log: str) -> Iterator[None]:
    """Send the output of a job to `log`. A DataError ends the process
    with its line; so does what the machine lacks. A bug ends it with a traceback."""
    Path(log).parent.mkdir(parents=True, exist_ok=True)
    with Path(log).open("w", encoding="utf-8", buffering=1) as stream:
        try:
            told = redirect_stdout(stream), redirect_stderr(stream)
            with told[0], told[1]:
                yield
        except DataError as error:
            stream.write(f"{error}\n")
            sys.exit(str(error))
        except BaseException as error:
            traceback.print_exc(file=stream)
            if known := machine_trouble(error):
                sys.exit(str(known))
            raise
