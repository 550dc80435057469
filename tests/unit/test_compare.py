"""`ajgdata compare`: removed, new and changed rows of two results folders, and exit codes."""

import csv
import io
import json
import sys

import pytest
from json_page import assert_documented

from ajgdata.cli import main
from ajgdata.store.metrics import FACTS, KEYS, read_metrics, write_metrics
from ajgdata.types import DataError

ROW = dict.fromkeys((*KEYS, *FACTS), "") | {
    "dataset": "size",
    "task": "edge",
    "experiment": "cross_validation",
    "model": "cnn",
    "split": "grouped",
    "metric": "rmse",
    "statistic": "mean",
    "value": "2.5",
}


def write_results(folder, rows):
    """Write metrics.csv with `rows`, each given by the columns that differ from ROW."""
    write_metrics(folder / "metrics.csv", [ROW | row for row in rows])
    return folder


@pytest.fixture
def compare(tmp_path, monkeypatch, capsys):
    """Compare a run of rows `old` with one of rows `new`; returns exit code, rows, summary.

    With `--json`, the object is returned instead of the rows.
    """
    monkeypatch.chdir(tmp_path)

    def run(old, new, *options):
        write_results(tmp_path / "old" / "results", old)
        write_results(tmp_path / "new", new)
        monkeypatch.setattr(sys, "argv", ["ajgdata", "compare", "old", "new", *options])
        with pytest.raises(SystemExit) as stopped:
            main()
        printed = capsys.readouterr()
        if "--json" in options:
            content = json.loads(printed.out, parse_constant=pytest.fail)
        else:
            content = list(csv.DictReader(io.StringIO(printed.out)))
        return stopped.value.code, content, printed.err

    return run


def test_removed_new_and_changed_rows_are_listed(compare):
    kept = {}
    removed = {"statistic": "fold 0"}
    new = {"metric": "r2"}
    code, rows, summary = compare([kept | {"value": "2"}, removed], [kept | {"value": "2.5"}, new])
    assert code == 3
    assert "2 rows in old, 2 in new: 1 removed, 1 new, 1 changed" in summary
    changes = [(row["change"], row["value_old"], row["value_new"]) for row in rows]
    assert changes == [("changed", "2.0", "2.5"), ("new", "", "2.5"), ("removed", "2.5", "")]
    assert float(rows[0]["relative_difference"]) == pytest.approx(0.2)  # 0.5 of 2.5


def test_json_has_the_same_rows_with_null_in_empty_cells(compare):
    old = [{"value": "2"}, {"statistic": "fold 0", "grasps": "16"}]
    new = [{"value": "2.5"}, {"metric": "r2", "value": ""}]
    code, document, message = compare(old, new, "--json")
    assert (code, message) == (3, "")
    assert_documented("compare", document)
    counts = {name: number for name, number in document.items() if name.startswith("n_")}
    assert counts == {
        "n_rows_old": 2,
        "n_rows_new": 2,
        "n_removed": 1,
        "n_new": 1,
        "n_changed": 1,
    }
    changed, added, removed = document["differences"]
    assert (changed["value_old"], changed["value_new"]) == (2.0, 2.5)
    assert changed["relative_difference"] == pytest.approx(0.2)
    assert (changed["grasps"], changed["condition"]) == (None, None)
    assert (added["metric"], added["value_old"], added["value_new"]) == ("r2", None, None)
    assert (removed["statistic"], removed["grasps"], removed["value_old"]) == ("fold 0", 16, 2.5)


def test_json_of_equal_runs_has_no_differences(compare):
    code, document, _ = compare([{}], [{}], "--json")
    assert (code, document["differences"], document["n_changed"]) == (0, [], 0)


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("2.5", "2.5000024", 0),  # 0.96e-6 of the larger value
        ("2.5", "2.5000026", 3),  # 1.04e-6
        ("-1", "1", 3),
        ("0", "1e-9", 3),
        ("inf", "inf", 0),
        ("", "", 0),  # undefined in both runs
        ("", "1", 3),
    ],
)
def test_values_are_equal_up_to_a_relative_difference(compare, old, new, code):
    assert compare([{"value": old}], [{"value": new}])[0] == code


def test_costs_and_provenance_are_not_compared(compare):
    cost = {"metric": "train_s", "statistic": "cost"}
    tables = [{"commit": "a"}, cost | {"value": "3"}], [{"commit": "b"}, cost | {"value": "4"}]
    code, rows, summary = compare(*tables)
    assert (code, rows) == (0, []) and "1 rows in old" in summary


def test_two_rows_of_one_result_are_an_error(compare):
    code, rows, message = compare([{}, {"value": "3"}], [{}])
    assert (code, rows) == (1, [])
    assert "has two rows for 'size edge cross_validation cnn grouped rmse mean'" in message


def test_numbers_of_another_version_are_refused_in_one_line(compare, tmp_path):
    old = tmp_path / "earlier"
    old.mkdir()
    (old / "metrics.csv").write_text("dataset,task,model,part,metric,statistic,value\n")
    with pytest.raises(DataError) as error:
        read_metrics(old / "metrics.csv")
    problem = "states no format; this version of ajgdata reads format 2"
    fix = "Compute it again with this version of ajgdata."
    assert str(error.value) == f"{old / 'metrics.csv'}: {problem}. {fix}"
