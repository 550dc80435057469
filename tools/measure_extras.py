"""Packages and size of the installation of each extra, as a table for docs/dependencies.md.

    python -m tools.measure_extras    # several minutes, and 5 GB for temporary files

Builds the wheel. For each extra, makes an empty virtual environment, installs the wheel with this
extra and the locked versions, and counts packages and MB. On Linux, pip's index may have torch with
CUDA packages only: set PIP_EXTRA_INDEX_URL to that of the CPU build, as in tools/bootstrap.sh.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
import venv
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]


class Size(NamedTuple):
    """Number of packages of an environment, and the size of their files without bytecode in MB."""

    packages: int
    mb: float


def build_wheel(folder: Path) -> Path:
    """Build the wheel of this project in an empty `folder`, and return its file.

    The sources are copied, because setuptools would add deleted files of an earlier build.
    """
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(listed, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    source = folder / "source"
    for name in filter(None, names.split("\0")):
        file = ROOT / name
        if file.exists():  # not deleted since the last commit
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(file, source / name, follow_symlinks=False)
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--disable-pip-version-check"]
    command += ["--no-deps", "--no-build-isolation", "--wheel-dir", str(folder), str(source)]
    subprocess.run(command, check=True, capture_output=True)  # setuptools prints many warnings
    (wheel,) = folder.glob("ajgdata-*.whl")
    return wheel


def install(wheel: Path, extra: str, folder: Path) -> Path:
    """Install a wheel with an extra ("": none) and the locked versions in a new environment.

    Returns its Python. The environment contains neither pip nor bytecode.
    """
    venv.create(folder, with_pip=False)
    python = folder / ("Scripts" if sys.platform == "win32" else "bin") / "python"
    requirement = f"{wheel}[{extra}]" if extra else str(wheel)
    command = [sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet"]
    command += ["--disable-pip-version-check", "--no-compile"]
    command += ["--constraint", str(ROOT / "requirements.lock"), requirement]
    # pip would take packages of these folders for installed ones.
    environment = {name: text for name, text in os.environ.items() if name != "PYTHONPATH"}
    subprocess.run(command, check=True, env=environment)
    return python


def size(folder: Path) -> Size:
    """Return the size of the packages of an environment, without this project."""
    (packages,) = (folder / "lib").glob("python*/site-packages")
    files = [path for path in packages.rglob("*") if path.is_file() and not path.is_symlink()]
    total = sum(path.stat().st_size for path in files if path.suffix != ".pyc")
    names = {path.name.partition("-")[0] for path in packages.glob("*.dist-info")}
    return Size(len(names - {"ajgdata"}), total / 1e6)


def main() -> None:
    """Print the table."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    print("| extra | packages | MB |")
    print("|---|---|---|")
    with tempfile.TemporaryDirectory() as temporary:
        wheel = build_wheel(Path(temporary))
        for extra in ("", *project["optional-dependencies"]):
            folder = Path(temporary) / (extra or "none")
            install(wheel, extra, folder)
            measured = size(folder)
            name = f"`{extra}`" if extra else "none"
            print(f"| {name} | {measured.packages} | {measured.mb:,.0f} |", flush=True)


if __name__ == "__main__":
    main()
