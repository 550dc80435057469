"""Lines of a run for the records of Snakemake's loggers."""

import io
import logging
import re

import pytest
from snakemake_interface_logger_plugins.common import LogEvent

from ajgdata.pipeline.console import JobLines, show_jobs

START_S = 1_000_000.0


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def record(event, after_s=0.0, level=logging.INFO, msg=None, **fields):
    entry = logging.makeLogRecord({"event": event, "levelno": level, "msg": msg, **fields})
    entry.created = START_S + after_s
    return entry


def started(jobid, after_s=0.0, message="", **wildcards):
    fields = {"jobid": jobid, "rule_msg": message or None, "rule_name": "rule"}
    return record(LogEvent.JOB_INFO, after_s, wildcards=wildcards, reason="why", **fields)


def finished(jobid, after_s):
    return record(LogEvent.JOB_FINISHED, after_s, msg=f"Finished jobid: {jobid}", job_id=jobid)


def progress(done, total=12):
    return record(LogEvent.PROGRESS, done=done, total=total)


def lines_of(records, stream=None) -> list[str]:
    """Return what is written, with the time of day replaced by `at`."""
    stream = stream or io.StringIO()
    handler = JobLines(stream)
    for entry in records:
        handler.handle(entry)
    handler.close()
    return re.sub(r"\d\d:\d\d:\d\d  ", "at  ", stream.getvalue()).splitlines()


def test_a_line_per_finished_job_with_its_message_and_duration():
    records = [
        record(None, msg="Select jobs to execute..."),
        started(3, 0, "Measuring size"),
        started(4, 1, dataset="d", task="t"),
        finished(4, 42),
        progress(1),
        finished(3, 180),
        progress(2),
    ]
    assert lines_of(records) == [
        "at   1/12      41 s  rule d t",
        "at   2/12   3.0 min  Measuring size",
    ]


def test_jobs_of_a_group_are_counted_one_by_one_and_the_last_line_has_the_time_of_the_run():
    group = [finished(1, 10), finished(2, 20), progress(12)]
    assert lines_of([started(1, 5, "a"), started(2, 5, "b"), *group]) == [
        "at  11/12       5 s  a",
        "at  12/12      15 s  b",
        "at  12 jobs in 15 s",
    ]


def test_a_failed_job_has_one_line_with_its_log():
    failed = record(
        LogEvent.JOB_ERROR,
        level=logging.ERROR,
        msg="Error in rule",
        jobid=3,
        log=["a.log"],
        aux_logs=["slurm.log"],
    )
    repeated = record(LogEvent.ERROR, level=logging.ERROR, msg="x", exception="RuleException")
    other = record(LogEvent.ERROR, level=logging.ERROR, msg="[a] lost", exception="OSError")
    warning = record(None, level=logging.WARNING, msg="slow")
    assert lines_of([started(3, 0, "Measuring size"), repeated, failed, other, warning]) == [
        "at  failed: Measuring size (log: a.log, slurm.log)",
        "[a] lost",
        "slow",
    ]


def test_only_a_terminal_has_a_bar_and_long_lines_are_not_broken():
    records = [started(1, 0, "m" * 200), finished(1, 1), progress(1)]
    plain = lines_of(records)
    terminal = lines_of(records, Terminal())
    assert plain == [f"at   1/12       1 s  {'m' * 200}"]
    assert "1 of 12" in "".join(terminal) and plain[0] in "".join(terminal)


@pytest.mark.parametrize(("level", "is_replaced"), [(logging.INFO, True), (logging.DEBUG, False)])
def test_the_log_file_and_verbose_runs_keep_all_messages(tmp_path, level, is_replaced):
    stream = io.StringIO()
    logger = logging.Logger("snakemake", level)
    with (tmp_path / "log").open("w"):
        usual = logging.StreamHandler(stream)
        file = logging.FileHandler(tmp_path / "log")
        usual.addFilter(lambda record: record.levelno != logging.WARNING)
        logger.addHandler(usual)
        logger.addHandler(file)
        show_jobs(logger)
        for given in (logging.INFO, logging.WARNING, logging.ERROR):
            logger.log(given, "level %d", given)
        file.close()
    assert (tmp_path / "log").read_text().splitlines() == ["level 20", "level 30", "level 40"]
    assert stream.getvalue().splitlines() == (
        ["level 40"] if is_replaced else ["level 20", "level 40"]
    )
