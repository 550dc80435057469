"""Import of tables of features without recordings: columns, rows, sessions and feature files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from recorded import make_features

from ajgdata.paths import Paths
from ajgdata.pipeline.labelling import change_recording
from ajgdata.pipeline.review import review_list
from ajgdata.pipeline.table_import import import_table
from ajgdata.pipeline.validate import validate_dataset
from ajgdata.store.features import FeatureRows, read_store
from ajgdata.store.importing import Imported
from ajgdata.store.sessions import read_dataset, read_recordings
from ajgdata.types import DataError, DatasetSpec, ImportSettings, OnChange, TableSettings

NAMED = "not features, because their names are those of labels or of other columns"
CLASSES = ("contact", "no_contact", "edge")
COLUMNS = tuple(f"f{number:02}" for number in range(53))


def soft_finger(count: int = 30, seed: int = 0) -> pd.DataFrame:
    """Return 53 features, of which the first two determine the class, then two labels."""
    values = np.random.default_rng(seed).normal(size=(count, len(COLUMNS)))
    classes = np.arange(count) % len(CLASSES)
    values[:, 0] += 20 * (classes == 1)
    values[:, 1] += 20 * (classes == 2)
    table = pd.DataFrame(values, columns=list(COLUMNS))
    table["simplified_label"] = [CLASSES[number] for number in classes]
    table["original_label"] = [f"{CLASSES[number]}_left" for number in classes]
    return table


@pytest.fixture
def paths(tmp_path: Path) -> Paths:
    """A project without data sets."""
    (tmp_path / "datasets").mkdir()
    return Paths(tmp_path)


def taken(
    paths: Paths, table: pd.DataFrame, name: str = "day1.csv", **options: object
) -> tuple[DatasetSpec, Imported]:
    """Write a table in the format of its name, and import it into the data set `soft`."""
    file = paths.root / name
    if file.suffix == ".parquet":
        table.to_parquet(file, index=False)
    else:
        table.to_csv(file, index=False, sep="\t" if file.suffix == ".tsv" else ",")
    return import_table(paths, "soft", file, **options)  # type: ignore[arg-type]


def features(paths: Paths) -> FeatureRows:
    """Compute the features of the data set `soft`."""
    make_features(paths, "soft")
    return read_store(paths.features("soft"))


def all_remarks(result: Imported) -> dict[str, str]:
    """Return reasons by name of all types of remarks."""
    return {name: reason for remarks in result.remarks.values() for name, reason in remarks}


def test_the_feature_file_has_the_columns_of_the_table(paths: Paths) -> None:
    table = soft_finger()
    spec, result = taken(paths, table)
    store = features(paths)
    assert isinstance(spec.features, TableSettings)
    assert spec.features.columns == COLUMNS
    assert (result.added, result.is_complete) == (30, True)
    assert [axis.name for axis in store.axes] == ["column"]
    assert store.axes[0].values.tolist() == list(COLUMNS)
    assert store.feature_attrs == {"long_name": "table"}  # no unit
    assert np.array_equal(store.feature, table[list(COLUMNS)].to_numpy(np.float32))
    labels = store.columns["simplified_label"].values.tolist()
    assert labels == table.simplified_label.tolist()
    assert store.columns["table_row"].values.tolist() == list(range(1, 31))
    assert store.columns["recording"].values[0] == "day1/01"


@pytest.mark.parametrize("name", ["day1.tsv", "day1.parquet"])
def test_all_formats_give_the_same_features_and_labels(paths: Paths, name: str) -> None:
    taken(paths, soft_finger())
    csv = features(paths)
    other = Paths(paths.root / "other")
    (other.root / "datasets").mkdir(parents=True)
    taken(other, soft_finger(), name)
    store = features(other)
    assert np.array_equal(store.feature, csv.feature)
    assert store.axes[0].equals(csv.axes[0])
    for column in csv.columns:
        assert store.columns[column].values.tolist() == csv.columns[column].values.tolist()


@pytest.mark.parametrize("dtype", ["float32", "float16"])
def test_short_numbers_are_the_same_in_csv_and_parquet(paths: Paths, dtype: str) -> None:
    table = soft_finger()
    table[list(COLUMNS)] = table[list(COLUMNS)].astype(dtype)
    taken(paths, table)
    _, result = taken(paths, table, "day1.parquet", settings=ImportSettings(session="day1"))
    assert (result.added, result.changed, result.unchanged) == (0, 0, 30)


def test_the_table_is_kept_and_a_second_import_changes_nothing(paths: Paths) -> None:
    taken(paths, soft_finger())
    session = paths.session("soft", "day1")
    assert (session / "tables/day1.csv").read_bytes() == (paths.root / "day1.csv").read_bytes()
    before = {file: file.read_bytes() for file in paths.root.rglob("*") if file.is_file()}
    _, result = taken(paths, soft_finger())
    assert (result.added, result.changed, result.unchanged) == (0, 0, 30)
    assert before == {file: file.read_bytes() for file in paths.root.rglob("*") if file.is_file()}


def test_added_rows_become_new_recordings(paths: Paths) -> None:
    table = soft_finger(33)
    taken(paths, table[:30])
    _, result = taken(paths, table)
    assert (result.added, result.changed) == (3, 0)
    assert len(list(paths.session("soft", "day1").glob("tables/*"))) == 1
    assert np.array_equal(features(paths).feature, table[list(COLUMNS)].to_numpy(np.float32))


@pytest.mark.parametrize(
    ("on_change", "expected", "kept"), [(OnChange.KEEP, 0.5, 1), (OnChange.FILES, 7.0, 0)]
)
def test_on_change_decides_about_edited_values(
    paths: Paths, on_change: OnChange, expected: float, kept: int
) -> None:
    table = soft_finger()
    table.loc[4, "f05"] = 0.5
    taken(paths, table)
    table.loc[4, "f05"] = 7.0
    _, result = taken(paths, table, on_change=on_change)
    assert len(result.remarks["kept"]) == kept
    assert features(paths).feature[4, 5] == expected


def test_on_change_decides_about_labels_and_missing_rows(paths: Paths) -> None:
    table = soft_finger()
    taken(paths, table)
    table.loc[4, "simplified_label"] = "edge"
    _, kept = taken(paths, table[:29])
    assert [name for name, _ in kept.remarks["gone"]] == ["30"]
    assert "'no_contact' here, 'edge' in the folder" in kept.remarks["label"][0][0]
    taken(paths, table[:29], on_change=OnChange.LABELS)
    _, pruned = taken(paths, table[:29], on_change=OnChange.PRUNE)
    rows, _ = read_recordings(paths.session("soft", "day1"))
    assert (pruned.removed, len(rows), rows[4].labels["simplified_label"]) == (1, 29, "edge")


def test_another_table_needs_another_session(paths: Paths) -> None:
    taken(paths, soft_finger())
    with pytest.raises(DataError, match=r"has 30 recordings of another table, and none of the 30"):
        taken(paths, soft_finger(seed=1))
    taken(paths, soft_finger(seed=1), settings=ImportSettings(session="day2"))
    assert len(features(paths).feature) == 60


def test_columns_name_sessions_grasps_and_targets(paths: Paths) -> None:
    table = soft_finger()
    table["session"] = ["a"] * 15 + ["b"] * 15
    table["grasp"] = np.arange(30) // 5
    table["position_mm"] = np.arange(30.0)
    spec, result = taken(paths, table, targets=["position_mm"])
    store = features(paths)
    assert list(spec.targets) == ["position_mm"]
    assert store.columns["position_mm"].values.tolist() == list(range(30))
    assert len(set(store.columns["grasp_id"].values)) == 6
    assert set(store.columns["session_id"].values) == {"a", "b"}
    assert not [name for name in all_remarks(result) if name.endswith("grasps")]


def test_a_second_import_completes_its_options_from_dataset_yaml(paths: Paths) -> None:
    table = soft_finger().assign(point=np.arange(30) // 3)
    taken(paths, table, settings=ImportSettings(grasp="{point}"))
    other = soft_finger(seed=1).assign(point=np.arange(30) // 3)
    taken(paths, other, "day2.csv", settings=ImportSettings(session="second"))
    rows, _ = read_recordings(paths.session("soft", "second"))
    assert len({row.grasp_id for row in rows}) == 10


def test_the_import_says_what_it_assumes(paths: Paths) -> None:
    table = soft_finger()
    table["timestamp"] = np.arange(30)
    table["gain"] = 1
    remarks = all_remarks(taken(paths, table)[1])
    assert remarks["53 features"] == "columns f00 … f52"
    assert remarks[NAMED].startswith("timestamp; to use them, name all features with --feature-col")
    assert remarks["not features, because all rows have one value"].startswith("gain; ")
    assert remarks["30 grasps"].startswith("no column names the grasp, so each row is a grasp")


def test_columns_that_contain_labels_or_rows_are_no_features(paths: Paths) -> None:
    table = soft_finger()
    table["Unnamed: 0"] = np.arange(30)
    table["labelId"] = np.arange(30) % 3
    table["pointIndex"] = np.arange(30) // 5
    table["contact"] = (table.simplified_label == "contact").astype(int)
    table["step"] = 2 * np.arange(30) + 7
    table["time"] = np.random.default_rng(0).uniform(size=30)
    table["start_time"] = np.arange(30) + 0.25
    table["record_time"] = 1.7e9 + np.random.default_rng(1).permutation(30)
    table["attack_time"] = np.random.default_rng(2).uniform(size=30)
    table["x"] = np.random.default_rng(3).uniform(size=30)
    table["force"] = np.arange(30) // 3 % 4  # one force per grasp
    table["press"] = np.arange(30) // 3
    spec, result = taken(paths, table, settings=ImportSettings(grasp="{press}"))
    assert isinstance(spec.features, TableSettings)
    assert spec.features.columns == (*COLUMNS, "attack_time", "x", "force")
    notes = all_remarks(result)
    assert notes["56 features"] == "columns f00 … f52, attack_time, x, force"
    excluded = {
        NAMED: "Unnamed: 0, labelId, pointIndex, time",
        "not features, because each simplified_label has one value": "contact",
        "not features, because they count the rows": "step",
        "not features, because they are times of the rows": "start_time, record_time",
    }
    for name, columns in excluded.items():
        assert notes[name] == f"{columns}; to use them, name all features with --feature-columns"


def test_a_pattern_takes_columns_that_are_no_features_by_default(paths: Paths) -> None:
    table = soft_finger().assign(contact=np.arange(30) % 3)
    spec, _ = taken(paths, table, columns="f0.|contact")
    assert isinstance(spec.features, TableSettings)
    assert spec.features.columns == (*COLUMNS[:10], "contact")


@pytest.mark.parametrize("name", ["day1.csv", "day1.tsv"])
def test_all_texts_of_a_missing_label_are_missing(paths: Paths, name: str) -> None:
    table = soft_finger()
    table.loc[[2, 6, 9], "simplified_label"] = ["NaN", "n/a", ""]
    table.loc[[0, 1], "original_label"] = "none"
    spec, result = taken(paths, table, name)
    (warning,) = result.remarks["warning"]
    assert warning[0] == "target simplified_label"
    assert warning[1].startswith(f"3 of 30 rows have no value (first: {name}:4)")
    assert spec.targets["simplified_label"].missing == ()
    rows, _ = read_recordings(paths.session("soft", "day1"))
    assert {row.labels["simplified_label"] for row in rows} == {*CLASSES, ""}
    assert rows[0].labels["original_label"] == "none"


def test_a_pattern_chooses_the_features(paths: Paths) -> None:
    spec, _ = taken(paths, soft_finger(), columns="f0[0-4]")
    assert isinstance(spec.features, TableSettings)
    assert spec.features.columns == COLUMNS[:5]
    assert features(paths).feature.shape == (30, 5)


def test_missing_values_are_listed_and_left_out(paths: Paths) -> None:
    table = soft_finger()
    table.loc[2, "f07"] = np.nan
    table["f08"] = table["f08"].astype(object)
    table.loc[3, "f08"] = "inf"
    table.loc[6, "simplified_label"] = ""
    _, result = taken(paths, table)
    warnings = dict(result.remarks["warning"])
    assert warnings["feature f07"].startswith("1 of 30 rows has no finite number (day1.csv:4: '')")
    assert "day1.csv:5: 'inf'" in warnings["feature f08"]
    assert "1 of 30 rows has no value (first: day1.csv:8)" in warnings["target simplified_label"]
    assert not result.is_complete
    assert len(features(paths).feature) == 28
    issues = [issue for issue in validate_dataset(paths, "soft")[1] if issue.level == "error"]
    assert [issue.recording_id for issue in issues] == ["03", "04"]
    assert issues[0].problem == "day1.csv:4: column 'f07' has no finite number"


def test_equal_rows_are_copies(paths: Paths) -> None:
    table = soft_finger()
    table.loc[5] = table.loc[2]  # one class
    table.loc[7, list(COLUMNS)] = table.loc[6, list(COLUMNS)].to_numpy()  # two classes
    _, result = taken(paths, table)
    assert "day1.csv:7 repeats day1.csv:4" in dict(result.remarks["warning"])["2 rows"]
    names = [name.partition("/")[2] for name in features(paths).columns["recording"].values]
    assert sorted({f"{n:02}" for n in range(1, 31)} - set(names)) == ["06", "07", "08"]
    codes = {issue.recording_id: issue.code for issue in validate_dataset(paths, "soft")[1]}
    assert (codes["06"], codes["07"], codes["08"]) == ("copy", "two_labels", "two_labels")


def test_an_edited_table_is_detected(paths: Paths) -> None:
    taken(paths, soft_finger())
    stored = paths.session("soft", "day1") / "tables/day1.csv"
    lines = stored.read_text().splitlines()
    lines[3] = "7.5," + lines[3].partition(",")[2]
    stored.write_text("\n".join(lines))
    issues = [issue for issue in validate_dataset(paths, "soft")[1] if issue.level == "error"]
    assert [(issue.recording_id, issue.code) for issue in issues] == [("03", "changed")]
    stored.unlink()
    issues = [issue for issue in validate_dataset(paths, "soft")[1] if issue.level == "error"]
    found = {(issue.code, issue.problem) for issue in issues}
    assert len(issues) == 30 and {code for code, _ in found} == {"bad_table"}


def with_cell(row: int, column: str, value: object) -> pd.DataFrame:
    """Return a table with one other cell."""
    table = soft_finger().astype(object)
    table.loc[row, column] = value
    return table


@pytest.mark.parametrize(
    ("table", "options", "message"),
    [
        (with_cell(3, "f02", "abc"), {}, "day1.csv:5: column 'f02' has 'abc' among numbers"),
        (with_cell(3, "f02", "3,5"), {}, "day1.csv:5: column 'f02' has the decimal comma '3,5'"),
        (soft_finger()[["simplified_label"]], {}, "no column of numbers can be a feature"),
        (soft_finger()[:0], {}, "has no rows"),
        (soft_finger()[list(COLUMNS)], {}, "no label is chosen"),
        (soft_finger(), {"columns": "g.*"}, "'g.*' matches no column of day1.csv"),
        (soft_finger(), {"columns": "f0["}, "'f0[' is not valid"),
        (soft_finger(), {"columns": ".*label"}, "has 'contact' among numbers"),
        (
            soft_finger(),
            {"columns": "f.*", "targets": ["f00"]},
            "matches 'f00', which is a label or names the rows",
        ),
        (soft_finger(), {"targets": ["mass"]}, "there is no column 'mass'"),
        (
            soft_finger(),
            {"settings": ImportSettings(pattern="starter-kit")},
            "--pattern: is for recordings",
        ),
    ],
)
def test_unusable_tables_and_options_stop_the_import(
    paths: Paths, table: pd.DataFrame, options: dict[str, object], message: str
) -> None:
    with pytest.raises(DataError) as error:
        taken(paths, table, **options)
    assert message in str(error.value)
    assert "\n" not in str(error.value)
    assert not paths.dataset("soft").exists()
    assert not paths.session("soft", "day1").exists()


def test_doubled_names_of_columns_stop_the_import(paths: Paths) -> None:
    (paths.root / "day1.csv").write_text("a,a,label\n1,2,x\n3,4,y\n")
    with pytest.raises(DataError, match="needs one name per column; 2 are 'a'"):
        import_table(paths, "soft", paths.root / "day1.csv")


def test_tables_with_other_columns_stop_the_import(paths: Paths) -> None:
    taken(paths, soft_finger())
    with pytest.raises(DataError, match=r"day2.csv: has no column 'f03', and 1 other columns"):
        taken(paths, soft_finger(seed=1).drop(columns=["f03", "f09"]), "day2.csv")
    with pytest.raises(DataError, match="soft already exists, with its columns"):
        taken(paths, soft_finger(seed=1), "day2.csv", columns="f.*")
    new = soft_finger(seed=1).assign(extra=range(30)).drop(columns="original_label")
    remarks = all_remarks(taken(paths, new, "day2.csv")[1])
    assert remarks["new columns, which are labels"].startswith("extra: ")
    assert remarks["target original_label"].startswith("is not a column of day2.csv")


def test_tables_and_recordings_are_not_mixed(paths: Paths) -> None:
    taken(paths, soft_finger())
    content = yaml.safe_load(paths.dataset("soft").read_text())
    content["features"] = {"kind": "spectrum"}
    paths.dataset("soft").write_text(yaml.safe_dump(content))
    with pytest.raises(DataError, match=r"features.kind is spectrum, which is computed from rec"):
        taken(paths, soft_finger())
    make_features(paths, "soft")
    assert len(read_store(paths.features("soft")).feature) == 0
    assert "a row of a table has no waveform" in paths.quarantine("soft").read_text()


def test_a_comment_marks_a_simulated_table(paths: Paths) -> None:
    file = paths.root / "day1.csv"
    file.write_text("# simulated with a model\n" + soft_finger().to_csv(index=False))
    import_table(paths, "soft", file)
    assert features(paths).attrs["source"] == "simulated"


def test_the_written_declaration_has_its_kind(paths: Paths) -> None:
    taken(paths, soft_finger())
    assert yaml.safe_load(paths.dataset("soft").read_text())["features"]["kind"] == "table"
    assert read_dataset(paths, "soft").features.kind == "table"


def test_labels_by_hand_stay_if_another_label_of_the_table_changes(paths):
    """The file of all rows has another hash then; rows are identified by their features."""
    table = soft_finger()
    taken(paths, table, targets=["simplified_label"])
    first = "day1/" + read_recordings(paths.session("soft", "day1"))[0][0].recording_id
    change_recording(
        paths, "soft", first, "label", column="simplified_label", value="edge", reason="seen"
    )
    table.loc[5, "original_label"] = "corrected"
    taken(paths, table, on_change=OnChange.LABELS)
    rows, _ = read_recordings(paths.session("soft", "day1"))
    assert rows[0].labels["simplified_label"] == "edge"
    with pytest.raises(DataError, match="does not exist yet"):
        review_list(paths, "soft")
    features(paths)
    review = review_list(paths, "soft", task="simplified_label")
    assert review.items[0].recording == first
    assert "not searched in tables" in review.remarks[-1]
