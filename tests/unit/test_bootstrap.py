"""The set-up installs the CPU build of torch if its index can be reached, else pip's default."""

import os
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT, LOCK = ROOT / "tools/bootstrap.sh", (ROOT / "requirements.lock").read_text()
#: No index has this version, so only the wheels of this test can be installed.
VERSION = "99.0"
PROJECT = f"""
[build-system]
requires = ["setuptools"]
build-backend = "setuptools.build_meta"
[project]
name = "demo"
version = "1.0"
dependencies = ["torch=={VERSION}"]
[project.optional-dependencies]
test = []
[tool.setuptools]
packages = []
"""


def wheel(folder: Path, version: str) -> Path:
    """Write an empty package `torch`."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"torch-{version}-py3-none-any.whl"
    about = f"torch-{version}.dist-info"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(
            f"{about}/METADATA", f"Metadata-Version: 2.1\nName: torch\nVersion: {version}\n"
        )
        archive.writestr(
            f"{about}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
        )
        archive.writestr(f"{about}/RECORD", "")
    return path


@pytest.fixture
def project(tmp_path):
    """A small project whose pip finds the default build of torch."""
    root = tmp_path / "project"
    root.mkdir()
    (root / "pyproject.toml").write_text(PROJECT)
    setuptools = next(line for line in LOCK.splitlines() if line.startswith("setuptools=="))
    (root / "requirements.lock").write_text(f"{setuptools}\ntorch=={VERSION}\n")
    wheel(tmp_path / "default", VERSION)
    return root


def set_up(project: Path, torch_index: str) -> tuple[subprocess.CompletedProcess, float]:
    found = f"{project.parent / 'default'} {os.environ.get('PIP_FIND_LINKS', '')}"
    begin = time.monotonic()
    done = subprocess.run(
        [str(SCRIPT), sys.executable, "venv", "test"], cwd=project, text=True, check=False,
        capture_output=True,
        env=os.environ | {"TORCH_INDEX": torch_index, "PIP_FIND_LINKS": found.strip()},
    )  # fmt: skip
    return done, time.monotonic() - begin


def installed(project: Path) -> str:
    show = "from importlib.metadata import version; print(version('torch'))"
    return subprocess.run(
        [str(project / "venv/bin/python"), "-c", show], text=True, check=True, capture_output=True
    ).stdout.strip()


@pytest.mark.slow
def test_an_index_that_cannot_be_reached_does_not_stop_the_set_up(project):
    done, seconds = set_up(project, "http://127.0.0.1:1")
    assert done.returncode == 0, done.stderr
    assert installed(project) == VERSION
    assert "which may add CUDA packages" in done.stderr
    assert seconds < 100  # pip alone tries it for minutes
