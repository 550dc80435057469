"""Results that are outdated are never reported as current: contents decide, not times of files."""

from __future__ import annotations

import os
import warnings

import numpy as np
import pytest
from recorded import make_features
from sounds import resonances, write_wav

import ajgdata as library
from ajgdata.cli.status import WorkflowStatus, data_changes
from ajgdata.paths import Paths
from ajgdata.pipeline.plan import plan
from ajgdata.pipeline.publish import publish
from ajgdata.pipeline.run_changes import changed_during_run, correct_future_times, feature_states
from ajgdata.pipeline.run_end import end_run
from ajgdata.store.freshness import changes_since_features, tables_digest
from ajgdata.store.session_audio import check_session
from ajgdata.store.sessions import read_dataset
from ajgdata.types import DataError

NAME = "tones"


@pytest.fixture
def imported(paths, import_balls_and_cubes) -> Paths:
    """A data set of four balls and four cubes, with its features."""
    import_balls_and_cubes(NAME)
    return paths


def table(paths: Paths):
    return paths.recordings_file(NAME, "src")


def edit(paths: Paths, old: str, new: str, count: int = 1) -> None:
    """Edit recordings.csv, and give the file an older time than all results."""
    text = table(paths).read_text(encoding="utf-8")
    assert old in text
    table(paths).write_text(text.replace(old, new, count), encoding="utf-8")
    os.utime(table(paths), (1e9, 1e9))


def changes(paths: Paths) -> list[str]:
    return changes_since_features(paths, read_dataset(paths, NAME))


def without_hash(paths: Paths, rows) -> dict[str, str]:
    """Empty `sha256` of the first recording; return its row."""
    first = rows(NAME)[0]
    edit(paths, first["sha256"], "")
    return first


def test_features_of_unchanged_tables_are_up_to_date(imported):
    """New times, line ends, and another order of columns change no value."""
    assert changes(imported) == []
    text = table(imported).read_bytes().replace(b"\n", b"\r\n")
    table(imported).write_bytes(text)
    session = imported.session_file(NAME, "src")
    session.write_text("# checked\n" + session.read_text(encoding="utf-8"), encoding="utf-8")
    assert changes(imported) == []


@pytest.mark.parametrize(
    ("old", "new"),
    [(",ball", ",cube"), (",ok,", ",reject,"), ("1_ball.wav", "2_ball.wav")],
    ids=["label", "rejected", "file"],
)
def test_an_edited_table_with_an_older_time_is_a_change(imported, old, new):
    edit(imported, old, new)
    assert changes(imported) == ["session src changed"]


def test_an_edited_session_a_new_session_and_a_removed_session_are_changes(imported):
    session = imported.session_file(NAME, "src")
    session.write_text(session.read_text(encoding="utf-8") + "notes: wet\n", encoding="utf-8")
    other = imported.session(NAME, "other")
    other.mkdir()
    (other / "session.yaml").write_text("session_id: other\nsource: import\n", encoding="utf-8")
    assert changes(imported) == ["session other is new", "session src changed"]
    imported.session(NAME, "src").rename(imported.root / "elsewhere")
    assert changes(imported) == ["session other is new", "session src was removed"]


def test_settings_and_code_are_changes(imported, monkeypatch):
    file = imported.dataset(NAME)
    file.write_text(file.read_text(encoding="utf-8") + "features: {hop: 256}\n", encoding="utf-8")
    monkeypatch.setattr("ajgdata.store.freshness.features_code", lambda features: "another")
    assert changes(imported) == [
        "`features` of dataset.yaml changed",
        "the code that computes features, or a library, changed",
    ]


def test_features_without_recordings_are_compared_with_nothing(imported):
    imported.data.rename(imported.root / "elsewhere")
    assert changes(imported) == []
    with library.load_features(NAME) as features:
        assert features.sizes["recording"] == 8


def test_loading_warns_which_session_changed_and_what_to_run(imported):
    edit(imported, ",ball", ",cube")
    message = "features of tones are outdated: session src changed. Run `ajgdata run tones`."
    with pytest.warns(UserWarning) as warned, library.load_features(NAME):
        pass
    assert [str(warning.message) for warning in warned] == [message]
    with pytest.warns(UserWarning) as warned:
        library.load_recordings(NAME)
    assert [str(warning.message) for warning in warned] == [message]
    make_features(imported, NAME)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        library.load_features(NAME).close()
        library.load_recordings(NAME)


