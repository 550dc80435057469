"""The source distribution contains all that the wheel needs."""

import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from email.parser import Parser
from pathlib import Path

import pytest

from tools.address import tracked_files

ROOT = Path(__file__).parents[2]


def build(kind: str, source: Path, target: Path) -> Path:
    """Build a `wheel` or an `sdist` of a folder, as pip does."""
    code = f"from setuptools.build_meta import build_{kind}; build_{kind}({str(target)!r})"
    subprocess.run([sys.executable, "-c", code], cwd=source, check=True, capture_output=True)
    (file,) = target.glob("*.whl" if kind == "wheel" else "*.tar.gz")
    return file


def contents(wheel: Path) -> dict[str, bytes]:
    """Return the files of a wheel."""
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


@pytest.mark.slow
def test_a_wheel_of_the_source_distribution_is_the_wheel_of_the_clone(tmp_path):
    if not (ROOT / ".git").exists():
        pytest.skip("needs a clone")
    clone = tmp_path / "clone"
    for path in tracked_files(ROOT):
        copied = clone / path.relative_to(ROOT)
        copied.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(path, copied)
    for folder in ("wheel", "sdist", "unpacked", "second"):
        (tmp_path / folder).mkdir()
    files = contents(build("wheel", clone, tmp_path / "wheel"))
    with tarfile.open(build("sdist", clone, tmp_path / "sdist")) as archive:
        archive.extractall(tmp_path / "unpacked", filter="data")
    (unpacked,) = (tmp_path / "unpacked").iterdir()
    again = contents(build("wheel", unpacked, tmp_path / "second"))
    assert files.keys() == again.keys()
    assert [name for name in files if files[name] != again[name]] == []

    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert "ajgdata/samples/ycb.nc" in files
    (name,) = (name for name in files if name.endswith(".dist-info/METADATA"))
    metadata = Parser().parsestr(files[name].decode())
    urls = [f"{key}, {address}" for key, address in project["urls"].items()]
    assert metadata.get_all("Project-URL") == urls
    assert metadata["Version"] == project["version"]
    assert metadata["License-Expression"] == project["license"]
