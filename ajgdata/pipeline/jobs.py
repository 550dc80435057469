"""Jobs of the workflow: the call of a function by a rule, and the log of its output."""

from __future__ import annotations

import inspect
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

from pydantic import validate_call

from ajgdata.models.device import CPU, training_on
from ajgdata.paths import Paths
from ajgdata.pipeline.progress import clear_line
from ajgdata.types import DataError, one_line
from ajgdata.types.extras import optional_packages


def run_job(job: Any) -> None:
    """Call the function that a rule names in its parameter `function` (`module:function`).

    `job` is the object `snakemake` of scripts. The parameters of the function are names of inputs,
    outputs, wildcards and params of the rule, or `paths`, `log` and `threads`. Values are converted
    to the annotated types, for example paths and settings. Networks are trained on `device`.
    """
    values = {
        "paths": Paths(run=job.params.get("run", "")),
        "log": job.log[0],
        "threads": job.threads,
    }
    for named in (job.input, job.output, job.wildcards, job.params):
        for name, value in named.items():
            values[name] = [*value] if isinstance(value, list) else value
    with (
        logged(job.log[0]),
        optional_packages(f"rule {job.rule}"),
        training_on(job.params.get("device", CPU)),
    ):
        function = resolve_name(f"{__package__}.{job.params.function}")
        parameters = inspect.signature(function).parameters
        arguments = {name: values[name] for name in parameters if name in values}
        validate_call(function)(**arguments)


@contextmanager
def logged(log: str) -> Iterator[None]:
    """Send the output of a job to `log`.

    The process ends with one line after a DataError, or if space, permission or memory are missing.
    Other errors have a traceback.
    """
    Path(log).parent.mkdir(parents=True, exist_ok=True)
    with Path(log).open("w", encoding="utf-8", buffering=1) as stream:
        try:
            with redirect_stdout(stream), redirect_stderr(stream):
                yield
        except DataError as error:
            stream.write(f"{error}\n")
            clear_line()
            sys.exit(str(error))
        except (OSError, MemoryError) as error:
            traceback.print_exc(file=stream)
            clear_line()
            sys.exit(one_line(error))
        except BaseException:
            traceback.print_exc(file=stream)
            raise