def test_publish_refuses_outdated_features_and_writes_nothing(imported):
    edit(imported, ",ok,", ",reject,")
    out = imported.root / "published"
    with pytest.raises(DataError) as refused:
        publish(imported, NAME, out)
    assert refused.value.problem.startswith("differs from the recordings of the sessions: ")
    assert refused.value.fix == "run `ajgdata run tones`, then publish again"
    assert not out.exists()


def test_a_run_reports_what_an_import_adds_meanwhile(imported, src, ajgdata):
    """The job reads the tables, then recordings are imported, then the run ends."""
    plans = plan(imported)
    before = feature_states(imported, plans)
    assert before[NAME].is_current
    assert list(changed_during_run(imported, plans, before)) == []
    write_wav(src / "9_ball.wav", resonances(0, 9))
    ajgdata("import", src, "--dataset", NAME)
    line = (
        "tones: session src changed during the run; "
        "its results are outdated, `ajgdata run tones` computes them again"
    )
    assert list(changed_during_run(imported, plans, before)) == [line]
    with pytest.raises(SystemExit) as ended:
        end_run({}, changed_during_run(imported, plans, before))
    assert ended.value.code == f"incomplete: {line}"


def test_a_run_reports_labels_that_changed_while_it_computed_the_features(imported, monkeypatch):
    plans = plan(imported)
    edit(imported, ",ball", ",cube")
    before = feature_states(imported, plans)
    assert not before[NAME].is_current
    assert list(changed_during_run(imported, plans, before)) == []  # this run computed no features

    def edited_meanwhile(folder, trusted):
        session = check_session(folder, trusted)
        edit(imported, ",ball", ",cube")
        return session

    monkeypatch.setattr("ajgdata.pipeline.feature_file.check_session", edited_meanwhile)
    make_features(imported, NAME)
    monkeypatch.undo()
    (line,) = changed_during_run(imported, plans, before)
    assert line.startswith("tones: session src changed during the run")
    assert changes(imported) == ["session src changed"]
    make_features(imported, NAME)
    assert list(changed_during_run(imported, plans, before)) == []


def test_an_empty_hash_is_an_issue(imported, ajgdata, rows):
    without_hash(imported, rows)
    printed = ajgdata("check", NAME)
    assert printed.code == 3
    assert "0 errors, 1 warning," in printed.text
    assert "warning no_sha256 src/1_ball" in printed.text
    assert "`ajgdata check tones --accept`, which also accepts all changed files" in printed.text


def test_accepting_stores_the_hash_and_the_next_change_is_reported(imported, ajgdata, rows, src):
    """The hash of an edited recording is stored, and its feature is computed again."""
    with library.load_features(NAME) as features:
        before = features.feature.sel(recording=features.recording == "src/1_ball").values
    first = without_hash(imported, rows)
    untouched = rows(NAME)[1:]
    file = imported.session(NAME, "src") / first["file"]
    write_wav(file, resonances(1, 50))
    printed = ajgdata("check", NAME, "--accept")
    assert "accepted src/1_ball: had no sha256 1 recording of tones accepted" in printed.text
    assert "no_sha256" not in printed.text
    assert rows(NAME)[0]["sha256"] not in ("", first["sha256"])
    assert rows(NAME)[1:] == untouched
    assert changes(imported) == ["session src changed"]
    make_features(imported, NAME)
    with library.load_features(NAME) as features:
        after = features.feature.sel(recording=features.recording == "src/1_ball").values
    assert not np.allclose(before, after)

    write_wav(file, resonances(0, 51))
    printed = ajgdata("check", NAME)
    assert "error changed src/1_ball" in printed.text
    assert "`ajgdata check tones --accept`" in printed.text
    assert "accepted src/1_ball: changed" in ajgdata("check", NAME, "--accept").text
    assert ajgdata("check", NAME).code == 0


def test_accepting_without_changes_writes_nothing(imported, ajgdata):
    content = table(imported).read_bytes()
    os.utime(table(imported), (1e9, 1e9))
    assert "0 recordings of tones accepted" in ajgdata("check", NAME, "--accept").text
    assert table(imported).read_bytes() == content
    assert table(imported).stat().st_mtime == 1e9


def test_accepting_needs_names_of_data_sets(imported, ajgdata, rows):
    without_hash(imported, rows)
    printed = ajgdata("check", "--accept")
    assert printed.code == 1
    assert "--accept: no data set is named" in printed.text
    assert rows(NAME)[0]["sha256"] == ""


