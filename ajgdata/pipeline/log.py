"""Logs of jobs: all output goes to the log, an error also to the terminal, in one line."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.running import noted_job
from ajgdata.store.benchmarks import used_line
from ajgdata.store.trouble import machine_trouble
from ajgdata.types import DataError


@contextmanager
def logged(log: str) -> Iterator[None]:
    """Send output to `log`, in which a job in this project writes. A DataError ends the process
    with its line; so does what the machine lacks. A bug ends it with a traceback."""
    Path(log).parent.mkdir(parents=True, exist_ok=True)
    with Path(log).open("w", encoding="utf-8", buffering=1) as stream:
        try:
            with noted_job(Paths()), redirect_stdout(stream), redirect_stderr(stream):
                yield
            stream.write(f"{used_line()}\n")
        except DataError as error:
            stream.write(f"{error}\n")
            sys.exit(str(error))
        except BaseException as error:
            traceback.print_exc(file=stream)
            if known := machine_trouble(error):
                sys.exit(str(known))
            raise
