"""Lines of a run for the records of Snakemake's loggers."""

import io
import json
import logging
import re
from pathlib import Path

import pytest
import yaml
from snakemake_interface_logger_plugins.common import LogEvent
from snakemake_interface_logger_plugins.registry import LoggerPluginRegistry
from snakemake_interface_logger_plugins.tests import MockOutputSettings, TestLogHandlerBase
from snakemake_logger_plugin_job_lines import JobLines, LogHandler, LogHandlerSettings

ROOT = Path(__file__).resolve().parents[2]
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
    lines = JobLines(stream)
    for entry in records:
        lines.write(entry, logging.LogRecord.getMessage)
    lines.close()
    return re.sub(r"\d\d:\d\d:\d\d  ", "at  ", stream.getvalue()).splitlines()


def test_a_line_per_finished_job_with_its_message_and_duration():
    records = [
        started(3, 0, "Measuring size"),
        started(4, 1, dataset="d", task="t"),
        record(None, msg="Select jobs to execute..."),
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
    plain, terminal = lines_of(records), lines_of(records, Terminal())
    assert plain == [f"at   1/12       1 s  {'m' * 200}"]
    assert "1 of 12" in "".join(terminal) and plain[0] in "".join(terminal)


def test_snakemakes_text_appears_until_its_table_of_jobs():
    table = record(LogEvent.RUN_INFO, msg="Job stats:")
    records = [record(None, msg="Building DAG"), table, record(None, msg="Select jobs")]
    assert lines_of(records) == ["Building DAG", "Job stats:"]


@pytest.mark.parametrize("setting", ["dryrun", "verbose", "debug_dag"])
def test_dry_runs_and_detailed_runs_have_snakemakes_own_console(setting, capsys):
    common = MockOutputSettings()
    setattr(common, setting, True)
    handler = LogHandler(common, None)
    handler.handle(record(None, level=logging.ERROR, msg="lost"))
    handler.close()
    assert not handler.writes_to_stream
    assert capsys.readouterr().err == ""


def test_a_dry_run_writes_its_jobs_into_a_file(tmp_path, capsys):
    common = MockOutputSettings()
    common.dryrun = True
    plan = tmp_path / "plan.jsonl"
    handler = LogHandler(common, LogHandlerSettings(str(plan)))
    for name in "ab":
        entry = started(1, dataset=name)
        entry.output = [f"{name}.nc"]
        handler.handle(entry)
    handler.handle(record(LogEvent.RUN_INFO, msg="Job stats:"))
    handler.close()
    assert [json.loads(line) for line in plan.read_text().splitlines()] == [
        {
            "rule_name": "rule",
            "wildcards": {"dataset": name},
            "output": [f"{name}.nc"],
            "reason": "why",
        }
        for name in "ab"
    ]
    assert capsys.readouterr() == ("", "")


def test_the_profiles_select_the_plugin():
    plugin = LoggerPluginRegistry().get_plugin("job-lines")
    assert plugin.log_handler is LogHandler
    assert plugin.settings_cls is LogHandlerSettings
    for name in ("default", "slurm"):
        profile = yaml.safe_load((ROOT / "profiles" / name / "config.yaml").read_text())
        assert profile["logger"] == ["job-lines"]


class TestInterface(TestLogHandlerBase):
    """The tests that Snakemake has for all its logger plugins."""

    __test__ = True

    def get_log_handler_cls(self):
        return LogHandler

    def get_log_handler_settings(self):
        return LogHandlerSettings()
