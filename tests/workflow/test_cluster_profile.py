"""The SLURM profile knows every rule, and asks for more at each attempt."""

import re
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
PROFILE = yaml.safe_load((ROOT / "profiles/slurm/config.yaml").read_text())
REQUESTS = PROFILE["set-resources"]
#: A rule with a script, or one that another one is made of: the others start no job.
RULE = re.compile(
    r"^ *(?:use )?rule (?:\w+ as )?(\w+)(?: with)?:\n((?:(?! *(?:use )?rule ).*\n)*)", re.M
)
JOBS = {
    name
    for file in (ROOT / "workflow/rules").glob("*.smk")
    for name, body in RULE.findall(file.read_text())
    if "script:" in body or re.search(rf"use rule \w+ as {name} with", file.read_text())
}


def resources(rule: str, attempt: int, size_mb: int = 100) -> dict[str, int]:
    """What the profile asks for, as Snakemake works it out."""
    names = {"attempt": attempt, "input": SimpleNamespace(size_mb=size_mb)}
    return {key: eval(str(value), {}, names) for key, value in REQUESTS[rule].items()}


def test_every_rule_that_starts_jobs_has_a_line():
    assert {"acquire", "features", "report", "report_everything"} <= JOBS
    assert JOBS - set(REQUESTS) == set()


@pytest.mark.parametrize("rule", REQUESTS)
def test_each_attempt_asks_for_more(rule):
    first, second, third = (resources(rule, attempt) for attempt in (1, 2, 3))
    for need in ("mem_mb", "runtime"):
        assert isinstance(first[need], int)
        assert 0 < first[need] < second[need] < third[need]


def test_rules_of_groups_take_turns_and_no_others():
    grouped = PROFILE["groups"]
    assert {rule for rule in REQUESTS if "turn" in REQUESTS[rule]} == set(grouped)
    assert set(grouped.values()) == set(PROFILE["group-components"])
    assert PROFILE["resources"] == {"turn": 1}
    assert PROFILE["set-resource-scopes"] == {"turn": "local"}  # or one group at a time would run


def test_a_job_fits_into_a_group_of_its_rule_at_the_last_attempt():
    """SLURM's clocks count the whole group: the sum of its jobs is below a day."""
    for rule, group in PROFILE["groups"].items():
        last = resources(rule, PROFILE["retries"] + 1)
        assert last["runtime"] * PROFILE["group-components"][group] <= 24 * 60
