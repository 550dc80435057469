"""`ajgdata export NAME --parquet FILE`: the table that pandas reads is that of load_features."""

import json
import sys

import numpy as np
import pandas as pd
import pyarrow.parquet
import pytest
from published import make_project, remake
from worlds import assert_one_line

import ajgdata
from ajgdata.cli import main


@pytest.fixture
def project(tmp_path, monkeypatch):
    project = make_project(tmp_path / "project")
    monkeypatch.setenv("AJGDATA_ROOT", str(project.root))
    monkeypatch.chdir(tmp_path)
    return project


@pytest.fixture
def export(monkeypatch, capsys):
    """Run `ajgdata export`; returns exit code, standard output and standard error."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["ajgdata", "export", *arguments])
        with pytest.raises(SystemExit) as stopped:
            main()
        printed = capsys.readouterr()
        return stopped.value.code, printed.out, printed.err

    return run


def test_pandas_reads_labels_and_features_of_load_features(project, export):
    code, out, _ = export("d", "--parquet", "d.parquet")
    assert code == 0 and "d.parquet: 12 recordings" in out and "2 excluded" in out
    table = pd.read_parquet("d.parquet")
    with ajgdata.load_features("d") as features:
        np.testing.assert_array_equal(np.stack(table["feature"]), features.feature.values)
        assert np.stack(table["feature"]).dtype == np.float32
        assert sorted(table.columns) == sorted({*features.coords, "feature"} - {"frequency"})
        for name in set(table.columns) - {"feature"}:
            values = features[name].values
            if values.dtype.kind == "U":
                assert table[name].fillna("").tolist() == values.tolist()
            else:
                np.testing.assert_array_equal(table[name], values)


def test_types_are_those_of_the_labels_and_missing_labels_are_null(project, export):
    export("d", "--parquet", "d.parquet")
    table = pyarrow.parquet.read_table("d.parquet").to_pydict()
    columns = (table["recording"], table["edge_mm"], table["object"])
    labels = {name: (edge, text) for name, edge, text in zip(*columns, strict=True)}
    assert labels["s1/take 2/5"] == (None, "01")  # no edge; a text with a leading zero
    assert labels["s1/take 1/4"] == (pytest.approx(90.1), None)  # `?` is declared as missing
    schema = pyarrow.parquet.read_schema("d.parquet")
    assert [
        str(schema.field(name).type) for name in ("sample", "edge_mm", "object", "feature")
    ] == [
        "int64",
        "double",
        "string",
        "fixed_size_list<element: float>[129]",
    ]
    assert schema.names[:5] == ["recording", "session_id", "grasp_id", "sample", "object"]
    assert schema.names[-3:] == ["flags", "sha256", "feature"]


def test_columns_have_units_and_the_feature_its_frequencies(project, export):
    export("d", "--parquet", "d.parquet")
    schema = pyarrow.parquet.read_schema("d.parquet")
    about = schema.field("edge_mm").metadata
    assert (about[b"units"], about[b"long_name"]) == (b"mm", b"length of the edge")
    frequency_hz = json.loads(schema.field("feature").metadata[b"frequency_hz"])
    with ajgdata.load_features("d") as features:
        assert frequency_hz == features.frequency.values.tolist()
    assert schema.metadata[b"data_set"] == b"d"


def test_the_same_features_give_the_same_bytes(project, export, tmp_path):
    export("d", "--parquet", "first.parquet")
    remake(project)
    export("d", "--parquet", "second.parquet")
    first = (tmp_path / "first.parquet").read_bytes()
    assert (tmp_path / "second.parquet").read_bytes() == first


def test_outdated_features_are_refused(project, export, tmp_path):
    file = project.folder("s1") / "recordings.csv"
    file.write_text(file.read_text(encoding="utf-8").replace("monday", "friday"), encoding="utf-8")
    code, _, error = export("d", "--parquet", "d.parquet")
    assert code == 1
    assert_one_line(error, "the features are outdated")
    assert not (tmp_path / "d.parquet").exists()


def test_a_data_set_without_features_is_one_line(project, export):
    project.paths.features("d").unlink()
    code, _, error = export("d", "--parquet", "d.parquet")
    assert code == 1
    assert_one_line(error, "does not exist yet. Run `ajgdata run d` first.")


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["d"], "name a task, or use --parquet FILE"),
        (["d", "edge", "--parquet", "x"], "--parquet takes only the data set and the file"),
    ],
)
def test_wrong_use_is_one_message(project, export, arguments, problem):
    code, _, error = export(*arguments)
    assert code == 2 and problem in error
