"""Sessions of several imports: names, folders of one name, and what prune removes."""

import doctest
import shutil

import pytest
import yaml
from sounds import resonances, write_wav

from ajgdata.store import importing, session_names
from ajgdata.store.session_names import KnownSession

PATTERN = r"(?P<label>[a-z]+)(?P<grasp>\d)\.wav"


def sound(number, seed=0):
    """A short recording."""
    return resonances(number % 2, number, seed, frames=2205)


def starter_kit(folder, seed, numbers=range(1, 5), label="x"):
    """Write recordings of two objects, named as the starter kit does."""
    for number in numbers:
        write_wav(folder / f"{number}_{'ab'[number % 2]}{label}.wav", sound(number, seed))
    return folder


def sessions(paths):
    """Return the recording_ids of each session of the data set `mine`."""
    names = {}
    for folder in sorted(paths.sessions("mine").iterdir()):
        lines = (folder / "recordings.csv").read_text(encoding="utf-8").splitlines()[1:]
        names[folder.name] = sorted(line.partition(",")[0] for line in lines)
    return names


def import_by_column(ajgdata, src, values, template="{day}"):
    """Write and import three recordings of each value, which is the session."""
    lines = ["name;label;day"]
    for number, value in enumerate(values):
        for grasp in range(3):
            name = f"r{number}{grasp}"
            write_wav(src / f"{name}.wav", sound(grasp, number))
            lines.append(f"{name};{('cube', 'ball')[grasp % 2]};{value}")
    (src / "labels.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    table = ("--table", "labels.csv", "--file", "{name}.wav", "--target", "label")
    return ajgdata("import", src, "--dataset", "mine", *table, "--session", template)


@pytest.mark.parametrize("module", [session_names, importing])
def test_examples_of_docstrings_run(module):
    results = doctest.testmod(module)
    assert results.attempted > 0
    assert results.failed == 0


@pytest.mark.parametrize(
    "values",
    [
        ("-5", "5", "20"),
        ("+5", "5", "-5"),
        ("run 1", "run_1", "run/1", "run.1"),
        ("Day", "day", "DAY"),
        ("実験一", "実験二", "опыт"),
        ("größe", "grösse", "gr_e"),
        ("a+b", "a-b", "a&b", "a,b"),
    ],
)
def test_two_values_never_become_one_session(ajgdata, src, paths, values):
    first = import_by_column(ajgdata, src, values)
    assert first.code == 0
    names = sessions(paths)
    assert len({name.casefold() for name in names}) == len(values)
    assert all(len(ids) == 3 for ids in names.values())
    before = {name: (paths.session("mine", name) / "session.yaml").read_bytes() for name in names}
    again = ajgdata("import", src, "--dataset", "mine")
    assert f"0 added, 0 changed, {3 * len(values)} unchanged" in again.text
    assert sessions(paths) == names
    for name, content in before.items():
        assert (paths.session("mine", name) / "session.yaml").read_bytes() == content


def test_changed_names_are_reported(ajgdata, src, paths):
    imported = import_by_column(ajgdata, src, ("-5", "5", "day 1"))
    assert sorted(sessions(paths)) == ["5", "day_1", "minus5"]
    assert "note session '-5': is stored as minus5" in imported.text
    assert "session '5'" not in imported.text


def test_rows_without_a_session_are_counted(ajgdata, src, paths):
    imported = import_by_column(ajgdata, src, ("a", "", "b", ""))
    assert imported.code == 3
    warning = "warning 6 of 12 rows have no session: they are one session "
    assert f"{warning}(r10.wav, r11.wav, r12.wav and 3 more)" in imported.text
    assert {name: len(ids) for name, ids in sessions(paths).items()} == {"a": 3, "b": 3, "src": 6}


def test_a_folder_within_a_folder_of_its_name_is_refused(ajgdata, src, paths):
    starter_kit(src, 1)
    starter_kit(src / "src", 2)
    refused = ajgdata("import", src, "--dataset", "mine")
    assert refused.code == 1
    assert "its files and those of its folder 'src' would be one session" in refused.text
    assert not paths.dataset("mine").exists()


def test_folders_in_other_scripts_are_sessions(ajgdata, src, paths):
    for number, name in enumerate(("実験一", "実験二", "опыт")):
        starter_kit(src / name, number)
    imported = ajgdata("import", src, "--dataset", "mine")
    assert imported.code == 0
    names = sessions(paths)
    assert len(names) == 3
    assert all(name.startswith("session-") and len(ids) == 4 for name, ids in names.items())
    texts = [
        yaml.safe_load((paths.session("mine", name) / "session.yaml").read_text("utf-8"))
        for name in names
    ]
    assert {text["imported_as"] for text in texts} == {"実験一", "実験二", "опыт"}


@pytest.mark.parametrize(("first", "second"), [("run_1", "run 1"), ("Run", "run"), ("5", "-5")])
def test_values_of_two_imports_never_become_one_session(ajgdata, tmp_path, paths, first, second):
    for number, value in enumerate((first, second)):
        folder = tmp_path / f"part{number}"
        starter_kit(folder, number)
        options = ("--pattern", r"(?P<n>\d)_(?P<label>\w+)\.wav", "--session", value)
        assert ajgdata("import", folder, "--dataset", "mine", *options).code == 0
    names = sessions(paths)
    assert len({name.casefold() for name in names}) == 2
    assert [len(ids) for ids in names.values()] == [4, 4]


def test_sessions_of_an_older_version_keep_their_names(ajgdata, src, paths):
    starter_kit(src / "größe 1", 1)
    starter_kit(src / "day 1", 2)
    ajgdata("import", src, "--dataset", "mine")
    hashed = next(name for name in sessions(paths) if name != "day_1")
    for name, old in ((hashed, "gr_e_1"), ("day_1", "day_1")):
        folder = paths.session("mine", name).rename(paths.session("mine", old))
        declared = yaml.safe_load((folder / "session.yaml").read_text("utf-8"))
        del declared["imported_as"]
        declared["session_id"] = old
        text = yaml.safe_dump(declared, allow_unicode=True)
        (folder / "session.yaml").write_text(text, encoding="utf-8")
    again = ajgdata("import", src, "--dataset", "mine")
    assert "0 added, 0 changed, 8 unchanged in 2 session(s)" in again.text
    assert sorted(sessions(paths)) == ["day_1", "gr_e_1"]


def test_the_order_of_values_does_not_change_names():
    texts = ["run 1", "run_1", "run/1", "RUN_1", "-5", "5"]
    names = session_names.stored_session_names(texts)
    assert names == session_names.stored_session_names(texts[::-1])
    known = {name: KnownSession(text) for text, name in names.items()}
    assert session_names.stored_session_names(texts, known) == names
    assert session_names.stored_session_names(["run_1"], known) == {"run_1": names["run_1"]}


def test_two_folders_of_one_name_are_not_one_session(ajgdata, src, paths):
    monday = starter_kit(src / "monday" / "wav", 1, range(1, 5))
    tuesday = starter_kit(src / "tuesday" / "wav", 2, range(5, 9))
    assert ajgdata("import", monday, "--dataset", "mine").code == 0
    before = sessions(paths)
    for choice in ("keep", "prune", "files"):
        refused = ajgdata("import", tuesday, "--dataset", "mine", "--on-change", choice)
        assert refused.code == 1
        assert refused.err.count("\n") == 1
        assert "session 'wav' has 4 recordings from another folder" in refused.text
        assert "Import the folder with --session tuesday" in refused.text
        assert "prune" not in refused.text
        assert sessions(paths) == before
    assert ajgdata("import", tuesday, "--dataset", "mine", "--session", "tuesday").code == 0
    assert {name: len(ids) for name, ids in sessions(paths).items()} == {"wav": 4, "tuesday": 4}


def test_the_proposed_session_is_new_and_quoted(ajgdata, src, paths):
    ajgdata("import", starter_kit(src / "day 1" / "wav", 1), "--dataset", "mine")
    second = starter_kit(src / "day 2" / "wav", 2, range(5, 9))
    assert "--session 'day 2' (" in ajgdata("import", second, "--dataset", "mine").text
    ajgdata("import", second, "--dataset", "mine", "--session", "day 2")
    third = starter_kit(src / "again" / "day 2" / "wav", 3, range(9, 12))
    assert "--session 'day 2_wav' (" in ajgdata("import", third, "--dataset", "mine").text
    assert sorted(sessions(paths)) == ["day_2", "wav"]


def test_a_folder_that_has_a_session_is_imported_into_it(ajgdata, src, paths):
    ajgdata("import", starter_kit(src / "monday" / "wav", 1), "--dataset", "mine")
    tuesday = starter_kit(src / "tuesday" / "wav", 2, range(5, 9))
    ajgdata("import", tuesday, "--dataset", "mine", "--session", "second day")
    forgotten = ajgdata("import", tuesday, "--dataset", "mine")
    assert forgotten.code == 1
    assert "Import the folder with --session 'second day'" in forgotten.text
    again = ajgdata("import", tuesday, "--dataset", "mine", "--session", "second day")
    assert "0 added, 0 changed, 4 unchanged" in again.text
    assert sorted(sessions(paths)) == ["second_day", "wav"]


def test_folders_with_several_sessions_get_a_template(ajgdata, src, paths):
    for week, seed in (("week1", 1), ("week2", 10)):
        for day, offset in (("mon", 0), ("tue", 1)):
            starter_kit(src / week / "wav" / day, seed + offset, range(4 * seed, 4 * seed + 4))
    assert ajgdata("import", src / "week1/wav", "--dataset", "mine").code == 0
    refused = ajgdata("import", src / "week2/wav", "--dataset", "mine")
    assert refused.code == 1
    assert "--session 'week2 {session}'" in refused.text
    options = ("--session", "week2 {session}")
    assert ajgdata("import", src / "week2/wav", "--dataset", "mine", *options).code == 0
    assert sorted(sessions(paths)) == ["mon", "tue", "week2_mon", "week2_tue"]


def test_a_second_folder_can_be_added_by_name_and_is_never_pruned(ajgdata, src, paths):
    monday = starter_kit(src / "monday" / "wav", 1, range(1, 5))
    tuesday = starter_kit(src / "tuesday" / "wav", 2, range(5, 9))
    ajgdata("import", monday, "--dataset", "mine")
    joined = ajgdata("import", tuesday, "--dataset", "mine", "--session", "wav")
    assert "4 added" in joined.text
    assert "prune" not in joined.text
    assert "prune" not in ajgdata("import", tuesday, "--dataset", "mine").text
    again = ajgdata("import", tuesday, "--dataset", "mine", "--on-change", "prune")
    assert "removed" not in again.text
    assert "1_bx: is not in this folder, but may be in another folder" in again.text
    assert len(sessions(paths)["wav"]) == 8


def test_two_days_with_equal_file_names_are_not_joined(ajgdata, src, paths):
    monday = starter_kit(src / "monday" / "wav", 1, range(1, 5))
    tuesday = starter_kit(src / "tuesday" / "wav", 2, range(1, 7))
    ajgdata("import", monday, "--dataset", "mine")
    before = sessions(paths)
    refused = ajgdata("import", tuesday, "--dataset", "mine")
    assert refused.code == 1
    assert refused.err.count("\n") == 1
    assert "none of the 6 files of" in refused.text
    assert refused.text.index("--session tuesday") < refused.text.index("--on-change files")
    assert sessions(paths) == before


def test_fewer_files_of_equal_names_propose_no_prune(ajgdata, src, paths):
    monday = starter_kit(src / "monday" / "wav", 1, range(1, 7))
    tuesday = starter_kit(src / "tuesday" / "wav", 2, range(1, 5))
    ajgdata("import", monday, "--dataset", "mine")
    for choice in ("keep", "prune"):
        second = ajgdata("import", tuesday, "--dataset", "mine", "--on-change", choice)
        assert second.code == 3
        assert "kept 1_bx: has different bytes in the folder" in second.text
        assert "prune removes" not in second.text
        assert len(sessions(paths)["wav"]) == 6


def test_a_growing_a_moved_and_an_edited_folder_are_the_same(ajgdata, src, paths):
    folder = starter_kit(src / "wav", 1, range(1, 5))
    ajgdata("import", folder, "--dataset", "mine")
    starter_kit(folder, 1, range(5, 7))
    assert "2 added, 0 changed, 4 unchanged" in ajgdata("import", folder, "--dataset", "mine").text
    moved = src / "other" / "wav"
    shutil.move(folder, moved)
    for file in sorted(moved.iterdir()):
        file.rename(moved / f"0{file.name}")
    again = ajgdata("import", moved, "--dataset", "mine")
    assert "0 added, 0 changed, 6 unchanged" in again.text
    shutil.rmtree(moved)
    edited = starter_kit(src / "wav", 7, range(1, 7))
    again = ajgdata("import", edited, "--dataset", "mine", "--on-change", "files")
    assert "0 added, 6 changed" in again.text


def test_a_row_without_a_hash_is_not_another_folder(ajgdata, src, paths):
    folder = starter_kit(src / "wav", 1, range(1, 3))
    ajgdata("import", folder, "--dataset", "mine")
    table = paths.recordings_file("mine", "wav")
    lines = [line.split(",") for line in table.read_text(encoding="utf-8").splitlines()]
    text = "\n".join(",".join([*cells[:2], "", *cells[3:]]) for cells in lines[1:])
    table.write_text(f"{','.join(lines[0])}\n{text}\n", encoding="utf-8")
    starter_kit(folder, 1, range(1, 5))
    again = ajgdata("import", folder, "--dataset", "mine")
    assert "2 added" in again.text


@pytest.mark.parametrize("options", [(), ("--reference",)])
def test_prune_with_a_narrower_pattern_removes_only_deleted_files(ajgdata, src, paths, options):
    for number, label in enumerate(("cube", "ball", "cone")):
        for grasp in (1, 2):
            write_wav(src / f"{label}{grasp}.wav", sound(number, grasp))
    command = ("import", src, "--dataset", "mine", *options)
    ajgdata(*command, "--pattern", PATTERN)
    (src / "cube2.wav").unlink()
    narrow = PATTERN.replace("[a-z]+", "cube|ball")
    listed = ajgdata(*command, "--pattern", narrow)
    assert "warning cone1: stays, because its file is in the folder" in listed.text
    assert "gone cube2: no longer in the folder; --on-change prune removes it" in listed.text
    assert "gone cone" not in listed.text
    pruned = ajgdata(*command, "--pattern", narrow, "--on-change", "prune")
    assert "1 removed" in pruned.text
    assert sessions(paths) == {"src": ["ball1", "ball2", "cone1", "cone2", "cube1"]}
    if not options:
        assert (paths.session("mine", "src") / "audio/cone1.wav").is_file()
        assert not (paths.session("mine", "src") / "audio/cube2.wav").exists()


def test_prune_finds_files_below_a_folder_named_audio(ajgdata, src, paths):
    for number, label in enumerate(("cube", "ball")):
        write_wav(src / "audio" / f"{label}1.wav", sound(number))
    pattern = rf"audio/{PATTERN}"
    command = ("import", src, "--dataset", "mine", "--reference")
    ajgdata(*command, "--pattern", pattern)
    narrow = ("--pattern", pattern.replace("[a-z]+", "cube"), "--on-change", "prune")
    pruned = ajgdata(*command, *narrow)
    assert "removed" not in pruned.text
    assert "warning audio/ball1: stays, because its file is in the folder" in pruned.text


def test_prune_with_a_shorter_table_or_another_template_removes_nothing(ajgdata, src, paths):
    import_by_column(ajgdata, src, ("a", "a"), template="all")
    table = src / "labels.csv"
    lines = table.read_text(encoding="utf-8").splitlines()
    table.write_text("\n".join(lines[:4]) + "\n", encoding="utf-8")
    pruned = ajgdata("import", src, "--dataset", "mine", "--on-change", "prune")
    assert "removed" not in pruned.text
    assert "warning r10: stays, because its file is in the folder" in pruned.text
    assert len(sessions(paths)["all"]) == 6


def test_prune_keeps_a_renamed_file_that_the_pattern_does_not_read(ajgdata, src, paths):
    starter_kit(src, 1)
    ajgdata("import", src, "--dataset", "mine")
    (src / "1_bx.wav").rename(src / "spare.wav")
    pruned = ajgdata("import", src, "--dataset", "mine", "--on-change", "prune")
    assert "removed" not in pruned.text
    assert len(sessions(paths)["src"]) == 4
    (src / "spare.wav").unlink()
    assert "1 removed" in ajgdata("import", src, "--dataset", "mine", "--on-change", "prune").text
