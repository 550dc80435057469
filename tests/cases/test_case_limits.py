"""Files that would need more memory or space than there is are refused before they are read."""

import errno
import fcntl
import os
import shutil
import zipfile

import h5py
import pytest
from sounds import resonances, write_wav

from ajgdata.store.features import open_store
from ajgdata.store.files import MAX_YAML_BYTES, read_yaml, replacing_folder
from ajgdata.store.models import ESTIMATOR_FILE, read_estimator
from ajgdata.store.publishing.archive import read_checksums
from ajgdata.store.read_only import writable_view
from ajgdata.types import DataError, one_line


def write_sparse(path, size):
    """Write a file of `size` zero bytes that needs no space on the disk."""
    with path.open("wb") as stream:
        stream.truncate(size)


def test_a_huge_list_of_checksums_is_refused_unread(tmp_path):
    write_sparse(tmp_path / "SHA256SUMS", 3 * 10**9)
    with pytest.raises(DataError, match=r"SHA256SUMS: has 3,000 MB, more than the limit of 67 MB"):
        read_checksums(tmp_path / "SHA256SUMS")


def test_a_huge_config_is_refused_unread(tmp_path):
    write_sparse(tmp_path / "dataset.yaml", MAX_YAML_BYTES + 1)
    with pytest.raises(DataError, match="more than the limit of 8 MB"):
        read_yaml(tmp_path / "dataset.yaml")


def test_a_model_that_unpacks_to_far_more_than_its_size_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / ESTIMATOR_FILE, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("schema.json", b" " * 50_000_000)
    with pytest.raises(DataError, match=r"0\.0 MB that unpack to 50 MB"):
        read_estimator(tmp_path, ())


def test_a_locked_feature_file_is_reported_as_locked(tmp_path):
    path = tmp_path / "mine.nc"
    h5py.File(path, "w").close()
    with path.open("rb+") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with pytest.raises(DataError, match=r"is locked by .*HDF5_USE_FILE_LOCKING"):
            open_store(path)
    with pytest.raises(DataError) as damaged:  # not netCDF, but not locked either
        path.write_bytes(b"no netCDF")
        open_store(path)
    assert "is not a readable netCDF file" in str(damaged.value)


def test_a_full_disk_is_reported_with_the_file_that_needs_space(ajgdata, src, monkeypatch):
    write_wav(src / "1_cube.wav", resonances(0, 1))
    write_wav(src / "2_ball.wav", resonances(1, 1))

    def full(source, target):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(source), None, str(target))

    monkeypatch.setattr(shutil, "copyfile", full)
    stopped = ajgdata("import", src, "--dataset", "mine", "--pattern", "starter-kit")
    assert stopped.code != 0
    assert "No space left on device" in stopped.text
    assert str(src / "1_cube.wav") not in stopped.text
    assert "/data/mine/sessions/" in stopped.text


def test_a_source_that_cannot_be_read_is_reported_with_its_own_name():
    denied = PermissionError(errno.EACCES, "Permission denied", "source.wav", None, "target.wav")
    assert one_line(denied).startswith("source.wav: Permission denied")


def test_leftovers_of_a_killed_replacement_are_removed(tmp_path):
    folder = tmp_path / "published"
    folder.mkdir()
    (folder / "version").write_text("1")
    killed = replacing_folder(folder)
    new = killed.__enter__()
    (new / "version").write_text("2")
    del killed  # the process ends here, without the end of the block
    with replacing_folder(folder) as new:
        (new / "version").write_text("3")
    assert [path.name for path in tmp_path.iterdir()] == ["published"]
    assert (folder / "version").read_text() == "3"


def test_an_old_folder_that_was_moved_away_returns(tmp_path):
    folder = tmp_path / "published"
    with pytest.raises(RuntimeError), replacing_folder(folder) as new:
        (new.parent / "old").mkdir()
        (new.parent / "old/version").write_text("1")
        interrupted = tmp_path / new.parent.name
        saved = tmp_path / "saved"
        shutil.copytree(interrupted, saved)
        raise RuntimeError
    saved.rename(interrupted)
    with pytest.raises(RuntimeError), replacing_folder(folder):
        raise RuntimeError
    assert (folder / "version").read_text() == "1"


def test_a_pattern_that_would_search_for_ever_is_refused(ajgdata, src, paths):
    name = "a" * 40
    write_wav(src / f"{name}!.wav", resonances(0, 1))
    pattern = r"(?P<label>(a|aa)+)\.wav"
    stopped = ajgdata("import", src, "--dataset", "mine", "--pattern", pattern)
    assert stopped.code != 0
    assert f"--pattern: needs more than 1 s for the file name '{name}!.wav'" in stopped.text
    assert not paths.dataset("mine").exists()


def test_a_project_has_a_view_that_can_be_written(tmp_path):
    """Snakemake writes a lock and a cache even if `ajgdata status` only asks for the state."""
    root = tmp_path / "project"
    (root / ".snakemake/metadata").mkdir(parents=True)
    (root / ".snakemake/metadata/record").write_text("known")
    (root / "data").mkdir()
    before = sorted(root.rglob("*"))
    with writable_view(root) as folder:
        assert folder != root
        assert (folder / ".snakemake/metadata/record").read_text() == "known"
        assert (folder / "data").resolve() == root / "data"
        (folder / ".snakemake/locks").mkdir()
    assert sorted(root.rglob("*")) == before
    assert not folder.exists()
