"""Console of a run: one line per finished job, errors, and a bar with the remaining time."""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING, Any, TextIO

from rich import progress
from rich.console import Console

from ajgdata.types import many

if TYPE_CHECKING:
    from rich.progress import Progress

#: The remaining time follows from the jobs that finished in this time, in s.
MEASURED_S = 24 * 3600
#: Error of Snakemake that only repeats which command failed; the record of the job follows.
REPEATED = "RuleException"


def show_jobs(logger: logging.Logger) -> None:
    """Let Snakemake's `logger` write JobLines to the terminal instead of its own messages.

    Its log file still has all messages. With `--verbose` or a logger plugin nothing changes, and
    filters stay, so `--quiet` has its usual effect.
    """
    if logger.isEnabledFor(logging.DEBUG):
        return
    for handler in tuple(logger.handlers):
        is_file = isinstance(handler, logging.FileHandler)
        if isinstance(handler, logging.StreamHandler) and not is_file:
            lines = JobLines(handler.stream)
            lines.filters = handler.filters
            logger.removeHandler(handler)
            logger.addHandler(lines)


class JobLines(logging.Handler):
    """Write one line per finished or failed job of Snakemake, and its warnings and errors.

    On a terminal, a bar below the lines shows the number of jobs and the remaining time. Records
    are those of Snakemake's interface for loggers; `event` is their kind.
    """

    def __init__(self, stream: TextIO) -> None:
        super().__init__()
        self._bar = _bar(stream)
        self._console = self._bar.console
        self._task = self._bar.add_task("", total=None)
        self._jobs: dict[int, dict[str, Any]] = {}
        self._finished: list[dict[str, Any]] = []
        self._start_s = 0.0

    def emit(self, record: logging.LogRecord) -> None:
        """Write the lines of a record, if it has any."""
        fields = vars(record)
        match fields.get("event"):
            case "job_info":
                self._start(fields)
            case "job_finished":
                self._finished.append(fields)
            case "progress":
                self._write_finished(fields["done"], fields["total"])
            case "job_error":
                logs = ", ".join([*fields["log"], *fields.get("aux_logs", ())])
                text = self._text(fields["jobid"], fields)
                self._write(record.created, f"failed: {text} (log: {logs or 'none'})")
            case _ if record.levelno >= logging.WARNING and fields.get("exception") != REPEATED:
                self._console.out(record.getMessage())

    def _start(self, fields: dict[str, Any]) -> None:
        self._start_s = self._start_s or fields["created"]
        self._jobs[fields["jobid"]] = fields
        self._bar.start()

    def _text(self, jobid: int, fields: dict[str, Any]) -> str:
        """Return the message of a job, else its rule and wildcards, else that of the record."""
        job = self._jobs.get(jobid)
        if job is None:
            return str(fields["msg"])
        return job["rule_msg"] or " ".join([job["rule_name"], *job["wildcards"].values()])

    def _write_finished(self, done: int, total: int) -> None:
        """Write the jobs that finished since the last call; `done` counts them."""
        first = done - len(self._finished) + 1
        for number, fields in enumerate(self._finished, first):
            jobid, end_s = fields["job_id"], fields["created"]
            took = duration(end_s - self._jobs.get(jobid, fields)["created"])
            count = f"{number:>{len(str(total))}}/{total}"
            self._write(end_s, f"{count}  {took:>8}  {self._text(jobid, fields)}")
        if self._finished and done == total:
            end_s = self._finished[-1]["created"]
            self._write(end_s, f"{many(total, 'job')} in {duration(end_s - self._start_s)}")
        self._finished.clear()
        self._bar.update(self._task, completed=done, total=total)
        if done == total:
            self._bar.stop()

    def _write(self, time_s: float, text: str) -> None:
        self._console.out(f"{time.strftime('%H:%M:%S', time.localtime(time_s))}  {text}")

    def close(self) -> None:
        """Remove the bar."""
        self._bar.stop()
        super().close()


def _bar(stream: TextIO) -> Progress:
    """Return a bar that shows nothing if `stream` is not a terminal."""
    terminal = stream.isatty()
    return progress.Progress(
        progress.MofNCompleteColumn(separator=" of "),
        progress.TextColumn("jobs"),
        progress.BarColumn(),
        progress.TimeRemainingColumn(),
        progress.TextColumn("left"),
        console=Console(file=stream, force_terminal=terminal, highlight=False, emoji=False),
        transient=True,
        disable=not terminal,
        speed_estimate_period=MEASURED_S,
        refresh_per_second=1,
    )


def duration(seconds: float) -> str:
    """Return `41 s` or `12.3 min`."""
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:,.1f} min"
