"""The part of `tools/mutants.py` that runs inside pytest: it records tests, or selects them.

`MUTANTS_RECORD` names the file to write: number, name, time and outcome of each test. The number is
the context under which coverage stores the lines, also in processes that the test starts. Fixtures
that tests share run under the empty context, as imports do.
`MUTANTS_SELECTED` names a file with the tests to run, in this order.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

tests: dict[str, dict[str, Any]] = {}


def set_context(context: str) -> str:
    """Store executed lines under another context; returns the context before."""
    if "MUTANTS_RECORD" not in os.environ:
        return ""
    import coverage

    before = os.environ.get("MUTANTS_TEST", "")
    os.environ["MUTANTS_TEST"] = context
    current = coverage.Coverage.current()
    if current is not None:
        current.switch_context(context)
    return before


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Give each test its own context."""
    context = str(len(tests) + 1)
    file = item.nodeid.partition("::")[0]
    tests[item.nodeid] = {
        "context": context,
        "test": item.nodeid,
        "file": file,
        "seconds": 0.0,
        "passed": True,
    }
    set_context(context)
    yield
    set_context("")


@pytest.hookimpl(hookwrapper=True)
def pytest_fixture_setup(fixturedef: Any) -> Iterator[None]:
    """Run a fixture that tests share outside of their contexts."""
    if fixturedef.scope == "function":
        yield
    else:
        before = set_context("")
        yield
        set_context(before)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Record the time and the outcome of a test."""
    test = tests[report.nodeid]
    test["seconds"] += report.duration
    test["passed"] = test["passed"] and report.outcome == "passed"


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep the selected tests."""
    if "MUTANTS_SELECTED" in os.environ:
        text = Path(os.environ["MUTANTS_SELECTED"]).read_text(encoding="utf-8")
        rank = {name: number for number, name in enumerate(json.loads(text))}
        items[:] = sorted((i for i in items if i.nodeid in rank), key=lambda i: rank[i.nodeid])


def pytest_sessionfinish() -> None:
    """Write the record of all tests."""
    if "MUTANTS_RECORD" in os.environ:
        text = json.dumps(list(tests.values()), indent=1)
        Path(os.environ["MUTANTS_RECORD"]).write_text(text, encoding="utf-8")
