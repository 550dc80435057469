"""Publishing: the same bytes twice, everything said, and each defect found by its name."""

import dataclasses
import hashlib
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from published import (
    flip,
    make_project,
    published,
    spoil_spectra,
)

from ajgdata.paths import Tree
from ajgdata.pipeline.publish import declaration_bytes, publish
from ajgdata.store.features import Column, Shard, read_store, text_column
from ajgdata.store.files import read_csv, read_json
from ajgdata.store.publishing import archive
from ajgdata.store.publishing.table import (
    file_names,
    read_table,
    recordings_of,
    table_of,
)
from ajgdata.types import DataError, DatasetSpec


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    """A project, its tree, and what publishing said."""
    root = tmp_path_factory.mktemp("world")
    project = make_project(root / "project")
    return project, Tree(root / "tree"), published(project, root / "tree")


@pytest.fixture
def project(tmp_path):
    return make_project(tmp_path / "project")


@pytest.fixture
def tree(world, tmp_path):
    shutil.copytree(world[1].root, tmp_path / "copy")
    return Tree(tmp_path / "copy")


def contents(root: Path) -> dict[str, bytes]:
    return {str(p.relative_to(root)): p.read_bytes() for p in root.rglob("*") if p.is_file()}


def test_the_same_inputs_give_the_same_bytes(world, tmp_path):
    project, tree, _ = world
    published(project, tmp_path / "again")
    assert contents(tmp_path / "again") == contents(tree.root)


def test_sums_are_what_sha256sum_reads(world):
    done = subprocess.run(
        ["sha256sum", "--check", "--strict", "--quiet", "SHA256SUMS"],
        cwd=world[1].root,
        check=False,
    )
    assert done.returncode == 0


def test_recordings_are_the_originals_byte_for_byte(world):
    project, tree, _ = world
    _, rows = read_csv(tree / tree.METADATA)
    assert len(rows) == 12
    for row in rows:
        number = int(row["recording"][-1]) if row["recording"][-1].isdigit() else None
        content = (tree / row["file_name"]).read_bytes()
        assert hashlib.sha256(content).hexdigest() == row["sha256"]
        if number is not None:
            assert (
                content == (project.folder(row["session_id"]) / f"audio/{number}.wav").read_bytes()
            )


def test_a_missing_label_is_an_empty_cell_and_numbers_come_back_exactly(world):
    project, tree, _ = world
    store = read_store(project.paths.features("d"))
    _, rows = read_csv(tree / tree.METADATA)
    cells = np.array([float(row["edge_mm"] or "nan") for row in rows])
    np.testing.assert_array_equal(cells, store.columns["edge_mm"].values)
    assert np.isnan(cells).sum() == 2
    assert [row["object"] for row in rows].count("") == 2


def test_the_archive_holds_no_time_and_no_compression(world):
    with zipfile.ZipFile(world[1] / "audio.zip") as held:
        entries = held.infolist()
    assert {e.date_time for e in entries} == {(1980, 1, 1, 0, 0, 0)}
    assert all(e.compress_type == zipfile.ZIP_STORED for e in entries)
    assert [e.filename for e in entries] == [
        row["file_name"] for row in read_csv(world[1] / "metadata.csv")[1]
    ]