def test_a_file_that_is_missing_is_not_accepted(imported, ajgdata, rows):
    first = without_hash(imported, rows)
    (imported.session(NAME, "src") / first["file"]).unlink()
    printed = ajgdata("check", NAME, "--accept")
    assert "not accepted src/1_ball: no such file, or a broken link" in printed.text
    assert "0 recordings of tones accepted" in printed.text
    assert printed.code == 3


DEFECTS = {
    "truncated": (lambda path: path.write_bytes(path.read_bytes()[:-500]), "is cut short"),
    "damaged": (lambda path: path.write_text("no sound"), "cannot be decoded"),
    "empty": (lambda path: path.write_bytes(b""), "the file is empty"),
    "no_samples": (lambda path: write_wav(path, resonances(0, 1)[:0]), "but no samples"),
}


@pytest.mark.parametrize("defect", DEFECTS)
def test_a_file_that_cannot_be_decoded_is_not_accepted(imported, ajgdata, rows, defect):
    """Accepting a recording without a hash does not accept a damaged one of the same data set."""
    damage, problem = DEFECTS[defect]
    without_hash(imported, rows)
    damaged = rows(NAME)[1]
    damage(imported.session(NAME, "src") / damaged["file"])
    printed = ajgdata("check", NAME, "--accept")
    assert printed.code == 3
    assert "accepted src/1_ball: had no sha256" in printed.text
    assert f"not accepted src/{damaged['recording_id']}: " in printed.text
    assert problem in printed.text
    assert "1 recording of tones accepted" in printed.text
    assert rows(NAME)[1] == damaged
    assert f"error changed src/{damaged['recording_id']}" in printed.text


def test_a_damaged_file_without_a_hash_is_not_accepted(imported, ajgdata, rows):
    first = without_hash(imported, rows)
    (imported.session(NAME, "src") / first["file"]).write_text("no sound")
    printed = ajgdata("check", NAME, "--accept")
    assert printed.code == 3
    assert "not accepted src/1_ball: cannot be decoded" in printed.text
    assert rows(NAME)[0]["sha256"] == ""


def test_a_readable_file_with_an_issue_is_accepted(imported, ajgdata, rows):
    """Another rate or number of channels is an issue of a readable file."""
    first = without_hash(imported, rows)
    stereo = np.column_stack([resonances(1, 50), resonances(1, 51)])
    write_wav(imported.session(NAME, "src") / first["file"], stereo, rate_hz=48_000)
    printed = ajgdata("check", NAME, "--accept")
    assert "1 recording of tones accepted" in printed.text
    assert "not accepted" not in printed.text
    assert printed.code == 3
    assert rows(NAME)[0]["sha256"] not in ("", first["sha256"])


def test_a_table_that_cannot_be_read_stops_what_depends_on_it(imported):
    """A folder in place of the table cannot be read, not even by an administrator."""
    table(imported).unlink()
    table(imported).mkdir()
    problem = "recordings.csv: cannot be read"
    with pytest.raises(DataError, match=problem):
        tables_digest(imported.session(NAME, "src"))
    with pytest.raises(DataError, match=problem):
        feature_states(imported, plan(imported))
    with pytest.raises(DataError, match=problem):
        data_changes(imported, [NAME])
    with pytest.warns(UserWarning, match=problem), library.load_features(NAME):
        pass


def test_status_names_a_table_without_columns(imported, ajgdata, monkeypatch):
    monkeypatch.setattr("ajgdata.cli.status.workflow_status", lambda *_: WorkflowStatus([], []))
    assert ajgdata("status").code == 0
    table(imported).write_bytes(b"\xff\xfe garbage")
    printed = ajgdata("status")
    assert printed.code == 3
    assert "tones features: session src changed" in printed.text
    assert "recordings.csv: not UTF-8 text" in printed.text


def test_times_in_the_future_become_the_present_time(imported, capsys):
    future = 4e9
    old = imported.quarantine(NAME)
    os.utime(old, (1e9, 1e9))
    for path in (imported.features(NAME), table(imported)):
        os.utime(path, (future, future))
    correct_future_times(imported, [table(imported)])
    assert imported.features(NAME).stat().st_mtime < future
    assert table(imported).stat().st_mtime < future
    assert old.stat().st_mtime == 1e9
    assert "2 files of data/ and results/ had a time in the future" in capsys.readouterr().err
