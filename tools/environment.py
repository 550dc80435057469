"""Write environment.yml from pyproject.toml and requirements.lock (`make lock` runs this)."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: Index with the CPU build of torch, as in tools/bootstrap.sh.
CPU_INDEX = "https://download.pytorch.org/whl/cpu"


def pins(lock: str) -> dict[str, str]:
    """Package -> exact version, of the lines without an environment marker."""
    matches = (re.match(r"([A-Za-z0-9._-]+)==([^ ;]+)", line) for line in lock.splitlines())
    return {match[1].lower(): match[2] for match in matches if match}


def direct(pyproject: dict) -> list[str]:
    """Return the packages that this project with all its extras and its tests require, without this
    project."""
    project = pyproject["project"]
    requirements = [*project["dependencies"], *pyproject["dependency-groups"]["test"]]
    for packages in project["optional-dependencies"].values():
        requirements += packages  # an extra may name other extras of this project
    names = {re.split(r"[^A-Za-z0-9._-]", text)[0].lower() for text in requirements}
    return sorted(names - {project["name"]})


def environment(pyproject: dict, lock: str) -> str:
    """Return the text of environment.yml: the direct requirements with their locked versions.

    The file names no other file, so that a copy of it works in any folder.
    """
    locked = pins(lock)
    lines = [
        "# Versions of requirements.lock for conda; made by tools/environment.py: do not edit.",
        "# 1. conda env create -f environment.yml && conda activate ajgdata",
        f"# 2. pip install --no-deps ajgdata=={pyproject['project']['version']}",
        "#    or in a clone: pip install --no-deps -e . -e ./workflow/logger",
        "# The extra index has the CPU build of torch. If it cannot be reached, remove its line:",
        "# pip would try it again for each package.",
        "name: ajgdata",
        "channels: [conda-forge]",
        "dependencies:",
        "  - python >=3.11",
        "  - pip",
        "  - pip:",
        f"    - --extra-index-url {CPU_INDEX}",
        *(f"    - {name}=={locked[name]}" for name in direct(pyproject)),
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    pyproject = tomllib.loads((ROOT / "pyproject.toml").read_text())
    text = environment(pyproject, (ROOT / "requirements.lock").read_text())
    (ROOT / "environment.yml").write_text(text)
