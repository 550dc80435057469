"""A second import into a data set: other days, other patterns, other channels and spellings."""

import numpy as np
import pytest
from sounds import resonances, write_wav

from ajgdata.store.sessions import list_sessions

PATTERN = r"(?P<grasp>\d+)_(?P<label>[a-z]+)\.wav"


def write(folder, names, seed):
    """Write a short recording for each name."""
    for number, name in enumerate(names):
        write_wav(folder / name, resonances(number % 2, number, seed, frames=2205))
    return folder


def day(folder, seed, count=5, first=1):
    """Write the recordings of one day, and the recording of an empty gripper that all days have."""
    names = [
        f"{number}_{('cube', 'ball')[number % 2]}.wav" for number in range(first, first + count)
    ]
    write(folder, names, seed)
    return write(folder, ["99_empty.wav"], seed=1000)


def stored_audio(paths, session):
    """Return the bytes of the audio files of a session, by path."""
    folder = paths.session("mine", session) / "audio"
    return {path.name: path.read_bytes() for path in sorted(folder.rglob("*.wav"))}


@pytest.mark.parametrize("first", [1, 21])
@pytest.mark.parametrize("choice", ["keep", "prune"])
def test_a_shared_file_does_not_join_two_days(ajgdata, src, rows, choice, first):
    monday = day(src / "mon/rec", 1)
    tuesday = day(src / "tue/rec", 2, count=6, first=first)
    command = ("import", "--dataset", "mine", "--pattern", PATTERN)
    assert ajgdata(*command, monday).code == 0
    before = rows("mine", "rec")
    refused = ajgdata(*command, tuesday, "--on-change", choice)
    assert refused.code == 1
    assert refused.err.count("\n") == 1
    assert "session 'rec' has 5 recordings from another folder, and 1 of the 7" in refused.text
    assert "Import the folder with --session tue" in refused.text
    assert "prune" not in refused.text
    assert rows("mine", "rec") == before
    assert ajgdata(*command, tuesday, "--session", "tue").code == 0
    assert len(rows("mine", "tue")) == 7


def test_a_shared_file_does_not_prune_a_named_session(ajgdata, src, rows):
    monday = day(src / "mon/rec", 1)
    tuesday = day(src / "tue/rec", 2, first=21)
    command = ("import", "--dataset", "mine", "--pattern", PATTERN, "--session", "s1")
    ajgdata(*command, monday)
    joined = ajgdata(*command, tuesday, "--on-change", "prune")
    assert "5 added" in joined.text
    assert "removed" not in joined.text
    assert len(rows("mine", "s1")) == 11
    again = ajgdata(*command, tuesday, "--on-change", "prune")
    assert "prune removes" not in again.text
    assert len(rows("mine", "s1")) == 11


def test_days_with_equal_names_and_a_shared_file_lose_nothing_by_prune(ajgdata, src, rows):
    monday = day(src / "mon/rec", 1)
    tuesday = day(src / "tue/rec", 2, count=3)
    ajgdata("import", monday, "--dataset", "mine", "--pattern", PATTERN)
    ajgdata("import", tuesday, "--dataset", "mine", "--on-change", "prune")
    assert len(rows("mine", "rec")) == 6


def test_a_folder_with_few_deleted_and_edited_files_is_the_same(ajgdata, src, rows):
    folder = day(src / "rec", 1, count=8)
    ajgdata("import", folder, "--dataset", "mine", "--pattern", PATTERN)
    (folder / "1_ball.wav").unlink()
    write(folder, ["2_cube.wav"], seed=5)
    write(folder, ["20_ball.wav"], seed=6)
    grown = ajgdata("import", folder, "--dataset", "mine", "--on-change", "prune")
    assert "1 added" in grown.text and "1 removed" in grown.text
    assert "kept 2_cube: has different bytes" in grown.text
    assert len(rows("mine", "rec")) == 9


@pytest.mark.parametrize("shared", [True, False])
def test_a_session_of_two_folders_is_never_overwritten(ajgdata, src, paths, rows, shared):
    names = [f"{number}_{('cube', 'ball')[number % 2]}.wav" for number in range(1, 5)]
    first = write(src / "n1/rec", names, seed=1)
    second = write(src / "n2/rec", [*names, "5_cube.wav"], seed=2)
    if shared:
        for folder in (first, second):
            write(folder, ["99_empty.wav"], seed=1000)
    command = ("import", "--dataset", "mine", "--pattern", PATTERN, "--session", "s1")
    assert ajgdata(*command, first).code == 0
    before = stored_audio(paths, "s1")
    for choice in ("keep", "files", "files"):
        kept = ajgdata(*command, second, "--on-change", choice)
        assert kept.code == 3
        assert kept.text.count("kept ") == 4
        assert "with another --session" in kept.text
        assert "--on-change files takes" not in kept.text
        audio = stored_audio(paths, "s1")
        assert {name: audio[name] for name in before} == before
    assert len(rows("mine", "s1")) == 5 + shared
    assert ajgdata(*command[:-1], "s2", second).code == 0


