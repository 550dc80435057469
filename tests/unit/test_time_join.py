"""A recording gets the nearest row in time, exactly up to the tolerance, or a reason."""

from decimal import Decimal
from pathlib import Path

import pytest

from ajgdata.store.file_segments import FilePart
from ajgdata.store.time_join import join_by_time, parse_time
from ajgdata.types import DataError, JoinSettings

NOON = "1768478400"  # 2026-01-15T12:00:00Z


@pytest.mark.parametrize(
    ("text", "offset", "seconds"),
    [
        (NOON, "", NOON),
        (f" {NOON}.250 ", "", f"{NOON}.25"),
        ("-0.5", "", "-0.5"),
        ("1.7684784e9", "", NOON),
        ("2026-01-15T12:00:00Z", "", NOON),
        ("2026-01-15T13:00:00+01:00", "", NOON),
        ("2026-01-15 12:00:00.000001+00:00", "", f"{NOON}.000001"),
        ("20260115T120000Z", "", NOON),
        ("20260115_120000", "Z", NOON),
        ("2026-01-15T12:00:00", "-05:00", "1768496400"),
        ("2026-01-15T12:00:00Z", "-05:00", NOON),  # its own offset counts
        ("1969-12-31T23:59:59.5Z", "", "-0.5"),
    ],
)
def test_times_are_exact_seconds(text, offset, seconds):
    assert parse_time(text, offset) == Decimal(seconds)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "there is no time"),
        ("2026-01-15T12:00:00", "has no time zone: set join.utc_offset"),
        ("2026-01-15", "has no time of day"),
        ("1768478400000", "is too large for seconds"),
        ("20260115120000", "is too large for seconds"),
        ("NaN", "is neither a number of seconds nor ISO 8601"),
        ("1_0", "is neither a number of seconds nor ISO 8601"),
        ("15.01.2026 12:00", "is neither a number of seconds nor ISO 8601"),
    ],
)
def test_other_texts_are_no_times(text, problem):
    with pytest.raises(ValueError, match=problem):
        parse_time(text)


def joined(tmp_path, table, times, **settings):
    (tmp_path / "robot.csv").write_text(table)
    keys = {"table": "robot.csv", "time": "t", "recording_time": "time", "tolerance_s": 0.5}
    parts = {FilePart(Path(f"{name}.wav")): text for name, text in times.items()}
    return join_by_time(tmp_path, parts, JoinSettings.model_validate(keys | settings))


def x_of(result):
    return {part.path.stem: cells["x_m"] for part, cells in result.cells.items()}


def test_the_nearest_row_of_an_unsorted_table_is_joined(tmp_path):
    table = "t,x_m,note\n30.2,0.3,c\n10.1,0.1,a\n19.8,0.2,b\n20.3,9,far\n"
    result = joined(tmp_path, table, {"a": "10", "b": "20", "c": "30"}, columns=["x_m"])
    assert x_of(result) == {"a": "0.1", "b": "0.2", "c": "0.3"}
    assert list(result.cells[FilePart(Path("a.wav"))]) == ["x_m"]
    assert result.missing == [] and result.notes == []


def test_the_edge_of_the_tolerance_is_joined_exactly(tmp_path):
    # In binary floating point, 1768478400.3 - 1768478400 is 0.2999999523162842.
    table = f"t,x_m\n{NOON}.0,1\n"
    times = {"edge": f"{NOON}.3", "over": f"{NOON}.3000001", "before": "1768478399.7"}
    result = joined(tmp_path, table, times, tolerance_s=0.3)
    assert x_of(result) == {"before": "1", "edge": "1"}
    ((name, reason),) = result.missing
    assert name == "over.wav (nearest row: 0.3000001 s)"
    assert reason == "no row of robot.csv is within 0.3 s; its joined columns are empty"


def test_two_rows_at_the_same_distance_are_ambiguous_unless_they_are_equal(tmp_path):
    table = "t,x_m\n9.75,1\n10.25,2\n19.75,3\n20.25,3\n30,4\n30.0,5\n40,6\n40.00,6\n"
    result = joined(tmp_path, table, {"a": "10", "b": "20", "c": "30", "d": "40"})
    assert x_of(result) == {"b": "3", "d": "6"}
    reason = "several different rows of robot.csv are equally near; its joined columns are empty"
    assert result.missing == [("a.wav (lines 2, 3)", reason), ("c.wav (lines 6, 7)", reason)]
    assert result.notes == [("robot.csv", "2 rows have the time of another row")]


def test_unix_seconds_and_iso_8601_are_one_clock(tmp_path):
    table = "t,x_m\n2026-01-15T13:00:00.1+01:00,1\n"
    assert x_of(joined(tmp_path, table, {"a": NOON})) == {"a": "1"}


def test_a_row_of_several_recordings_is_noted_and_a_recording_without_time_is_listed(tmp_path):
    result = joined(tmp_path, "t,x_m\n10,1\n", {"a": "9.9", "b": "10.1", "c": ""})
    assert x_of(result) == {"a": "1", "b": "1"}
    assert result.notes == [("robot.csv", "1 row is joined to several recordings each")]
    assert result.missing == [("c.wav", "there is no time; its joined columns are empty")]


@pytest.mark.parametrize(
    ("table", "settings", "message"),
    [
        ("time,x_m\n10,1\n", {}, "robot.csv: has no column 't'"),
        ("t,x_m\n10,1\n", {"columns": ["y_m"]}, "has no column 'y_m'"),
        ("t,x_m\n10,1\nnever,2\n", {}, r"robot.csv:3: t: 'never' is neither"),
        ("t,x_m\n", {}, "has no rows"),
    ],
)
def test_a_table_that_cannot_be_joined_is_refused(tmp_path, table, settings, message):
    with pytest.raises(DataError, match=message):
        joined(tmp_path, table, {"a": "10"}, **settings)


def test_a_measured_latency_is_subtracted_from_the_times_of_recordings(tmp_path):
    table = "t,x\n10,1\n10.3,2\n"
    assert joined(tmp_path, table, {"a": "10.4"}).cells[FilePart(Path("a.wav"))] == {"x": "2"}
    late = joined(tmp_path, table, {"a": "10.4"}, latency_s=0.3)
    assert late.cells[FilePart(Path("a.wav"))] == {"x": "1"}
    early = joined(tmp_path, table, {"a": "9.8"}, latency_s=-0.5, tolerance_s=0)
    assert early.cells[FilePart(Path("a.wav"))] == {"x": "2"}  # exactly, in decimals
