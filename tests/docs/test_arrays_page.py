"""The blocks of docs/arrays.md run in their order and print what the page shows."""

import contextlib
import io
import re
from pathlib import Path

import pytest

PAGE = Path(__file__).resolve().parents[2] / "docs" / "arrays.md"
BLOCKS = re.findall(
    r"^```python\n(.*?)^```\n(?:\n```text\n(.*?)^```\n)?",
    PAGE.read_text(encoding="utf-8"),
    flags=re.M | re.S,
)


@pytest.fixture(scope="module")
def page() -> tuple[dict, list[tuple[str, str]]]:
    """The names that the blocks define, and the printed and the shown text of each block."""
    names: dict = {}
    texts = []
    for program, shown in BLOCKS:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(program, str(PAGE), "exec"), names)
        texts.append((printed.getvalue(), shown))
    return names, texts


def test_each_block_prints_what_the_page_shows(page):
    _, texts = page
    assert len(texts) == 7
    for printed, shown in texts:
        assert printed == shown


def test_scores_are_those_that_the_tones_have_by_design(page):
    """24 placements: the standard error of a placebo at the chance level of 50 % is 10 %."""
    names, _ = page
    scores = names["scores"]
    placebo = names["placebo_scores"]
    assert placebo["grasp"].value > 0.9
    for split in ("placement", "session"):
        assert abs(placebo[split].value - 0.5) < 3 * 0.1
        assert scores[split].value > 0.9
