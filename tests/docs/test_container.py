"""The commands of the Containerfile run in an empty folder and an empty environment.

This needs no container engine: folders of the image are folders of the test. The commands that need
root in an image (packages of Debian, its user) are left out.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tools.address import tracked_files

ROOT = Path(__file__).resolve().parents[2]
#: Folders of the image that the Containerfile uses.
FOLDERS = re.compile(r"(?<![\w./])/(source|wheels|try|project|tmp)\b")


def instructions() -> list[tuple[str, str]]:
    """Return the instructions of the Containerfile, each with its arguments."""
    text = (ROOT / "Containerfile").read_text()
    text = re.sub(r"^#.*\n", "", text, flags=re.M).replace("\\\n", "")
    lines = [line.partition(" ") for line in text.splitlines() if line]
    return [(name, arguments) for name, _, arguments in lines]


def copy_files(sources: list[str], target: Path) -> None:
    """Copy files of this project; `.` means all files that git tracks, with their folders."""
    if sources == ["."]:
        files = {path.relative_to(ROOT): path for path in tracked_files(ROOT)}
    else:
        files = {Path(name).name: ROOT / name for name in sources}
    for name, path in files.items():
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(path, target / name)


def test_the_image_is_a_pinned_python_and_its_user_is_not_root():
    bases = [arguments.split()[0] for name, arguments in instructions() if name == "FROM"]
    assert len(set(bases)) == 1
    assert re.search(r":3\.11\.\d+-slim-", bases[0])
    names = [name for name, _ in instructions()]
    assert ("USER", "ajgdata") in instructions()
    assert names.index("USER") < len(names) - 1 - names[::-1].index("RUN")


def test_ignored_files_are_not_in_the_image():
    ignored = {line.strip("/") for line in (ROOT / ".gitignore").read_text().splitlines()}
    lines = (ROOT / ".dockerignore").read_text().splitlines()
    excluded = {line.removeprefix("**/") for line in lines}
    caches = {".pytest_cache", ".hypothesis", ".ruff_cache", ".mypy_cache", "mutants"}
    assert ignored - caches <= excluded
    assert ".git" in excluded


@pytest.mark.slow
def test_the_commands_of_the_container_run_in_an_empty_folder(tmp_path):
    if not (ROOT / ".git").exists():
        pytest.skip("needs a clone")
    subprocess.run([sys.executable, "-m", "venv", tmp_path / "venv"], check=True)
    (tmp_path / "tmp").mkdir()
    # A mirror of the package index is also used here.
    environment = {key: value for key, value in os.environ.items() if key.startswith("PIP_")}
    environment["PATH"] = f"{tmp_path}/venv/bin:/usr/bin:/bin"
    count = 0
    for name, arguments in instructions():
        here = FOLDERS.sub(rf"{tmp_path}/\1", arguments)
        if name == "COPY" and "--from" not in arguments:
            *sources, target = here.split()
            copy_files(sources, Path(target))
        elif name == "ENV":
            environment |= dict(value.split("=") for value in here.split())
        elif name == "RUN" and "apt-get" not in arguments:
            done = subprocess.run(
                ["sh", "-c", here],
                cwd=tmp_path,
                env=environment,
                check=False,
                text=True,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
            )
            assert done.returncode == 0, f"{here}\n{done.stdout}"
            count += 1
    assert count == 4
    assert "report: results/runs/mine/report/index.html" in done.stdout
