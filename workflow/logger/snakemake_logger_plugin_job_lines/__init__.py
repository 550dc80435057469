"""Console of a run: one line per finished job, errors, and a bar with the remaining time.

A plugin of Snakemake's interface for loggers: `snakemake --logger job-lines`. In a dry run, it can
also write the jobs with their reasons into a file, which `ajgdata status` reads.
"""

import json
import logging
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent
from snakemake_interface_logger_plugins.settings import LogHandlerSettingsBase

if TYPE_CHECKING:
    from rich.progress import Progress

#: The remaining time follows from the jobs that finished in this time, in s.
MEASURED_S = 24 * 3600
#: Error of Snakemake that only repeats which command failed; the record of the job follows.
REPEATED = "RuleException"
#: Keys of a job in the file of a dry run.
PLANNED_KEYS = ("rule_name", "wildcards", "output", "reason")


@dataclass
class LogHandlerSettings(LogHandlerSettingsBase):
    """Options of the command line, with the prefix `--logger-job-lines-`.

    Snakemake reads the types of the fields, so this module has no postponed annotations.
    """

    plan: str = field(
        default="",
        metadata={"help": "file for the jobs of a dry run, one JSON object per line"},
    )


class LogHandler(LogHandlerBase):
    """Console of a run; Snakemake creates it and gives it the records of a run.

    A dry run, and a run with `--verbose` or `--debug-dag`, have Snakemake's own console instead.
    """

    def __post_init__(self) -> None:
        self._lines = JobLines(sys.stderr) if self.writes_to_stream else None
        self._plan: Path | None = None
        if isinstance(self.settings, LogHandlerSettings) and self.settings.plan:
            self._plan = Path(self.settings.plan)

    @property
    def writes_to_stream(self) -> bool:
        """Whether this console takes the place of Snakemake's own."""
        common = self.common_settings
        return not (common.dryrun or common.verbose or common.debug_dag)

    @property
    def writes_to_file(self) -> bool:
        """False: Snakemake's own log file has all messages."""
        return False

    @property
    def has_filter(self) -> bool:
        """False: Snakemake adds its filter, so `--quiet` has its usual effect."""
        return False

    @property
    def has_formatter(self) -> bool:
        """False: Snakemake adds its formatter, which writes the text before the first job."""
        return False

    @property
    def needs_rulegraph(self) -> bool:
        """False: the lines need only the jobs."""
        return False

    def emit(self, record: logging.LogRecord) -> None:
        """Write the lines of a record, if it has any."""
        if self._lines is not None:
            self._lines.write(record, self.format)
        fields = vars(record)
        if self._plan is not None and fields.get("event") == LogEvent.JOB_INFO:
            job = {key: fields[key] for key in PLANNED_KEYS}
            with self._plan.open("a", encoding="utf-8") as stream:
                stream.write(json.dumps(job) + "\n")

    def close(self) -> None:
        """Remove the bar."""
        if self._lines is not None:
            self._lines.close()
        super().close()


class JobLines:
    """Writer of one line per finished or failed job of Snakemake, and of its warnings and errors.

    Snakemake's own text appears until the table of jobs, with which a run starts. On a terminal, a
    bar below the lines shows the number of jobs and the remaining time.
    """

    def __init__(self, stream: TextIO) -> None:
        self._bar = _bar(stream)
        self._console = self._bar.console
        self._task = self._bar.add_task("", total=None)
        self._is_running = False
        self._jobs: dict[int, dict[str, Any]] = {}
        self._finished: list[dict[str, Any]] = []
        self._start_s = 0.0

    def write(self, record: logging.LogRecord, text_of: Callable[[logging.LogRecord], str]) -> None:
        """Write the lines of a record, if it has any; `text_of` gives Snakemake's own text."""
        fields = vars(record)
        event = fields.get("event")
        match event:
            case LogEvent.JOB_INFO:
                self._start(fields)
            case LogEvent.JOB_FINISHED:
                self._finished.append(fields)
            case LogEvent.PROGRESS:
                self._write_finished(fields["done"], fields["total"])
            case LogEvent.JOB_ERROR:
                logs = ", ".join([*fields["log"], *fields.get("aux_logs", ())])
                job = self._text(fields["jobid"], fields)
                self._write(record.created, f"failed: {job} (log: {logs or 'none'})")
            case _ if record.levelno >= logging.WARNING and fields.get("exception") != REPEATED:
                self._console.out(record.getMessage())
            case _ if not self._is_running:
                self._console.out(text_of(record))
                self._is_running = event == LogEvent.RUN_INFO

    def _start(self, fields: dict[str, Any]) -> None:
        self._is_running = True
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
            jobid = fields["job_id"]
            end_s = fields["created"]
            took = duration(end_s - self._jobs.get(jobid, fields)["created"])
            count = f"{number:>{len(str(total))}}/{total}"
            self._write(end_s, f"{count}  {took:>8}  {self._text(jobid, fields)}")
        if self._finished and done == total:
            end_s = self._finished[-1]["created"]
            jobs = "1 job" if total == 1 else f"{total:,} jobs"
            self._write(end_s, f"{jobs} in {duration(end_s - self._start_s)}")
        self._finished.clear()
        self._bar.update(self._task, completed=done, total=total)
        if done == total:
            self._bar.stop()

    def _write(self, time_s: float, text: str) -> None:
        self._console.out(f"{time.strftime('%H:%M:%S', time.localtime(time_s))}  {text}")

    def close(self) -> None:
        """Remove the bar."""
        self._bar.stop()


def _bar(stream: TextIO) -> "Progress":
    """Return a bar that shows nothing if `stream` is not a terminal."""
    from rich import progress  # 0.1 s, which each job would need: Snakemake imports all plugins
    from rich.console import Console

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
