"""Differences between machines: which results are measured, and the range over variants."""

from ajgdata.paths import Paths
from ajgdata.store.files import read_yaml
from ajgdata.store.report_files import SPREAD
from benchmarks.machines import HERE, HERE_RUN, ROWS, compared, markdown

PROJECT = Paths(HERE)
ROW = ("ycb", "ycb", "object", "cross_validation", "cnn", "grouped mean")
NAME = "ycb/object/cross_validation/cnn"


def result(digest: str, value: float) -> dict:
    values = {"grouped mean": value, "grouped sd": 0.05}
    return {NAME: {"digest": digest, "values": values, "scale": 100, "unit": "%"}}


def test_the_range_is_over_all_variants_that_were_measured():
    runs = {HERE_RUN: result("a", 0.775), "A=1": result("b", 0.7625), "B=1": result("a", 0.775)}
    runs |= {"C=1": result("c", 0.78125), "D=1": {"steps": {}}}
    row = compared(ROW, runs)
    assert row == {
        "figure": "ycb", "experiment": NAME, "part": "grouped mean", "unit": "%",
        "value": 77.5, "smallest": 76.25, "largest": 78.125, "spread": 1.875,
        "variants": 3, "changed_by": ["A=1", "C=1"],
    }  # fmt: skip
    line = f"| ycb (%), `{NAME}`, grouped mean | 77.5 | 76.25 | 78.12 | 1.875 | 2 of 3 |"
    assert markdown({"rows": [row]}).splitlines()[2:] == [line]


def test_the_page_has_the_table_of_the_last_measurement():
    content = read_yaml(HERE / "reports" / SPREAD)
    assert [row["figure"] for row in content["rows"]] == [row[0] for row in ROWS]
    page = (HERE / "docs/reproducibility.md").read_text(encoding="utf-8")
    assert markdown(content) in page and content["commit"][:8] in page
