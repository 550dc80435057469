"""Provenance of a result: version, commit, code, settings."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
import platform
import re
import subprocess
from importlib.metadata import PackageNotFoundError, requires, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from ajgdata.types.registry import OWN_MODELS

PACKAGE = Path(__file__).resolve().parents[1]

_FEATURES = ("types/*.py", "store/*.py", "features/*.py")
_GRIPPER = ("gripper/**/*.py", "gripper/*.yaml")
_MODELS = (*_FEATURES, "models/*.py", "embed/*.py")
_EVALUATE = (*_MODELS, "evaluate/*.py")
_ACQUIRE = (*_FEATURES, *_GRIPPER, "acquire/*.py")
#: Files of each layer and of the layers that it uses, relative to the package.
LAYERS = {
    "gripper": _GRIPPER,
    "features": _FEATURES,
    "models": _MODELS,
    "evaluate": _EVALUATE,
    "acquire": _ACQUIRE,
    "studies": (*_FEATURES, *_GRIPPER, "studies/**/*.py"),
    "ablations": (*_EVALUATE, *_GRIPPER, "acquire/*.py", "ablations/*.py"),
    "report": ("**/*.py", "**/*.yaml"),
}
#: Libraries whose version can change results: of all layers, and of those with models.
NUMERICAL = ("numba", "numpy", "scipy")
LEARNING = ("scikit-learn", "torch", "umap-learn")


@functools.cache
def layer_hash(layer: str, *extra: str) -> str:
    """Return the hash of the files of a layer and of the layers below, and of library versions.

    A rule has it as a parameter, so that its results are computed again if it changes. `extra` are
    files or patterns relative to the package, or absolute files, that the results also need. The
    folder of the package and of other absolute files does not count, so that a copy of a project
    has the same hashes.
    """
    patterns = [*LAYERS[layer], *(name for name in extra if not Path(name).is_absolute())]
    files = {file for pattern in patterns for file in PACKAGE.glob(pattern)}
    files |= {Path(name) for name in extra if Path(name).is_absolute()}
    names = {_place(file): file for file in files}
    if layer not in ("gripper", "features"):
        specs = [find_spec(point.module) for point in OWN_MODELS]
        names |= {spec.name: Path(spec.origin) for spec in specs if spec and spec.origin}
    libraries = NUMERICAL if layer in ("gripper", "features") else (*NUMERICAL, *LEARNING)
    content = {
        "files": {n: hashlib.sha256(f.read_bytes()).hexdigest() for n, f in names.items()},
        "libraries": {name: version(name) for name in libraries},
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]


def _place(file: Path) -> str:
    """Return a file relative to the package, or the last two parts of a file elsewhere."""
    if file.is_relative_to(PACKAGE):
        return file.relative_to(PACKAGE).as_posix()
    return "/".join(file.parts[-2:])


def features_code() -> str:
    """Return the hash of the code that computes feature files."""
    names = ("feature_file", "recordings", "session_levels", "similar_sounds")
    jobs = [f"pipeline/{name}.py" for name in names]
    return layer_hash("features", *jobs)


@functools.cache
def software() -> dict[str, str]:
    """Return `ajgdata_version` and `git_commit` (`+` after it: the tree had changes; empty: no
    git)."""
    return {
        "ajgdata_version": version("ajgdata"),
        "git_commit": _git("describe", "--always", "--abbrev=40", "--dirty=+"),
    }


@functools.cache
def environment() -> dict[str, Any]:
    """Return versions of Python and of every package that this one names as its dependency."""
    named = {re.split(r"[^A-Za-z0-9._-]", line)[0] for line in requires(PACKAGE.name) or ()}
    versions = {}
    for name in sorted(named):
        with contextlib.suppress(PackageNotFoundError):
            versions[name] = version(name)
    return {"python": platform.python_version(), "packages": versions}


def commit_date() -> str:
    """Return the day of the commit, as 2026-01-31; empty: no git. What has a date has this one, so
    that the same commit makes the same bytes."""
    return _git("show", "--no-patch", "--format=%cs", "HEAD")


def _git(*arguments: str) -> str:
    """Return what git prints about the repository of this package; empty if it is in none."""
    try:  # an installed package may be below somebody else's repository
        for words in (("ls-files", "--error-unmatch", "paths.py"), arguments):
            done = subprocess.run(
                ["git", *words], cwd=PACKAGE, capture_output=True, text=True, timeout=20, check=True
            )
    except (OSError, subprocess.SubprocessError):
        return ""
    return str(done.stdout).strip()


def settings_digest(*settings: BaseModel) -> str:
    """Return the digest of settings, defaults included."""
    content = [s.model_dump(mode="json") for s in settings]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]
