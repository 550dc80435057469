"""Published data sets: equal labels in every reader, one truth, and versions that never change."""

from __future__ import annotations

import csv
import math
import os
import re
from pathlib import Path

import mlcroissant as mlc
import numpy as np
import pytest
from recorded import make_features
from sounds import resonances, write_wav

from ajgdata.paths import Tree
from ajgdata.pipeline import publish as publishing
from ajgdata.pipeline.fetch import fetch
from ajgdata.pipeline.publish import publish
from ajgdata.store.files import read_csv
from ajgdata.types import DataError

#: Texts that a reader can take for a missing value, a number, a truth value or a date.
AMBIGUOUS = (
    *("NA", "None", "null", "nan", "NaN", "N/A", "n/a", "<NA>", "#N/A", "none", "-", "."),
    *("01", "1", "1.0", "007", "1e5", "0x10", "1_000", "inf", "-inf", "+5", "1,5", "0b1", "12%"),
    *("TRUE", "False", "yes", "no", "2024-01-02", "2024-01-02T03:04:05Z", "03:04", "02.01.2024"),
    *('say "x"', "it's; a | b", "#1", "=1+1", "@x", "ä", "[1]", '{"a": 1}'),
)


def write_table(path: Path, rows: list[dict[str, str]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


@pytest.fixture
def build(paths):
    """Compute the feature file of a data set, as the workflow does."""

    def run(dataset: str = "mine") -> None:
        make_features(paths, dataset)

    return run


@pytest.fixture
def edit(paths):
    """Change rows of recordings.csv, as a person does: `change` gets the list of rows."""

    def run(change, session: str = "src") -> None:
        path = paths.recordings_file("mine", session)
        rows = read_csv(path)[1]
        change(rows)
        write_table(path, rows)

    return run


@pytest.fixture
def mine(ajgdata, build, src):
    """A data set of three cubes and three balls with its features; its files are `<n>_<label>`."""
    for number, label in enumerate(("cube", "ball")):
        for grasp in range(1, 4):
            write_wav(src / f"{grasp + 3 * number}_{label}.wav", resonances(number, grasp))
    assert ajgdata("import", src, "--dataset", "mine").code == 0
    build()


def contents(root: Path) -> dict[str, bytes]:
    return {str(p.relative_to(root)): p.read_bytes() for p in root.rglob("*") if p.is_file()}


# --- every reader of the card gives equal labels


def examples(tree: Tree) -> dict[str, str]:
    """Programs of the dataset card by the library that they import first."""
    programs = re.findall(r"^```python\n(.*?)^```$", (tree / tree.README).read_text(), re.S | re.M)
    return {re.match(r"import (\w+)", program)[1]: program for program in programs}


def run_example(program: str) -> dict[str, object]:
    names: dict[str, object] = {}
    exec(compile(program, "README.md", "exec"), names)
    return names


def read_xarray(program):
    features = run_example(program)["features"]
    columns = [name for name, array in features.coords.items() if array.dims == ("recording",)]
    rows = zip(*(features[name].values.tolist() for name in columns), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]


def read_pandas(program):
    return run_example(program)["labels"].to_dict("records")


def read_hugging_face(program):
    names = run_example(program)
    recordings = names["recordings"].cast_column("audio", names["datasets"].Value("string"))
    rows = [dict(row) for row in recordings]
    return [{**row, "file_name": os.path.relpath(row.pop("audio"))} for row in rows]


def read_croissant(program):
    rows = [dict(record) for record in run_example(program)["labels"]]
    return [
        {
            key.removeprefix("recordings/"): cell.decode() if isinstance(cell, bytes) else cell
            for key, cell in row.items()
        }
        for row in rows
    ]


def read_frictionless(program):
    return [row.to_dict() for row in run_example(program)["labels"].read_rows()]


READERS = {
    "xarray": read_xarray,
    "pandas": read_pandas,
    "datasets": read_hugging_face,
    "mlcroissant": read_croissant,
    "frictionless": read_frictionless,
}


def label(cell: object) -> str | float | None:
    """A cell as text or number; None if it is missing (also NaN, and the empty text of netCDF)."""
    if cell is None or cell == "" or (isinstance(cell, float) and math.isnan(cell)):
        return None
    return cell if isinstance(cell, str) else float(cell)


@pytest.fixture(scope="module", autouse=True)
def _hugging_face_is_offline(tmp_path_factory):
    """The library reads these settings when it is imported."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HF_HUB_OFFLINE", "1")
        patch.setenv("HF_DATASETS_OFFLINE", "1")
        patch.setenv("HF_HOME", str(tmp_path_factory.mktemp("hugging_face")))
        yield


@pytest.mark.filterwarnings("ignore")  # of the readers
def test_every_example_of_the_card_reads_equal_labels(
    ajgdata, paths, src, build, tmp_path, monkeypatch
):
    rows = []
    for number, text in enumerate(AMBIGUOUS):
        write_wav(src / f"r{number}.wav", resonances(number % 3, number, frames=4096))
        rows.append(
            {
                "name": f"r{number}",
                "day": f"day{number % 2 + 1}",
                "plate": text,
                "tag": ("null", "x")[number % 2],
                "code": f"0{number % 10}",
                "digits": str(number),
                "date": "2024-01-02",
                "number_on_day1": (str(number), "x")[number % 2],
                "never": "",
                "rarely": "" if number else "NA",
                "switch": ("TRUE", "False")[number % 2],
                "dur_ms": "" if number == 3 else repr(number / 3 + 1e-7),
            }
        )
    write_table(src / "labels.csv", rows)
    table = ("--table", "labels.csv", "--file", "{name}.wav", "--session", "{day}")
    ajgdata("import", src, "--dataset", "mine", *table, "--target", "plate", "--target", "dur_ms")
    config = paths.dataset("mine")
    text = config.read_text().replace("kind: regression", "kind: regression\n    unit: ms")
    config.write_text(re.sub(r"\n    missing:\n(    - .*\n)+", "\n", text))
    assert "unit: ms" in text
    build()
    tree = Tree(tmp_path / "published")
    assert publish(paths, "mine", tree.root).recordings == len(AMBIGUOUS)
    original = {
        row["recording_id"]: row
        for session in ("day1", "day2")
        for row in read_csv(paths.recordings_file("mine", session))[1]
    }
    columns = set(rows[0]) - {"name", "day"}
    expected = {
        name: {column: label(row[column]) for column in columns} for name, row in original.items()
    }
    for row in expected.values():
        row["dur_ms"] = None if row["dur_ms"] is None else float(row["dur_ms"])
    assert {row["plate"] for row in expected.values()} == set(AMBIGUOUS)
    monkeypatch.chdir(tree.root)
    programs = examples(tree)
    assert programs.keys() == READERS.keys()
    files = {row["recording"]: row["file_name"] for row in read_csv(tree / tree.METADATA)[1]}
    for library, program in programs.items():
        result = READERS[library](program)
        labels = {
            row["recording"].partition("/")[2]: {column: label(row[column]) for column in columns}
            for row in result
        }
        assert labels == expected, library
        if library != "xarray":  # a feature file does not name files
            assert {row["recording"]: row["file_name"] for row in result} == files


@pytest.mark.filterwarnings("ignore")  # of the readers
def test_every_example_of_the_card_reads_segments_as_files(
    ajgdata, paths, src, build, tmp_path, monkeypatch
):
    sounds = [resonances(number % 2, number, frames=22_050) for number in range(6)]
    write_wav(src / "long.wav", np.concatenate(sounds))
    lines = [f"{number / 2}\t{(number + 1) / 2}\t{'ab'[number % 2]}" for number in range(6)]
    (src / "long.txt").write_text("\n".join(lines))
    ajgdata("import", src, "--dataset", "mine", "--segments", "track")
    build()
    tree = Tree(tmp_path / "published")
    assert publish(paths, "mine", tree.root).recordings == 6
    expected = {
        f"src/long_{number + 1}": ("ab"[number % 2], number / 2, (number + 1) / 2)
        for number in range(6)
    }
    monkeypatch.chdir(tree.root)
    for library, program in examples(tree).items():
        rows = READERS[library](program)
        cells = {
            row["recording"]: (row["label"], float(row["start_s"]), float(row["end_s"]))
            for row in rows
        }
        assert cells == expected, library
        if library != "xarray":
            names = {row["recording"]: row["file_name"] for row in rows}
            assert names == {name: f"audio/{name}.wav" for name in expected}
    content = mlc.Dataset(str(tree / tree.CROISSANT)).records("audio")
    assert len(list(content)) == 6


def test_a_fetched_data_set_has_the_published_labels(ajgdata, paths, src, build, tmp_path, rows):
    table = []
    for number, text in enumerate(("NA", "None", "01", "1")):
        for repeat in range(2):
            name = f"r{number}{repeat}"
            write_wav(src / f"{name}.wav", resonances(number, repeat))
            table.append({"name": name, "plate": text})
    write_table(src / "labels.csv", table)
    options = ("--table", "labels.csv", "--file", "{name}.wav", "--target", "plate")
    ajgdata("import", src, "--dataset", "mine", *options)
    build()
    publish(paths, "mine", tmp_path / "published")
    fetch(paths, str(tmp_path / "published"), name="fetched")
    expected = {row["name"]: row["plate"] for row in table}
    assert {row["recording_id"]: row["plate"] for row in rows("fetched")} == expected


def test_a_folder_of_an_older_version_without_parquet_is_fetched(mine, paths, tmp_path, rows):
    from ajgdata.store.publishing.archive import checksums_bytes

    tree = Tree(tmp_path / "published")
    publish(paths, "mine", tree.root)
    (tree / "metadata.parquet").unlink()
    (tree / tree.SUMS).write_bytes(checksums_bytes(tree.root))
    assert fetch(paths, str(tree.root), name="old").recordings == 6
    assert [row["label"] for row in rows("old")] == [row["label"] for row in rows("mine")]


# --- one truth


def relabel(rows):
    for row in rows[:2]:
        row["label"] = "ball"


def reject(rows):
    rows[0]["quality"] = "reject"


def regrasp(rows):
    rows[1]["grasp_id"] = "7"


def clip(rows):
    rows[2]["quality"] = "clipped"


def rename_object(rows):
    rows[0]["object"] = "box"


def renumber(rows):
    rows[0]["sample"] = "3"


def remove(rows):
    del rows[0]


def add_column(rows):
    for row in rows:
        row["colour"] = "red"


def other_bytes(rows):
    rows[0]["sha256"] = "0" * 64


CHANGES = {
    "label": (relabel, r"2 labels of label, first src/1_cube: 'cube' -> 'ball'"),
    "rejected": (reject, r"1 recording rejected, first src/1_cube"),
    "grasp": (regrasp, r"1 value of grasp_id, first src/2_cube: 'src/2_cube' -> 'src/7'"),
    "quality": (clip, r"1 value of quality, first src/3_cube: 'ok' -> 'clipped'"),
    "object": (rename_object, r"1 label of object, first src/1_cube: '.*' -> 'box'"),
    "sample": (renumber, r"1 value of sample, first src/1_cube: '0' -> '3'"),
    "removed": (remove, r"1 recording removed, first src/1_cube"),
    "column": (add_column, r"column colour added"),
    "bytes": (other_bytes, r"1 audio file with different content, first src/1_cube"),
}


@pytest.mark.parametrize("name", CHANGES)
def test_a_change_after_the_features_is_not_published(mine, paths, ajgdata, edit, name):
    change, message = CHANGES[name]
    assert ajgdata("publish", "mine").code == 0
    folder = paths.published("mine")
    before = contents(folder)
    edit(change)
    stopped = ajgdata("publish", "mine")
    assert stopped.code == 1
    assert re.search(message, stopped.text)
    assert "ajgdata run mine" in stopped.text
    assert contents(folder) == before
    assert [path.name for path in folder.parent.glob(".*.tmp")] == []


def test_an_added_recording_is_not_left_out_silently(mine, paths, ajgdata, src):
    write_wav(src / "7_ball.wav", resonances(1, 9))
    ajgdata("import", src, "--dataset", "mine")
    stopped = ajgdata("publish", "mine")
    assert stopped.code == 1
    assert "1 recording added, first src/7_ball" in stopped.text
    assert not paths.published("mine").exists()


def test_a_session_without_recordings_does_not_prevent_publishing(mine, paths, ajgdata, build):
    header = paths.recordings_file("mine", "src").read_text(encoding="utf-8").splitlines()[0]
    paths.session("mine", "day2").mkdir()
    paths.session_file("mine", "day2").write_text("session_id: day2\nsource: import\n")
    paths.recordings_file("mine", "day2").write_text(f"{header}\n")
    build()
    printed = ajgdata("publish", "mine")
    assert printed.code == 0, printed.text
    paths.session("mine", "day2").rename(paths.root / "elsewhere")
    stopped = ajgdata("publish", "mine")
    assert stopped.code == 1
    assert "1 recording removed, first day2/*" in stopped.text


def test_a_recording_that_is_no_longer_rejected_is_not_left_out(mine, ajgdata, edit, build):
    edit(reject)
    build()
    edit(lambda rows: rows[0].update(quality="ok"))
    stopped = ajgdata("publish", "mine")
    assert stopped.code == 1
    assert "1 recording no longer rejected, first src/1_cube" in stopped.text


def test_a_quarantined_recording_that_was_removed_does_not_count(mine, ajgdata, edit, build):
    edit(reject)
    build()
    edit(remove)
    stopped = ajgdata("publish", "mine")
    assert stopped.code == 1
    assert "1 recording removed, first src/1_cube" in stopped.text


def test_a_changed_definition_of_a_target_is_not_published(mine, paths, ajgdata):
    config = paths.dataset("mine")
    changed = config.read_text().replace(
        "kind: classification", "kind: classification\n    description: shape"
    )
    config.write_text(changed)
    stopped = ajgdata("publish", "mine")
    assert stopped.code == 1
    assert "definition of label in dataset.yaml" in stopped.text


def test_features_that_a_run_replaces_meanwhile_are_not_published(
    mine, paths, ajgdata, monkeypatch
):
    def replace_then_copy(source, target):
        source.write_bytes(b"of a later run")
        copy(source, target)

    copy = publishing.copy
    monkeypatch.setattr(publishing, "copy", replace_then_copy)
    stopped = ajgdata("publish", "mine")
    assert stopped.code == 1
    assert "changed while it was read" in stopped.text
    assert not paths.published("mine").exists()


def test_a_quarantine_of_another_run_is_not_published(mine, paths, ajgdata, edit, build):
    features = paths.features("mine").read_bytes()
    edit(reject)
    build()
    paths.features("mine").write_bytes(features)  # still has the rejected recording
    stopped = ajgdata("publish", "mine")
    assert stopped.code == 1
    assert "1 recording quarantined, first src/1_cube" in stopped.text


def test_the_card_counts_what_was_left_out(mine, paths, edit, build):
    edit(reject)
    build()
    done = publish(paths, "mine", paths.published("mine"))
    assert (done.recordings, done.left_out) == (5, 1)
    card = (done.folder / Tree.README).read_text()
    assert "1 recording was left out" in card
    assert "src/1_cube: quality is 'reject'" in card


def test_a_data_set_without_usable_recordings_is_one_line(mine, ajgdata, edit, build):
    edit(lambda rows: [row.update(quality="reject") for row in rows])
    build()
    stopped = ajgdata("publish", "mine")
    assert stopped.code == 1
    assert "has no usable recording" in stopped.text
    assert stopped.err.count("\n") == 1


# --- a published version never changes


def set_version(paths, version: str) -> None:
    path = paths.dataset("mine")
    path.write_text(f"{path.read_text()}version: {version}\n")


def test_changed_labels_need_a_new_version(mine, paths, ajgdata, edit, build):
    assert ajgdata("publish", "mine").code == 0
    tree = Tree(paths.published("mine"))
    before = contents(tree.root)
    edit(relabel)
    build()
    stopped = ajgdata("publish", "mine")
    assert stopped.code == 1
    assert "version 1.0.0 is published with other content" in stopped.text
    assert "2 labels of label, first src/1_cube: 'cube' -> 'ball'" in stopped.text
    assert "new `version`" in stopped.text
    assert stopped.err.count("\n") == 1
    assert contents(tree.root) == before
    set_version(paths, "1.1.0")
    assert ajgdata("publish", "mine").code == 0
    labels = [row["label"] for row in read_csv(tree / tree.METADATA)[1]]
    assert labels == ["ball", "ball", "cube", "ball", "ball", "ball"]


def test_recordings_and_the_data_set_config_belong_to_a_version(mine, paths, ajgdata, src, build):
    ajgdata("publish", "mine")
    write_wav(src / "7_ball.wav", resonances(1, 9))
    ajgdata("import", src, "--dataset", "mine")
    config = paths.dataset("mine")
    config.write_text(f"{config.read_text()}licence: CC0-1.0\n")
    build()
    stopped = ajgdata("publish", "mine")
    assert stopped.code == 1
    assert "1 recording added, first src/7_ball" in stopped.text
    assert "licence in dataset.yaml" in stopped.text


def test_other_features_need_a_new_version(mine, paths, ajgdata, build):
    ajgdata("publish", "mine")
    config = paths.dataset("mine")
    config.write_text(f"{config.read_text()}features:\n  window: 1024\n")
    build()
    stopped = ajgdata("publish", "mine")
    assert stopped.code == 1
    assert "dimensions of the features" in stopped.text


def test_a_session_that_is_described_differently_needs_a_new_version(mine, paths, ajgdata, build):
    ajgdata("publish", "mine")
    path = paths.session_file("mine", "src")
    text = re.sub(r"^notes:.*$", "notes: with the door open", path.read_text(), flags=re.M)
    path.write_text(text)
    build()
    stopped = ajgdata("publish", "mine")
    assert stopped.code == 1
    assert "notes in sessions/src/session.yaml" in stopped.text


def test_equal_content_is_published_again_and_missing_files_are_restored(mine, paths, ajgdata):
    ajgdata("publish", "mine")
    tree = Tree(paths.published("mine"))
    before = contents(tree.root)
    (tree / tree.SUMS).unlink()  # as Snakemake did before a job
    (tree / "metadata.parquet").unlink()  # as in folders of older versions
    assert ajgdata("publish", "mine").code == 0
    assert contents(tree.root) == before


def test_an_incomplete_folder_is_replaced(mine, paths, ajgdata, edit, build):
    ajgdata("publish", "mine")
    tree = Tree(paths.published("mine"))
    (tree / tree.DECLARATION).unlink()
    edit(relabel)
    build()
    assert ajgdata("publish", "mine").code == 0


def test_a_damaged_published_folder_is_not_replaced_silently(mine, paths, ajgdata):
    ajgdata("publish", "mine")
    (paths.published("mine") / Tree.FEATURES).write_bytes(b"damaged")
    stopped = ajgdata("publish", "mine")
    assert stopped.code == 1
    assert "cannot be compared with the data set to publish" in stopped.text


def test_another_data_set_in_the_folder_stays(mine, paths, ajgdata, build, src, tmp_path):
    ajgdata("import", src, "--dataset", "other")
    build("other")
    ajgdata("publish", "mine", "--out", tmp_path / "out")
    stopped = ajgdata("publish", "other", "--out", tmp_path / "out")
    assert stopped.code == 1
    assert "contains the published data set 'mine', not 'other'" in stopped.text


# --- names of columns that a published data set cannot have


def hugging_face_folder(src: Path, *extra: str) -> None:
    rows = []
    for number, form in enumerate(("cube", "ball")):
        for repeat in range(3):
            name = f"clips/{number}{repeat}.wav"
            write_wav(src / name, resonances(number, repeat))
            row = {"file_name": name, "label": form, "split": "train", "audio": name}
            rows.append({**row, "time": "0.25", "profile_name": "x", **dict.fromkeys(extra, "x")})
    write_table(src / "metadata.csv", rows)


HUGGING_FACE = ("--table", "metadata.csv", "--file", "{file_name}", "--target", "label")


def test_the_import_names_all_columns_that_cannot_be_published(ajgdata, src):
    hugging_face_folder(src, "left_file_name")
    imported = ajgdata("import", src, "--dataset", "mine", *HUGGING_FACE)
    assert imported.code == 0
    note = next(line for line in imported.text.split("note ") if "cannot be published" in line)
    assert all(name in note for name in ("audio", "file_name", "left_file_name", "split"))
    assert "rename or delete these columns in each recordings.csv" in note
    assert "profile_name" not in note and "time" not in note


def test_publish_names_all_columns_at_once(ajgdata, paths, src, build):
    hugging_face_folder(src, "left_file_name")
    ajgdata("import", src, "--dataset", "mine", *HUGGING_FACE)
    build()
    with pytest.raises(DataError) as stopped:
        publish(paths, "mine", paths.published("mine"))
    named = re.findall(r"'(\w+)' \(", str(stopped.value))
    assert named == ["audio", "file_name", "left_file_name", "split"]
    assert not paths.published("mine").exists()


def test_renamed_columns_are_published(ajgdata, paths, src, build):
    hugging_face_folder(src)
    table = src / "metadata.csv"
    header, _, body = table.read_text().partition("\n")
    header = header.replace("file_name,", "source_file,").replace("split,audio", "part,clip")
    table.write_text(f"{header}\n{body}")
    options = (*HUGGING_FACE[:3], "{source_file}", *HUGGING_FACE[4:])
    imported = ajgdata("import", src, "--dataset", "mine", *options)
    assert "cannot be published" not in imported.text
    build()
    assert publish(paths, "mine", paths.published("mine")).recordings == 6