def test_a_third_folder_is_not_joined_without_its_name(ajgdata, src, rows):
    command = ("import", "--dataset", "mine", "--pattern", PATTERN)
    ajgdata(*command, day(src / "mon/rec", 1))
    tuesday = day(src / "tue/rec", 2, first=21)
    ajgdata(*command, tuesday, "--session", "rec")
    write(tuesday, ["30_cube.wav"], seed=2)
    grown = ajgdata(*command, tuesday)
    assert "1 added" in grown.text
    refused = ajgdata(*command, day(src / "wed/rec", 3, first=41))
    assert refused.code == 1
    assert "Import the folder with --session wed (--session rec adds it" in refused.text
    assert len(rows("mine", "rec")) == 12


def test_edited_files_of_one_folder_are_taken(ajgdata, src, paths):
    folder = day(src / "rec", 1)
    command = ("import", folder, "--dataset", "mine", "--pattern", PATTERN, "--session", "s1")
    ajgdata(*command)
    write(folder, ["1_ball.wav"], seed=7)
    write(folder, ["6_cube.wav"], seed=8)
    taken = ajgdata(*command, "--on-change", "files")
    assert "1 added, 1 changed, 5 unchanged" in taken.text
    assert stored_audio(paths, "s1")["1_ball.wav"] == (folder / "1_ball.wav").read_bytes()


def test_a_disjoint_pattern_on_the_same_folder_is_the_same_folder(ajgdata, src, rows):
    folder = day(src / "mon/rec", 1)
    pattern = PATTERN.replace("[a-z]+", "cube|empty")
    ajgdata("import", folder, "--dataset", "mine", "--pattern", pattern)
    second = ajgdata(
        "import", folder, "--dataset", "mine", "--pattern", pattern.replace("cube|empty", "ball")
    )
    assert "3 added" in second.text
    assert "another folder" not in second.text
    assert len(rows("mine", "rec")) == 6


def stereo(folder, first, second):
    """Write three stereo files of each of two objects; `second` returns their second channel."""
    for number in range(first, first + 6):
        sound = resonances(number % 2, number)
        label = ("cube", "ball")[number % 2]
        write_wav(folder / f"{number}_{label}.wav", np.stack([sound, second(sound)], axis=1))
    return folder


def same(sound):
    """The sound of a second microphone next to the first one."""
    return 0.9 * sound


def quiet(sound):
    """A second channel that is 40 dB quieter, with another sound."""
    return 0.01 * np.roll(sound, 400)


def test_unequal_channels_of_a_second_folder_stop_the_import(ajgdata, src, paths):
    assert ajgdata("import", stereo(src / "a", 1, same), "--dataset", "mine").code == 0
    second = stereo(src / "b", 11, quiet)
    refused = ajgdata("import", second, "--dataset", "mine")
    assert refused.code == 1
    assert refused.err.count("\n") == 1
    assert "so they are not averaged (microphone 1: level" in refused.text
    assert "Import the folder into another data set, or add --microphone mean" in refused.text
    assert list_sessions(paths, "mine") == ["a"]
    meant = ("import", second, "--dataset", "mine", "--microphone", "mean")
    assert ajgdata(*meant).code == 0
    again = ajgdata(*meant[:-2])  # nothing in the folder is new
    assert again.code == 0
    assert "0 added, 0 changed, 6 unchanged" in again.text


def test_equal_channels_of_a_second_folder_are_no_remark(ajgdata, src):
    ajgdata("import", stereo(src / "a", 1, same), "--dataset", "mine")
    second = ajgdata("import", stereo(src / "b", 11, same), "--dataset", "mine")
    assert second.code == 0
    assert "6 added" in second.text


def test_a_stereo_folder_in_a_mono_data_set_is_a_remark(ajgdata, src):
    write(src / "a", [f"{n}_{('cube', 'ball')[n % 2]}.wav" for n in range(1, 7)], seed=1)
    ajgdata("import", src / "a", "--dataset", "mine")
    second = ajgdata("import", stereo(src / "b", 11, same), "--dataset", "mine")
    assert second.code == 3
    assert "channels 11_ball.wav: has 2 channels, and the data set does not specify" in second.text
    assert "a run will quarantine it" in second.text


def test_a_mono_folder_in_a_stereo_data_set_is_a_remark(ajgdata, src):
    ajgdata("import", stereo(src / "a", 1, same), "--dataset", "mine", "--microphone", "1")
    write(src / "b", [f"{n}_{('cube', 'ball')[n % 2]}.wav" for n in range(11, 17)], seed=1)
    second = ajgdata("import", src / "b", "--dataset", "mine")
    assert second.code == 3
    remark = "channels files have: 1 channel, and other recordings of the data set have 2 channels:"
    assert remark in second.text


