"""The figure of docs/architecture.md has the functions that a recording passes, in order."""

import re
import sys
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import pytest
import yaml
from recorded import make_features, record_tones, run_experiments

from ajgdata.paths import Paths
from ajgdata.pipeline.collect import collect

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = f"{ROOT}/ajgdata/"
PAGE = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
FIGURE = (ROOT / "docs/images/architecture.svg").read_text(encoding="utf-8")
#: Jobs of the figure: rule, file of rules, and pairs of module and function.
JOBS = [
    (
        re.search(r'class="title"[^>]*>Job (\w+)', group)[1],
        re.search(r"workflow/rules/\w+\.smk", group)[0],
        re.findall(r'class="step" x="16"[^>]*>([^<]+)</tspan><tspan[^>]*>(\w+)<', group),
    )
    for group in re.findall(r'<g .*?class="job".*?</g>', FIGURE, flags=re.S)
]
DECLARATION = {
    "name": "tones",
    "targets": {"pitch": {"kind": "classification"}},
    "tasks": {"pitch": {"target": "pitch", "folds": 2, "models": ["knn"]}},
}

#: Module in the package and name of a function.
Call = tuple[str, str]


def steps(paths: Paths) -> Iterator[Callable[[], object]]:
    """Yield the functions of the three jobs for a data set of noisy tones."""
    paths.dataset("tones").parent.mkdir(parents=True)
    paths.dataset("tones").write_text(yaml.safe_dump(DECLARATION), encoding="utf-8")
    record_tones(paths, ["day"], count=12)
    yield lambda: make_features(paths, "tones")
    yield lambda: run_experiments(paths, "tones")
    yield lambda: collect(paths, datasets=["tones"], tasks=[("tones", "pitch")])


def first_calls(function: Callable[[], object]) -> list[Call]:
    """Return the functions of the package that a function calls, in the order of first calls."""
    calls: dict[Call, None] = {}

    def note(frame, event, argument):
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(PACKAGE):
            calls[code.co_filename.removeprefix(PACKAGE), code.co_name] = None

    sys.setprofile(note)
    try:
        function()
    finally:
        sys.setprofile(None)
    return list(calls)


@pytest.fixture(scope="module")
def calls(tmp_path_factory) -> list[list[Call]]:
    """First calls of each job. An earlier run imports all modules, because imports are no steps."""
    for step in steps(Paths(tmp_path_factory.mktemp("imports"))):
        step()
    return [first_calls(step) for step in steps(Paths(tmp_path_factory.mktemp("calls")))]


@pytest.mark.parametrize("number", range(len(JOBS)))
def test_a_recording_passes_the_functions_of_the_figure_in_their_order(number, calls):
    positions = [calls[number].index(step) for step in JOBS[number][2]]
    assert all(a < b for a, b in pairwise(positions))


@pytest.mark.parametrize(("rule", "file", "functions"), JOBS)
def test_the_rule_of_a_job_names_its_first_function(rule, file, functions):
    module, function = functions[0]
    rules = (ROOT / file).read_text(encoding="utf-8")
    body = rules.split(f"rule {rule}:")[1].split("\nrule ")[0]
    assert f'function="{Path(module).stem}:{function}"' in body


def test_the_figure_has_three_jobs_and_the_page_explains_each():
    assert [rule for rule, *_ in JOBS] == re.findall(r"^- \*\*(\w+)\*\*", PAGE, flags=re.M)
    assert len(JOBS) == 3


def test_the_files_that_the_page_names_exist():
    files = re.findall(r"`((?:ajgdata|tests|workflow)/[\w/.]+)`", PAGE)
    assert len(files) >= 5
    assert [name for name in files if not (ROOT / name).exists()] == []


def test_the_page_can_be_read_in_two_minutes():
    assert len(PAGE.split()) <= 300
