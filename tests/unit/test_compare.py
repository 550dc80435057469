"""`ajgdata compare`: changed rows of two runs, tables of several runs, and exit codes."""

import csv
import io
import json
import sys

import pytest
from json_page import assert_documented

from ajgdata.cli import main
from ajgdata.pipeline.compare_rows import results_folder
from ajgdata.store.metrics import (
    FACTS,
    KEYS,
    PREDICTION_COLUMNS,
    read_metrics,
    write_metrics,
    write_predictions,
)
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


def ended(capsys, options):
    """Run the command; return its exit code, its JSON object or rows of CSV, and its errors."""
    with pytest.raises(SystemExit) as stopped:
        main()
    printed = capsys.readouterr()
    if "--json" in options:
        content = json.loads(printed.out, parse_constant=pytest.fail)
    else:
        content = list(csv.DictReader(io.StringIO(printed.out)))
    return stopped.value.code, content, printed.err


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
        return ended(capsys, options)

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


# Tables of several runs


@pytest.fixture
def tabulate(tmp_path, monkeypatch, capsys):
    """Compare runs, given by name with their rows; returns exit code, rows or object, messages."""

    def run(runs, *options):
        monkeypatch.chdir(tmp_path)
        for name, rows in runs.items():
            write_results(tmp_path / name, rows)
        monkeypatch.setattr(sys, "argv", ["ajgdata", "compare", *runs, *options])
        return ended(capsys, options)

    return run


def cross_validation(*fold_values, **cells):
    """Return the rows of the folds of a cross-validation and of their mean."""
    rows = [cells | {"statistic": f"fold {at}", "value": v} for at, v in enumerate(fold_values)]
    mean = sum(fold_values) / len(fold_values)
    return [*rows, cells | {"statistic": "mean", "value": mean}]


def write_folds(folder, recordings):
    """Write predictions.csv in which fold i tests recording i of `recordings`."""
    rows = [
        dict.fromkeys(PREDICTION_COLUMNS[:-1], "")
        | {key: ROW[key] for key in ("dataset", "task", "model", "split")}
        | {"recording": recording, "fold": str(fold)}
        for fold, recording in enumerate(recordings)
    ]
    write_predictions(folder / "predictions.csv", rows)


def test_three_runs_are_one_table_with_a_column_per_run(tabulate):
    equal = {"metric": "mae", "value": "1"}
    runs = {
        "raw": [{"value": "2"}, equal],
        "mel": [{"value": "2.5"}, equal],
        "stft": [{"value": "1.5"}, equal, {"metric": "r2", "value": ".9"}],
    }
    code, rows, messages = tabulate(runs)
    assert code == 3
    rmse, r2 = rows
    assert (rmse["raw"], rmse["mel"], rmse["stft"], rmse["missing"]) == ("2.0", "2.5", "1.5", "")
    assert (rmse["difference: mel"], rmse["difference: stft"]) == ("0.5", "-0.5")
    assert (r2["metric"], r2["raw"], r2["stft"], r2["missing"]) == ("r2", "", "0.9", "raw, mel")
    assert (r2["difference: stft"], r2["low: stft"]) == ("", "")
    assert "3 scores in 3 runs: 2 differ" in messages
    assert "raw: 1 score missing" in messages and "mel: 1 score missing" in messages
    assert "raw: no predictions.csv, so differences have no interval" in messages
    _, rows, _ = tabulate(runs, "--all")
    assert [row["metric"] for row in rows] == ["rmse", "mae", "r2"]


def test_equal_runs_give_an_empty_table_and_exit_code_0(tabulate):
    code, rows, messages = tabulate({"a": [{}], "b": [{}], "c": [{"value": "2.5000001"}]})
    assert (code, rows) == (0, []) and "1 scores in 3 runs: 0 differ" in messages


# Gains 1, 2, 3 of three folds: mean 2, variance 1. The interval is 2 ± t sqrt((1/3 + 1/2) s²), with
# t = 4.302653, the quantile .975 of Student's t for 2 degrees of freedom (from a printed table).
REACH = 4.302653 * (5 / 6) ** 0.5


def test_an_interval_is_that_of_the_corrected_paired_test(tabulate, tmp_path):
    runs = {"a": cross_validation(20.0, 30, 40), "b": cross_validation(19.0, 28, 37)}
    for name in runs:
        write_folds(write_results(tmp_path / name, []), ["1/a", "1/b", "1/c"])
    code, rows, _ = tabulate(runs, "--wide")
    assert code == 3
    (row,) = rows  # folds are not listed
    assert float(row["difference: b"]) == -2
    assert float(row["low: b"]) == pytest.approx(-2 - REACH, rel=1e-6)
    assert float(row["high: b"]) == pytest.approx(-2 + REACH, rel=1e-6)


def test_the_interval_of_other_folds_has_both_variances(tabulate, tmp_path):
    runs = {"a": cross_validation(20.0, 30, 40), "b": cross_validation(19.0, 28, 37)}
    write_folds(write_results(tmp_path / "a", []), ["1/a", "1/b", "1/c"])
    write_folds(write_results(tmp_path / "b", []), ["1/b", "1/a", "1/c"])
    _, (row,), _ = tabulate(runs, "--wide")
    reach = REACH * (100 + 81) ** 0.5  # the variances are 100 and 81
    assert float(row["high: b"]) == pytest.approx(-2 + reach, rel=1e-6)
    assert float(row["low: b"]) == -30  # an RMSE is not below 0


def test_other_numbers_of_folds_have_no_interval(tabulate, tmp_path):
    runs = {"a": cross_validation(20.0, 30, 40), "b": cross_validation(19.0, 28)}
    for name in runs:
        write_folds(write_results(tmp_path / name, []), ["1/a", "1/b", "1/c"])
    _, (mean,), _ = tabulate(runs, "--wide")
    assert (mean["difference: b"], mean["low: b"]) == ("-6.5", "")


def test_json_of_several_runs_has_all_keys(tabulate):
    runs = {"a": [{"value": "2"}], "b": [{"value": ""}], "c": [{"metric": "r2", "grasps": "16"}]}
    code, document, messages = tabulate(runs, "--json")
    assert (code, messages) == (3, "")
    assert_documented("compare of several runs", document)
    assert document["runs"][2] == {"folder": "c", "n_missing": 1}
    rmse, r2 = document["scores"]
    assert [(run["value"], run["is_missing"]) for run in rmse["runs"]] == [
        (2.0, False),
        (None, False),
        (None, True),
    ]
    assert (r2["grasps"], r2["runs"][2]["value"], r2["runs"][2]["difference"]) == (16, 2.5, None)


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [(["a"], "name two or more runs"), (["a", "b", "a"], "a run is named twice")],
)
def test_wrong_runs_are_refused_in_one_line(monkeypatch, capsys, arguments, problem):
    monkeypatch.setattr(sys, "argv", ["ajgdata", "compare", *arguments])
    with pytest.raises(SystemExit) as stopped:
        main()
    assert stopped.value.code == 2
    assert problem in capsys.readouterr().err


def test_a_project_stands_for_its_only_run_of_selected_data_sets(tmp_path):
    run = tmp_path / "results/runs/mine"
    run.mkdir(parents=True)
    (run / "metrics.csv").touch()
    assert results_folder(tmp_path) == run
    other = tmp_path / "results/runs/other"
    other.mkdir()
    (other / "metrics.csv").touch()
    with pytest.raises(DataError, match=r"several runs.*runs/mine, .*runs/other"):
        results_folder(tmp_path)
    (tmp_path / "results/metrics.csv").touch()
    assert results_folder(tmp_path) == tmp_path / "results"