def test_both_descriptions_say_what_was_declared(world):
    tree = world[1]
    croissant, package = read_json(tree / tree.CROISSANT), read_json(tree / tree.DATAPACKAGE)
    assert croissant["creator"] == {"@type": "sc:Person", "name": "A. Nobody"}
    assert package["contributors"] == [{"title": "A. Nobody", "role": "author"}]
    assert (croissant["alternateName"], croissant["version"]) == ("Tones | <b>", package["version"])
    assert croissant["datePublished"] + "T00:00:00Z" == package["created"] == "2026-01-31T00:00:00Z"
    assert croissant["license"] == package["licenses"][0]["path"]
    assert package["licenses"][0]["name"] == "CC0-1.0"
    assert (
        croissant["keywords"] == package["keywords"] and "acoustic sensing" in package["keywords"]
    )
    described = {one["name"]: one["description"] for one in croissant["recordSet"][0]["field"]}
    assert described["edge_mm"] == "length of the edge (mm)"
    assert described["object"] == "what was held"
    fields = {one["name"]: one for one in package["resources"][0]["schema"]["fields"]}
    assert fields["edge_mm"]["description"] == "length of the edge"
    assert fields["edge_mm"]["unit"] == "mm"
    assert fields["edge_mm"]["constraints"] == {"required": False, "unique": False}
    assert fields["recording"]["constraints"] == {"required": True, "unique": True}
    assert fields["sha256"]["constraints"] == {"required": True, "unique": False}
    for one in (*croissant["distribution"][:3], *package["resources"]):
        path = tree / one.get("contentUrl", one.get("path"))
        size = path.stat().st_size
        assert one.get("contentSize", f"{one.get('bytes')} B") == f"{size} B"


def test_the_card_says_what_was_left_out_and_is_no_html(world):
    _, tree, done = world
    card = (tree / tree.README).read_text()
    assert (done.left_out, done.unsealed, done.recordings) == (2, 2, 12)
    assert "2 recordings were left out" in card
    assert "2 had no hash from the day they were recorded" in card
    assert re.search(r"s1/take 0/6: .*cut short", card)
    assert "**Recorded**." in card
    assert "| `day` | string |  | as whoever recorded it" in card
    assert "| `object` (target) | string |  | what was held |" in card
    body = card.split("---\n", 2)[2]
    assert "<b>" not in body
    assert "latex &lt;1&gt;" in body
    assert "```python\nimport nothing" not in body
    assert "unknown" not in yaml.safe_load(card.split("---\n")[1])["license"]


def test_no_path_of_this_machine_is_published(world):
    project, tree, _ = world
    place = str(project.root).encode()
    assert not [name for name, content in contents(tree.root).items() if place in content]


def test_settings_of_a_robot_stay_at_home():
    arm = {"robot": "command", "robot_settings": {"command": ["arm", "--token", "secret"]}}
    protocol = {"objects": [{"name": "cube"}], **arm}
    spec = DatasetSpec.model_validate({"name": "d", "protocol": protocol})
    published = yaml.safe_load(declaration_bytes(spec))
    assert published["protocol"] == {"objects": [{"name": "cube"}], "robot": "command"}


def test_an_unlicensed_set_says_so(project, tmp_path):
    project.declare(targets={}, tasks={})
    done = published(project, tmp_path / "out")
    tree = Tree(done.folder)
    assert done.is_unlicensed
    assert "No licence is stated" in (tree / tree.LICENCE).read_text()
    assert "license: unknown" in (tree / tree.README).read_text()


def test_a_changed_recording_is_not_published_and_the_old_tree_stays(project, tmp_path):
    out = tmp_path / "out"
    published(project, out)
    before = contents(out)
    flip(project.folder("s1") / "audio/0.wav")
    with pytest.raises(DataError, match="bytes changed since its features were made"):
        published(project, out)
    assert contents(out) == before
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith(".")] == [".out.lock"]


def test_damaged_spectra_are_not_published(project, tmp_path):
    published(project, tmp_path / "tree")
    tree = Tree(tmp_path / "tree")
    sums = (tree / tree.SUMS).read_bytes()
    store = project.paths.features("d")
    store.write_bytes(whole := store.read_bytes())  # of its own: no link to the merged one
    spoil_spectra(store)
    with pytest.raises(DataError, match="not a readable feature store"):
        published(project, tree.root)
    assert (tree / tree.SUMS).read_bytes() == sums
    assert (tree / tree.FEATURES).read_bytes() == whole


def test_a_folder_of_other_things_is_not_overwritten(world, tmp_path):
    (tmp_path / "mine.txt").write_text("thesis")
    with pytest.raises(DataError, match="holds something else"):
        published(world[0], tmp_path)
    assert (tmp_path / "mine.txt").read_text() == "thesis"


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"version": "1"}, "--version: '1' is none"),
        ({"date": "now"}, "--date: 'now' is none"),
        ({"date": "2026-02-30"}, "--date: '2026-02-30' is none"),
        ({"date": "20260131"}, "--date: '20260131' is none"),
    ],
)
def test_wrong_options_are_one_line(world, tmp_path, wrong, said):
    with pytest.raises(DataError, match=said):
        publish(world[0].paths, "d", tmp_path / "out", **wrong)