def test_another_microphone_is_refused_before_files_are_read(ajgdata, src, paths, monkeypatch):
    from ajgdata.pipeline import importing

    ajgdata("import", stereo(src / "a", 1, same), "--dataset", "mine", "--microphone", "1")
    monkeypatch.setattr(importing, "scan", lambda *arguments: pytest.fail("the folder was read"))
    refused = ajgdata("import", src / "a", "--dataset", "mine", "--microphone", "mean")
    assert refused.code == 1
    assert "mean is not the microphone of" in refused.text


def test_the_printed_name_of_a_session_adds_to_it(ajgdata, src, paths, rows):
    command = ("import", "--dataset", "mine", "--pattern", PATTERN)
    ajgdata(*command, day(src / "day 1", 1))
    assert list_sessions(paths, "mine") == ["day_1"]
    joined = ajgdata(*command, day(src / "other", 2, first=21), "--session", "day_1")
    assert "5 added" in joined.text
    assert "note session 'day_1': is the session of 'day 1'" in joined.text
    assert list_sessions(paths, "mine") == ["day_1"]
    assert len(rows("mine", "day_1")) == 11


def test_the_printed_name_of_a_signed_session_adds_to_it(ajgdata, src, paths):
    command = ("import", "--dataset", "mine", "--pattern", PATTERN, "--session")
    ajgdata(*command, "-5", day(src / "a", 1))
    ajgdata(*command, "minus5", day(src / "b", 2, first=21))
    assert list_sessions(paths, "mine") == ["minus5"]


def test_a_session_imported_under_this_text_has_priority_over_a_printed_name(ajgdata, src, paths):
    command = ("import", "--dataset", "mine", "--pattern", PATTERN)
    for number, name in enumerate(("day 1", "day_1")):
        ajgdata(*command, day(src / name, number + 1, first=10 * number + 1))
    names = list_sessions(paths, "mine")
    assert len(names) == 2
    ajgdata(*command, day(src / "other", 3, first=31), "--session", "day_1")
    assert list_sessions(paths, "mine") == names
    other = next(name for name in names if name != "day_1")
    assert "31_ball" in paths.recordings_file("mine", other).read_text(encoding="utf-8")


@pytest.mark.parametrize("line", ["channel: 1", "features:\n  channel: 1"])
def test_an_old_key_in_a_place_that_had_none_is_an_unknown_key(ajgdata, paths, line):
    paths.dataset("mine").parent.mkdir()
    paths.dataset("mine").write_text(f"name: mine\n{line}\n")
    refused = ajgdata("check", "mine")
    assert refused.code == 1
    assert "unknown key" in refused.text
    assert "microphone" not in refused.text


def test_the_old_key_of_the_audio_settings_is_explained(ajgdata, paths):
    paths.dataset("mine").parent.mkdir()
    paths.dataset("mine").write_text("name: mine\naudio: {channel: 1}\n")
    refused = ajgdata("check", "mine")
    assert "audio.channel was replaced by audio.microphone" in refused.text
    assert "Replace `channel: 1` by `microphone: 2`" in refused.text


@pytest.mark.parametrize(
    ("first", "second"),
    [("day 1", "day  1"), ("gr\u00f6\u00dfe", "gro\u0308\u00dfe"), ("-5", "\u22125")],
)
@pytest.mark.parametrize("pattern", ["", r"(?P<session>[^/]+)/(?P<n>\d+)_(?P<label>[a-z]+)\.wav"])
def test_folders_whose_names_look_alike_are_two_sessions(
    ajgdata, src, paths, rows, first, second, pattern
):
    names = [f"{number}_{('cube', 'ball')[number % 2]}.wav" for number in range(1, 5)]
    write(src / first, names, seed=1)
    write(src / second, names, seed=2)
    options = ("--pattern", pattern) if pattern else ()
    imported = ajgdata("import", src, "--dataset", "mine", *options)
    assert "8 added, 0 changed, 0 unchanged in 2 session(s)" in imported.text
    sessions = list_sessions(paths, "mine")
    assert [len(rows("mine", session)) for session in sessions] == [4, 4]
    again = ajgdata("import", src, "--dataset", "mine", *options)
    assert "0 added, 0 changed, 8 unchanged in 2 session(s)" in again.text
    assert list_sessions(paths, "mine") == sessions


def test_a_later_spelling_joins_a_grasp_of_several_columns(ajgdata, src, rows):
    table = ("--table", "labels.csv", "--file", "{file}.wav", "--target", "label")
    command = ("import", src, "--dataset", "mine", *table, "--grasp", "{label}/{grasp}")
    lines = ["file;label;grasp", "r0;cube;01", "r1;ball;02"]
    write(src, ["r0.wav", "r1.wav", "r2.wav"], seed=1)
    (src / "labels.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    ajgdata(*command)
    lines = [*lines, "r2;cube;1"]
    (src / "labels.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    joined = ajgdata(*command)
    assert "1 added" in joined.text
    grasps = {row["recording_id"]: row["grasp_id"] for row in rows("mine")}
    assert grasps["r2"] == grasps["r0"]
    assert grasps["r1"] != grasps["r0"]
    assert "label r" not in joined.text
