"""A file of another version of its format gives one line with the command that helps.

Files that people keep (settings, sessions, published data sets) had no version at first: a file
that states no version is of version 1. A result that states no version is computed again.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

import h5py
import pytest
import yaml
from recorded import make_features
from sounds import resonances, write_wav

import ajgdata as library
from ajgdata.acquire.writer import acquire_session
from ajgdata.cli.status import WorkflowStatus
from ajgdata.paths import Paths, Tree
from ajgdata.pipeline.fetch import fetch
from ajgdata.pipeline.report import build_report
from ajgdata.pipeline.train import train_embedding, train_model
from ajgdata.store.features import read_latents, read_store
from ajgdata.store.files import read_yaml
from ajgdata.store.findings import read_findings
from ajgdata.store.freshness import changes_since_features, read_hashes
from ajgdata.store.publishing.archive import checksums_bytes
from ajgdata.store.sessions import read_dataset, read_session, write_session
from ajgdata.types import DataError, Embedding
from ajgdata.types.formats import FORMAT_KEY, PACKAGE_KEY, FormatError

NAME = "mine"
READS = "this version of ajgdata reads format 1"
LATER = f"format 2 is of a later version of ajgdata; {READS}"
#: Problem of a result with another version, by this version; None: no version.
OTHER = {2: LATER, None: f"states no format; {READS}", 0: f"format = 0 is not a version; {READS}"}


@pytest.fixture
def imported(paths, import_balls_and_cubes) -> Paths:
    """A data set of four balls and four cubes, with its features."""
    import_balls_and_cubes(NAME)
    return paths


@pytest.fixture
def trained(imported) -> Path:
    """The folder of a model of the data set."""
    settings = read_dataset(imported, NAME).training("label")
    folder = imported.model(NAME, "label", "knn")
    table = read_store(imported.features(NAME))
    train_model(table, settings, task="label", model="knn", seed=0, folder=folder)
    return folder


@pytest.fixture
def published(imported, ajgdata) -> Tree:
    """The published data set."""
    assert ajgdata("publish", NAME).code == 0
    return Tree(imported.published(NAME))


def set_yaml(path: Path, version: object) -> None:
    """Write another version into a YAML file; None: no version."""
    content = read_yaml(path)
    del content[FORMAT_KEY]
    if version is not None:
        content[FORMAT_KEY] = version  # the last line
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")


def set_netcdf(path: Path, version: int | None) -> None:
    """Write another version into a netCDF file; None: no version."""
    with h5py.File(path, "r+") as file:
        del file.attrs[FORMAT_KEY]
        if version is not None:
            file.attrs[FORMAT_KEY] = version


def set_json(path: Path, version: object, key: str = FORMAT_KEY) -> None:
    """Write another version into a JSON file; None: no version."""
    content = json.loads(path.read_text(encoding="utf-8"))
    del content[key]
    if version is not None:
        content[key] = version
    path.write_text(json.dumps(content), encoding="utf-8")


def last_line(path: Path) -> int:
    return len(path.read_text(encoding="utf-8").splitlines())


def contents(root: Path) -> dict[str, bytes]:
    return {str(p.relative_to(root)): p.read_bytes() for p in root.rglob("*") if p.is_file()}


def recomputed(file: Path, version: object, rule: str) -> str:
    """Return the line on a result of another version that a rule computes."""
    command = f"ajgdata run {NAME} --forcerun {rule}"
    return f"{file}: {OTHER[version]}. Run `{command}`, which computes it again."


def assert_one_line(printed, line: str) -> None:
    """Check that a command stopped with one line."""
    assert printed.code == 1
    assert printed.err.removeprefix("error ") == f"{line}\n"


# --- dataset.yaml


@pytest.mark.parametrize(
    ("version", "message"),
    [
        (2, f"{LATER}. Update ajgdata."),
        (0, f"format = 0 is not a version; {READS}. Correct the value."),
        ("new", f"format = 'new' is not a version; {READS}. Correct the value."),
        (True, f"format = True is not a version; {READS}. Correct the value."),
    ],
)
@pytest.mark.parametrize(
    "command", [("check", NAME), ("publish", NAME), ("status",), ("run", NAME)], ids=lambda c: c[0]
)
def test_settings_of_another_version_are_refused(
    imported, ajgdata, monkeypatch, command, version, message
):
    monkeypatch.setattr("ajgdata.cli.status.workflow_status", lambda *_: WorkflowStatus([], []))
    file = imported.dataset(NAME)
    set_yaml(file, version)
    line = f"{file}:{last_line(file)}: {message}"
    assert_one_line(ajgdata(*command), line)


def test_the_version_is_reported_before_keys_that_this_version_does_not_know(imported):
    file = imported.dataset(NAME)
    file.write_text(f"format: 2\nname: {NAME}\nnew_key: 1\n", encoding="utf-8")
    with pytest.raises(FormatError) as refused:
        read_dataset(imported, NAME)
    assert str(refused.value) == f"{file}:1: {LATER}. Update ajgdata."


def test_settings_that_are_derived_from_those_of_another_version_are_refused(imported):
    set_yaml(imported.dataset(NAME), 2)
    derived = imported.dataset("derived")
    derived.parent.mkdir()
    derived.write_text(f"name: derived\nfrom: {NAME}\n", encoding="utf-8")
    file = derived.parent.parent / NAME / "dataset.yaml"
    with pytest.raises(FormatError) as refused:
        read_dataset(imported, "derived")
    assert str(refused.value) == f"{file}:{last_line(file)}: {LATER}. Update ajgdata."


# --- session.yaml and recordings.csv


def test_a_session_of_another_version_is_an_error(imported, ajgdata, monkeypatch):
    monkeypatch.setattr("ajgdata.cli.status.workflow_status", lambda *_: WorkflowStatus([], []))
    file = imported.session_file(NAME, "src")
    set_yaml(file, 2)
    line = f"{file}:{last_line(file)}: {LATER}. Update ajgdata."
    checked = ajgdata("check", NAME)
    assert checked.code == 3
    assert f"error bad_session src/*: session.yaml: {LATER}; update ajgdata " in checked.text
    status = ajgdata("status")
    assert status.code == 3
    assert f"unusable {line}" in status.text
    with pytest.raises(FormatError) as refused:
        read_session(file.parent)
    assert str(refused.value) == line


def test_an_import_does_not_change_a_session_of_another_version(imported, ajgdata, src):
    file = imported.session_file(NAME, "src")
    set_yaml(file, 2)
    write_wav(src / "9_ball.wav", resonances(0, 9))
    before = contents(file.parent)
    line = f"{file}:{last_line(file)}: {LATER}. Update ajgdata."
    assert_one_line(ajgdata("import", src, "--dataset", NAME), line)
    assert contents(file.parent) == before


def test_a_simulation_does_not_change_a_session_of_another_version(tmp_path):
    """The format is checked before anything is simulated."""
    folder = tmp_path / "virtual-01"
    folder.mkdir()
    file = folder / "session.yaml"
    file.write_text("format: 2\nsession_id: virtual-01\n", encoding="utf-8")
    with pytest.raises(FormatError) as refused:
        acquire_session(folder, None, [])
    assert str(refused.value) == f"{file}:1: {LATER}. Update ajgdata."
    assert [path.name for path in folder.iterdir()] == ["session.yaml"]


def test_files_of_before_the_versions_are_valid_and_their_results_up_to_date(
    imported, ajgdata, src
):
    """Also an import that adds nothing leaves their bytes and times."""
    files = (imported.dataset(NAME), imported.session_file(NAME, "src"))
    for file in files:
        set_yaml(file, None)
        os.utime(file, (1e9, 1e9))
    before = [file.read_bytes() for file in files]
    assert not any(b"format" in content for content in before)
    assert changes_since_features(imported, read_dataset(imported, NAME)) == []
    assert ajgdata("check", NAME).code == 0
    assert ajgdata("import", src, "--dataset", NAME).code == 0
    assert [file.read_bytes() for file in files] == before
    assert [file.stat().st_mtime for file in files] == [1e9, 1e9]
    assert changes_since_features(imported, read_dataset(imported, NAME)) == []


def test_the_next_change_of_a_session_writes_the_version(imported):
    file = imported.session_file(NAME, "src")
    set_yaml(file, None)
    session = read_session(file.parent)
    write_session(file.parent, session.model_copy(update={"notes": "wet"}), [])
    assert read_yaml(file)[FORMAT_KEY] == 1


# --- results


@pytest.mark.parametrize("version", OTHER)
def test_features_of_another_version_are_computed_again(imported, ajgdata, version):
    file = imported.features(NAME)
    before = file.read_bytes()
    set_netcdf(file, version)
    line = recomputed(file, version, "features")
    with pytest.raises(FormatError) as refused:
        library.load_features(NAME)
    assert str(refused.value) == line
    with pytest.raises(FormatError) as refused:
        library.load_dataset(NAME).folds("label")
    assert str(refused.value) == line
    assert_one_line(ajgdata("publish", NAME), line)

    computed, reused = make_features(imported, NAME)
    assert (computed, reused) == (8, 0)
    assert file.read_bytes() == before


def test_features_of_another_version_are_missing_in_the_report_and_listed(imported):
    """A run of other data sets writes the report, and does not compute these features."""
    file = imported.features(NAME)
    set_netcdf(file, None)
    build_report(imported, datasets=[NAME], tasks=[], requested=[])
    line = recomputed(file, None, "features")
    about = json.loads(imported.runs.read_text(encoding="utf-8"))
    assert about["datasets"] == []
    assert about["unreadable"] == {str(file): line}


#: The same for models, whose format is 2.
READS_2 = READS.replace("format 1", "format 2")
OTHER_MODELS = {
    1: f"format 1 is of an earlier version of ajgdata; {READS_2}",
    3: f"format 3 is of a later version of ajgdata; {READS_2}",
    None: f"states no format; {READS_2}",
}


@pytest.mark.parametrize("version", OTHER_MODELS)
def test_a_model_of_another_version_is_trained_again(trained, ajgdata, version):
    file = trained / "model.json"
    set_json(file, version)
    command = f"ajgdata train {NAME} label --model knn --force"
    line = f"{file}: {OTHER_MODELS[version]}. Run `{command}`, which computes it again."
    for load in (library.load_model, library.load_predictor):
        with pytest.raises(FormatError) as refused:
            load(NAME, "label", "knn")
        assert str(refused.value) == line
    assert_one_line(ajgdata("export", NAME, "label", "knn"), line)


@pytest.mark.parametrize("version", OTHER)
def test_embedding_vectors_of_another_version_are_computed_again(imported, version):
    file = imported.latents(NAME, "shape")
    cost = imported.training_cost(NAME, "shape")
    settings = Embedding(supervision="objects", target="label")
    train_embedding(imported.features(NAME), settings=settings, seed=0, latents=file, cost=cost)
    assert FORMAT_KEY not in read_latents(file).attrs
    set_netcdf(file, version)
    with pytest.raises(FormatError) as refused:
        read_latents(file)
    line = recomputed(file, version, "embed")
    assert str(refused.value) == line


def test_a_quarantine_of_another_version_is_written_again(imported):
    """It has no version: its columns show it."""
    file = imported.quarantine(NAME)
    before = file.read_bytes()
    file.write_bytes(b"session_id,recording_id,file,level,code,problem,fix,hint\n")
    with pytest.raises(DataError) as refused:
        read_findings(file)
    problem = "its columns are of another version of ajgdata"
    line = (
        f"{file}: {problem}. Run `ajgdata run {NAME} --forcerun features`, which writes it again."
    )
    assert str(refused.value) == line
    make_features(imported, NAME)
    assert file.read_bytes() == before


def test_hashes_of_another_version_are_written_again(imported):
    file = imported.session_hashes(NAME)
    before = file.read_bytes()
    file.write_text(json.dumps(json.loads(before) | {"new_key": {}}), encoding="utf-8")
    assert read_hashes(file) is None
    changes = changes_since_features(imported, read_dataset(imported, NAME))
    assert changes == ["the record of what they were computed from is missing"]
    make_features(imported, NAME)
    assert file.read_bytes() == before


# --- published data sets


def seal(tree: Tree) -> None:
    """Write the checksums again."""
    (tree / tree.SUMS).write_bytes(checksums_bytes(tree.root))


@pytest.mark.parametrize(
    ("version", "message"),
    [
        (2, f"{LATER}. Update ajgdata."),
        ("1", f"format = '1' is not a version; {READS}. Correct the value."),
    ],
)
def test_a_published_data_set_of_another_version_is_not_fetched(
    published, paths, ajgdata, version, message
):
    file = published / Tree.DATAPACKAGE
    set_json(file, version, PACKAGE_KEY)
    seal(published)
    printed = ajgdata("fetch", published.root, "--name", "copy")
    assert_one_line(printed, f"{file}: {message}")
    assert not paths.dataset("copy").exists() and not paths.recordings("copy").exists()


def test_published_settings_of_another_version_are_not_fetched(published, paths, ajgdata):
    file = published / Tree.DECLARATION
    set_yaml(file, 2)
    seal(published)
    printed = ajgdata("fetch", published.root, "--name", "copy")
    assert_one_line(printed, f"{file}:{last_line(file)}: {LATER}. Update ajgdata.")
    assert not paths.dataset("copy").exists() and not paths.recordings("copy").exists()


@pytest.mark.parametrize("content", ["[]", "[" * 100_000, "{", " " * 10_000_000])
def test_a_damaged_data_package_is_refused_in_a_line(published, ajgdata, content):
    file = published / Tree.DATAPACKAGE
    file.write_text(content, encoding="utf-8")
    seal(published)
    printed = ajgdata("fetch", published.root, "--name", "copy")
    assert printed.code == 1
    assert printed.err.count("\n") == 1
    assert str(file) in printed.err and printed.err.endswith(". Fetch or copy it again.\n")


def without_versions(tree: Tree) -> None:
    """Make a published folder like those of before the versions."""
    set_yaml(tree / Tree.DECLARATION, None)
    set_yaml(tree / tree.session("src"), None)
    set_netcdf(tree / Tree.FEATURES, None)
    set_json(tree / Tree.DATAPACKAGE, None, PACKAGE_KEY)
    seal(tree)


def test_a_published_data_set_of_before_the_versions_is_fetched(published, paths, ajgdata):
    without_versions(published)
    assert fetch(paths, str(published.root), name="copy").recordings == 8
    assert read_yaml(paths.dataset("copy"))[FORMAT_KEY] == 1
    session = Path(Tree.session("src")).name
    copied = paths.session("copy", "src") / session
    assert copied.read_bytes() == (published / Tree.session("src")).read_bytes()


def test_a_published_version_of_before_the_versions_has_equal_content(
    published, paths, ajgdata, rows
):
    """Equal content may be published again; other content needs a new version, as always."""
    complete = contents(published.root)
    without_versions(published)
    assert ajgdata("publish", NAME).code == 0
    assert contents(published.root) == complete

    without_versions(published)
    before = contents(published.root)
    table = paths.recordings_file(NAME, "src")
    table.write_text(table.read_text(encoding="utf-8").replace(",ball", ",egg"), encoding="utf-8")
    make_features(paths, NAME)
    stopped = ajgdata("publish", NAME)
    assert stopped.code == 1
    assert "version 1.0.0 is published with other content: " in stopped.text
    assert contents(published.root) == before


def test_a_folder_that_a_later_version_published_is_not_replaced(published, paths, ajgdata):
    file = published / Tree.DATAPACKAGE
    set_json(file, 2, PACKAGE_KEY)
    before = contents(published.root)
    problem = f"cannot be compared with the data set to publish: {file} {LATER}"
    fix = f"Set a new `version` in {paths.dataset(NAME)}, or delete {published.root}"
    line = f"{published.root}: {problem}. {fix} if nobody has received it."
    assert_one_line(ajgdata("publish", NAME), line)
    assert contents(published.root) == before
    config = paths.dataset(NAME)
    config.write_text(f"{config.read_text(encoding='utf-8')}version: 1.1.0\n", encoding="utf-8")
    assert ajgdata("publish", NAME).code == 0


# --- writers


def test_every_command_writes_the_versions(published, trained, paths):
    for file in (
        paths.dataset(NAME),
        paths.session_file(NAME, "src"),
        published / Tree.DECLARATION,
        published / Tree.session("src"),
    ):
        lines = file.read_text(encoding="utf-8").splitlines()
        assert next(line for line in lines if not line.startswith("#")) == "format: 1"
    for file in (paths.features(NAME), published / Tree.FEATURES):
        with h5py.File(file) as features:
            assert features.attrs[FORMAT_KEY] == 1
    assert json.loads((trained / "model.json").read_text(encoding="utf-8"))[FORMAT_KEY] == 2
    package = json.loads((published / Tree.DATAPACKAGE).read_text(encoding="utf-8"))
    assert package[PACKAGE_KEY] == 1


def test_attributes_of_a_feature_file_are_without_the_version(imported):
    """Models and embedding vectors copy the attributes, and have versions of their own."""
    assert FORMAT_KEY not in read_store(imported.features(NAME)).attrs
    with library.load_features(NAME) as features:
        assert features.attrs[FORMAT_KEY] == 1
