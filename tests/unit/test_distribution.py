"""Wheel and source distribution contain what an installed package needs."""

import re
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
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
#: Uses files of the package in a folder that is not a clone.
PROGRAM = """
import ajgdata
from ajgdata.report.render import environment
from ajgdata.store.report_files import PACKAGED

assert environment().get_template("base.html.j2")
assert ajgdata.tutorial.load_features("ycb").attrs["source"] == "simulated"
print(PACKAGED)
"""


def build(kind: str, source: Path, target: Path) -> Path:
    """Build a `wheel` or an `sdist` of a folder, as pip does."""
    target.mkdir()
    code = f"from setuptools.build_meta import build_{kind}; build_{kind}({str(target)!r})"
    subprocess.run([sys.executable, "-c", code], cwd=source, check=True, capture_output=True)
    (file,) = target.glob("*.whl" if kind == "wheel" else "*.tar.gz")
    return file


def contents(wheel: Path) -> dict[str, bytes]:
    """Return the files of a wheel."""
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


@pytest.fixture(scope="module")
def clone(tmp_path_factory):
    """Return a folder with the files that git tracks."""
    if not (ROOT / ".git").exists():
        pytest.skip("needs a clone")
    folder = tmp_path_factory.mktemp("clone")
    for path in tracked_files(ROOT):
        copied = folder / path.relative_to(ROOT)
        copied.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(path, copied)
    return folder


@pytest.fixture(scope="module")
def wheel(clone, tmp_path_factory):
    return build("wheel", clone, tmp_path_factory.mktemp("built") / "wheel")


@pytest.mark.slow
def test_a_wheel_of_the_source_distribution_is_the_wheel_of_the_clone(clone, wheel, tmp_path):
    with tarfile.open(build("sdist", clone, tmp_path / "sdist")) as archive:
        archive.extractall(tmp_path / "unpacked", filter="data")
    (unpacked,) = (tmp_path / "unpacked").iterdir()
    files = contents(wheel)
    again = contents(build("wheel", unpacked, tmp_path / "wheel"))
    assert files.keys() == again.keys()
    assert [name for name in files if files[name] != again[name]] == []


@pytest.mark.slow
def test_the_description_of_the_wheel_has_the_addresses_of_pyproject(wheel):
    files = contents(wheel)
    (name,) = (name for name in files if name.endswith(".dist-info/METADATA"))
    metadata = Parser().parsestr(files[name].decode())
    urls = PROJECT["urls"]
    assert metadata.get_all("Project-URL") == [f"{key}, {value}" for key, value in urls.items()]
    assert metadata["Version"] == PROJECT["version"]
    assert metadata["License-Expression"] == PROJECT["license"]
    readme = metadata.get_payload()
    tag = f"v{PROJECT['version']}"
    assert re.findall(r"\]\((?!https?:)", readme) == []
    assert f"({urls['Source']}/raw/{tag}/docs/images/opening.png)" in readme
    assert f"({urls['Source']}/blob/{tag}/docs/index.md)" in readme


@pytest.mark.slow
def test_an_installed_package_has_the_files_of_the_clone(wheel, tmp_path):
    target = tmp_path / "target"
    with zipfile.ZipFile(wheel) as archive:  # as pip does, except for scripts
        archive.extractall(target)
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        cwd=tmp_path,
        env={"PYTHONPATH": str(target), "PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    package = target / "ajgdata"
    assert Path(done.stdout.strip()) == package / "reports"
    assert (package / "py.typed").is_file()
    files = [path.relative_to(ROOT) for path in tracked_files(ROOT) if path.name != "README.md"]
    for folder in ("datasets", "profiles", "reports", "workflow"):
        inside = [file for file in files if file.parts[0] == folder and "logger" not in file.parts]
        assert inside
        for file in inside:
            assert (package / file).read_bytes() == (ROOT / file).read_bytes()
