"""Kept digests are those that would be found anew; whatever is edited, they no longer hold."""

import json
import sys
from pathlib import Path

import pytest

from ajgdata.store.code_digest import Code, code_digest
from ajgdata.store.kept_digests import KeptDigests, kept_beside, sources_sha256


@pytest.fixture
def folders(tmp_path):
    package = tmp_path / "pkg"
    (package / "inner").mkdir(parents=True)
    (package / "__init__.py").write_text("")
    (package / "inner/__init__.py").write_text("def measure():\n    return 1\n")
    (package / "data.yaml").write_text("a: 1\n")
    (tmp_path / "alone.py").write_text("x = 1\n")
    return {"pkg": package, "alone": tmp_path / "alone.py"}


@pytest.fixture
def file(tmp_path):
    return tmp_path / "__pycache__/digests.json"


def never():
    raise AssertionError("it was kept")


def test_what_was_written_is_not_looked_for_again(folders, file):
    first = KeptDigests(folders, file)
    assert first.of(("pkg.inner:measure",), lambda: "0123") == "0123"
    assert first.of(("pkg.inner:measure",), never) == "0123"
    assert first.of(("pkg", "alone"), lambda: "4567") == "4567"
    first.write()
    second = KeptDigests(folders, file)
    assert second.of(("pkg.inner:measure",), never) == "0123"
    assert second.of(("pkg", "alone"), never) == "4567"
    assert second.of(("alone", "pkg"), lambda: "89ab") == "89ab"


@pytest.mark.parametrize("edited", ["pkg/inner/__init__.py", "pkg/data.yaml", "alone.py"])
def test_an_edit_of_any_file_ends_it(folders, file, tmp_path, edited):
    kept = KeptDigests(folders, file)
    kept.of(("pkg",), lambda: "old")
    kept.write()
    before, text = sources_sha256(folders), (tmp_path / edited).read_text()
    (tmp_path / edited).write_text(text.replace("1", "2"))  # of the same size
    assert sources_sha256(folders) != before
    assert KeptDigests(folders, file).of(("pkg",), lambda: "new") == "new"


def test_so_do_a_new_file_a_renamed_one_and_another_python(folders, file, monkeypatch):
    hashes = {sources_sha256(folders)}
    (folders["pkg"] / "more.py").write_text("")
    hashes.add(sources_sha256(folders))
    (folders["pkg"] / "more.py").rename(folders["pkg"] / "most.py")
    hashes.add(sources_sha256(folders))
    monkeypatch.setattr(sys, "version", "4.0")
    hashes.add(sources_sha256(folders))
    assert len(hashes) == 4


def test_what_python_compiles_does_not(folders):
    before = sources_sha256(folders)
    (folders["pkg"] / "__pycache__").mkdir()
    (folders["pkg"] / "__pycache__/x.pyc").write_bytes(b"x")
    assert sources_sha256(folders) == before


def test_digests_of_sources_edited_meanwhile_are_not_written(folders, file):
    kept = KeptDigests(folders, file)
    (folders["pkg"] / "__init__.py").write_text("x = 1\n")
    kept.of(("pkg",), lambda: "of the edited sources")
    kept.write()
    assert not file.exists()


@pytest.mark.parametrize("damage", ["", "{", "[]", '{"digests": 3}'])
def test_a_damaged_file_is_none(folders, file, damage):
    file.parent.mkdir()
    file.write_text(damage)
    assert KeptDigests(folders, file).of(("pkg",), lambda: "found") == "found"


def test_a_changed_digest_is_noticed(folders, file):
    kept = KeptDigests(folders, file)
    kept.of(("pkg",), lambda: "0123")
    kept.write()
    file.write_text(file.read_text().replace("0123", "0124"))
    assert KeptDigests(folders, file).of(("pkg",), lambda: "found") == "found"


def test_where_nothing_can_be_written_nothing_is(folders, file):
    kept = KeptDigests(folders, file)
    kept.of(("pkg",), lambda: "0123")
    file.parent.write_text("a file where the folder would be")
    kept.write()
    assert file.parent.read_text() == "a file where the folder would be"


def test_what_another_process_wrote_meanwhile_stays(folders, file):
    first, second = KeptDigests(folders, file), KeptDigests(folders, file)
    for kept, entry in ((first, "pkg"), (second, "alone")):
        kept.of((entry,), lambda entry=entry: entry)
        kept.write()
    assert KeptDigests(folders, file).of(("pkg",), never) == "pkg"


def test_another_process_finds_the_digest_that_this_one_keeps(run_python, tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPYCACHEPREFIX", str(tmp_path))  # other tests keep theirs, too
    monkeypatch.setattr(sys, "pycache_prefix", str(tmp_path))
    entry = "ajgdata.acquire.recipe:plan_session"
    package = Path(sys.modules["ajgdata"].__file__).parent
    code = f"from ajgdata.store.code_digest import code_digest; print(code_digest({entry!r}))"
    first, second = run_python(code).strip(), run_python(code).strip()
    kept = json.loads(kept_beside(package / "store/code_digest.py", ("ajgdata",)).read_text())
    found = Code({"ajgdata": package}).digest(entry)
    assert first == second == kept["digests"][entry] == found == code_digest(entry)
