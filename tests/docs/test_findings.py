"""What ablations found gets into the documentation by a tool, and by no other way."""

import importlib.util
from pathlib import Path

import pytest

from ajgdata.ablations import ABLATIONS
from ajgdata.paths import Paths
from ajgdata.store.tables import write_tables
from ajgdata.types.table import Column, Table

ROOT = Path(__file__).parents[2]
spec = importlib.util.spec_from_file_location("findings", ROOT / "tools/findings.py")
tool = importlib.util.module_from_spec(spec)
spec.loader.exec_module(tool)

ROW = {
    "of": "size", "hypothesis": "louder is better", "change": "twice as loud", "metric": "R²",
    "model": "ridge", "before": -0.25, "before_sd": 0.11, "after": 0.5, "after_sd": 0.02,
    "gain": 0.75, "gain_low": -0.1, "gain_high": 1.6, "verdict": "not supported", "seconds": 3.0,
}  # fmt: skip


@pytest.fixture
def results(tmp_path):
    paths = Paths(tmp_path)
    judged = Table("t", "Loudness", "How loud.", tuple(Column(k, k) for k in ROW), (ROW,))
    columns = (Column("band", "Band", "Hz"), Column("ratio", "Ratio"), Column("seconds", "Time"))
    plain = Table(
        "p", "Bands", "By band.", columns, ({"band": "20–300", "ratio": -2.5e-5, "seconds": 1},)
    )
    for name in ABLATIONS:
        made_by = {"study": name, "git_commit": "a" * 40, "quick": False}
        write_tables(paths.ablation(name), [judged, plain], **made_by)
    return paths


def test_a_line_for_each_verdict_and_each_row(results):
    lines = tool.findings(results).splitlines()
    assert lines.count("### Loudness") == lines.count("### Bands") == len(ABLATIONS)
    verdict = (
        "| size | louder is better | twice as loud | R² | ridge | −0.25 ± 0.11 | 0.500 ± 0.020 "
    )
    assert f"{verdict}| −0.1 to 1.6 | not supported |" in lines
    at = lines.index("| Band, Hz | Ratio |")
    assert lines[at + 2] == "| 20–300 | −2.5 × 10⁻⁵ |"


def test_the_page_keeps_its_words_and_is_made_whole_again(results):
    text = tool.PAGE.read_text(encoding="utf-8")
    words, found = text.split(tool.BEGIN)
    assert text == tool.page(text, found.lstrip("\n"))  # nothing was added by hand after the tool
    made = tool.page(text, tool.findings(results))
    assert made.startswith(words + tool.BEGIN)
    assert "twice as loud" in made and "### Noise" not in made


def test_the_committed_tables_are_those_of_every_ablation():
    found = tool.PAGE.read_text(encoding="utf-8").split(tool.BEGIN)[1]
    heads = [line for line in found.splitlines() if line.startswith("| paper's figure")]
    assert heads == ["| " + " | ".join(tool.HEAD) + " |"] * len(ABLATIONS)
    assert "Simulated." in found and "small, for testing" not in found
