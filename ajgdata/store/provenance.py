"""Provenance of a result: version, commit, settings."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
import platform
import re
import subprocess
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import Any

from pydantic import BaseModel

PACKAGE = Path(__file__).resolve().parents[1]


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
