"""Tables of a report as CSV at full precision."""

import csv
import dataclasses

from report_samples import PAPER, sample_report
from result_samples import two_tasks

from ajgdata.experiments.base import TaskResults
from ajgdata.pipeline.exports import table_files, write_csv, write_exports
from ajgdata.report.comparison import PaperComparison, ResultCost
from ajgdata.types.table import table_of

THIRD = 1 / 3


def read(path) -> list[dict[str, str]]:
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))


def test_numbers_keep_every_digit_and_columns_their_units(tmp_path):
    table = table_of(
        "t",
        "t",
        [{"model": "a, b", "width": THIRD, "low_hz": 1e-30, "on": None}],
        model="Model",
        width="Width, mm",
        low_hz="Low, Hz",
        on="On",
    )
    write_csv(tmp_path / "t.csv", table)
    (row,) = read(tmp_path / "t.csv")
    assert list(row) == ["model", "width (mm)", "low_hz", "on"]
    assert float(row["width (mm)"]) == THIRD and float(row["low_hz"]) == 1e-30
    assert (row["model"], row["on"]) == ("a, b", "")


def with_pairs(results: TaskResults) -> TaskResults:
    """Return results whose table `predictions` has another name."""
    models = []
    for result in results.results:
        pairs = dataclasses.replace(result.tables["predictions"], name="pairs")
        models.append(dataclasses.replace(result, tables={**result.tables, "pairs": pairs}))
    return dataclasses.replace(results, results=tuple(models))


def test_tables_of_all_models_are_one_file_and_predictions_are_elsewhere():
    sizes, kinds = map(with_pairs, two_tasks())
    files = table_files(sizes)
    base = "cross-validation--size--edge"
    assert list(files) == [base, f"{base}--pairs"]
    scores = files[base].rows
    values = {(r["model"], r["split"], r["metric"], r["statistic"]): r["value"] for r in scores}
    assert values["cnn", "grouped", "rmse", "fold 1"] == 2.5
    assert values["knn", "grouped", "rmse", "mean"] == 4.0
    assert values["cnn", "grouped", "train_cpu_s", "cost"] == 3.2
    assert files[f"{base}--pairs"].column("model") == ["cnn"] * 12 + ["knn"] * 12
    pairs = table_files(kinds)["cross-validation--stones--kind--pairs"]
    assert "model" not in [column.key for column in pairs.columns]


def test_a_report_is_written_whole(tmp_path):
    comparison = PaperComparison(
        PAPER,
        "size",
        "edge",
        "simulated",
        "2.2 ± 0.3 mm",
        "CNN",
        "no: lower",
        ResultCost(3.2, 0.21),
    )
    report = dataclasses.replace(sample_report(), comparisons=(comparison,))
    tables = tmp_path / "report" / "tables"
    tables.mkdir(parents=True)
    (tables / "of-before.csv").touch()
    names = write_exports(report, two_tasks(), tables)
    assert {path.stem for path in tables.iterdir()} == set(names) and len(names) == len(set(names))
    (row,) = read(tables / "paper-comparison.csv")
    assert (row["paper"], row["agrees"], row["train_cpu_s"]) == ("2.6", "no: lower", "3.2")
    before = {path: path.read_bytes() for path in tables.iterdir()}
    write_exports(report, two_tasks(), tables)
    assert {path: path.read_bytes() for path in tables.iterdir()} == before
