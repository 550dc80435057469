"""Corrections become labels, and nothing else does."""

import pytest
from sorting_lab import BALL, CUBE, EMPTY, UNSURE, Cell, plan

from ajgdata.acquire.writer import recording_alone
from ajgdata.live.events import read_events
from ajgdata.live.learning import Learnt, learn, truths
from ajgdata.store.sessions import read_recordings, read_session, write_recordings
from ajgdata.types import DataError, DatasetSpec

SPEC = DatasetSpec.model_validate(
    {
        "name": "d",
        "targets": {"label": {"kind": "classification"}, "mass_g": {"kind": "regression"}},
        "protocol": {
            "objects": [{"name": "cube", "targets": {"label": "cube", "mass_g": 12.5}}],
        },
    }
)


@pytest.fixture
def cell(tmp_path):
    """Three objects, the second after two looks; nobody said what they are, but the last."""
    made = Cell(tmp_path)
    with made.open(plan(looks=2, sorts=3), BALL, UNSURE, UNSURE, CUBE) as sorter:
        sorter.run([""] * 3)
        sorter.log.say("truth", number=3, object="rod")
    return made


def rows(cell):
    return {row.recording_id: row for row in read_recordings(cell.folder)[0]}


def test_what_was_corrected_is_labelled_and_the_rest_is_as_it_was(cell):
    """The session of a killed run is finished by it."""
    text = (cell.folder / "session.yaml").read_text()
    (cell.folder / "session.yaml").write_text(text.replace("finished: true", "finished: false"))
    before, sounds = rows(cell), files(cell)
    known = truths(read_events(cell.log_file))
    with recording_alone(cell.folder), pytest.raises(DataError, match="another process"):
        learn(cell.folder, SPEC, "label", known)
    assert known == {3: "rod"}
    assert learn(cell.folder, SPEC, "label", known) == Learnt(labelled=1, unlabelled=3)
    after = rows(cell)
    changed = {name for name in after if after[name].quality != before[name].quality}
    assert changed == {"sort_0003_1_1"}
    row = after["sort_0003_1_1"]
    assert (row.object, row.quality, row.labels["label"]) == ("rod", "ok", "rod")
    assert (row.labels["predicted"], row.sha256) == ("cube", before["sort_0003_1_1"].sha256)
    assert files(cell) == sounds
    assert read_session(cell.folder).acquisition.finished


def files(cell):
    return {path.name: path.read_bytes() for path in (cell.folder / "audio").iterdir()}


def test_again_it_changes_nothing_and_another_correction_does(cell):
    learn(cell.folder, SPEC, "label", {3: "rod"})
    table = (cell.folder / "recordings.csv").read_bytes()
    assert learn(cell.folder, SPEC, "label", {3: "rod"}) == Learnt(0, 3)
    assert (cell.folder / "recordings.csv").read_bytes() == table
    assert learn(cell.folder, SPEC, "label", {3: "cube"}) == Learnt(1, 3)
    row = rows(cell)["sort_0003_1_1"]
    assert (row.object, row.labels["label"], row.labels["mass_g"]) == ("cube", "cube", "12.5")
    learn(cell.folder, SPEC, "label", {3: "ball"})  # whose mass nobody knows
    assert rows(cell)["sort_0003_1_1"].labels["mass_g"] == ""


def test_a_cell_that_was_filled_in_counts(cell):
    typed = [
        row.model_copy(update={"labels": {**row.labels, "label": "ball"}})
        if row.recording_id.startswith("sort_0001")
        else row
        for row in rows(cell).values()
    ]
    write_recordings(cell.folder, typed)
    assert learn(cell.folder, SPEC, "label", {}) == Learnt(labelled=1, unlabelled=3)
    assert (rows(cell)["sort_0001_1_1"].object, rows(cell)["sort_0001_1_1"].quality) == (
        "ball", "ok",
    )  # fmt: skip


def test_a_look_at_nothing_is_not_what_the_next_look_held(tmp_path):
    made = Cell(tmp_path)
    with made.open(plan(looks=2, sorts=1, nothing="again"), EMPTY, BALL) as sorter:
        sorter.run([""])
    assert learn(made.folder, SPEC, "label", {1: "rod"}) == Learnt(labelled=1, unlabelled=1)
    (nothing, ball) = (rows(made)[name] for name in ("sort_0001_1_1", "sort_0001_2_1"))
    assert (nothing.object, nothing.quality, ball.object) == ("", "reject", "rod")