@pytest.mark.parametrize("what", ["features", "quarantine"])
def test_what_was_not_made_is_not_published(project, tmp_path, what):
    path = getattr(project.paths, what)("d")
    path.unlink()
    with pytest.raises(DataError, match=f"{path.name}: has not been made; run `snakemake` first"):
        published(project, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["audio", "file_name", "mask_file_name"])
def test_a_label_that_hugging_face_takes_for_audio_is_refused(world, name):
    store = read_store(world[0].paths.features("d"))
    columns = {**store.columns, name: store.columns["day"]}
    with pytest.raises(DataError, match=f"a label is named '{name}'"):
        table_of(dataclasses.replace(store, columns=columns), [".wav"] * 12, "features.nc")


#: As recordings.csv gives them: without white space around.
label = st.text(st.characters(exclude_categories=["C"]), max_size=12).map(str.strip)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    st.lists(
        st.tuples(label.filter(bool), label.filter(bool), label, st.floats(allow_infinity=False)),
        min_size=1, max_size=5, unique_by=lambda row: row[0],
    )
)  # fmt: skip
def test_rows_come_back_from_the_table(tmp_path_factory, rows):
    names, grasps, days, edges = zip(*rows, strict=True)
    texts = {
        "recording": [f"s/{name}" for name in names],
        "session_id": ["s"] * len(rows),
        "grasp_id": [f"s/{grasp}" for grasp in grasps],
        "day": list(days),
        "sha256": ["0" * 64] * len(rows),
    }
    columns = {name: text_column(column) for name, column in texts.items()}
    columns["sample"] = Column(np.arange(len(rows)))
    columns["edge_mm"] = Column(np.asarray(edges), {"role": "target"})
    store = Shard(np.zeros((len(rows), 1)), np.zeros(1), columns, {})
    table = table_of(store, [".wav"] * len(rows), "features.nc")
    tree = Tree(tmp_path_factory.mktemp("table"))
    (tree / tree.METADATA).write_bytes(table.encoded())
    header, read = read_table(tree)
    assert header == table.names
    back = [recording for _, recording in recordings_of([row for _, row in read])]
    assert [one.recording_id for one in back] == list(names)
    assert [one.grasp_id for one in back] == list(grasps)
    assert [one.labels["day"] for one in back] == list(days)
    again = [float(one.labels["edge_mm"] or "nan") for one in back]
    np.testing.assert_array_equal(again, edges)
    assert not any(archive.bad_name(one.file) for one in back)


def test_file_names_differ_on_every_file_system():
    given = ["s/a b", "s/a_b", "s/A_B", "s/../x", "s/ü", "t/a b", "s/" + "y" * 300]
    names = file_names(given, [".wav"] * len(given))
    assert names[:5] == [
        "audio/s/a_b.wav",
        "audio/s/a_b-2.wav",
        "audio/s/A_B-3.wav",
        "audio/s/x.wav",
        "audio/s/recording.wav",
    ]
    assert len({name.lower() for name in names}) == len(names)
    assert not any(archive.bad_name(name) for name in names)
    assert max(map(len, names)) < 130


def test_the_examples_of_the_card_run(tree):
    """In a process of its own, because these libraries read their settings at import."""
    code = re.findall(r"^```python\n(.*?)^```$", (tree / tree.README).read_text(), re.S | re.M)
    caches = {"HF_HOME": str(tree.root), "CROISSANT_CACHE": str(tree.root)}
    offline = {"HF_HUB_OFFLINE": "1", "HF_DATASETS_OFFLINE": "1"}
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(code)],
        cwd=tree.root, env={**os.environ, **offline, **caches}, check=False,
        capture_output=True, text=True,
    )  # fmt: skip
    assert len(code) == 6 and done.returncode == 0, done.stderr
