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
from pathlib import Path
from typing import Any

from pydantic import BaseModel

PACKAGE = Path(__file__).resolve().parents[1]


@functools.cache
def software() -> dict[str, str]:
    """Return `ajgdata_version` and `git_commit` (`+` after it: the tree had changes; empty: no
    git)."""
    return {"ajgdata_version": version("ajgdata"), "git_commit": _commit()}


def _commit() -> str:
    try:
        _git("ls-files", "--error-unmatch", "paths.py")  # installed below somebody else's tree?
        return _git("describe", "--always", "--abbrev=40", "--dirty=+")
    except (OSError, subprocess.SubprocessError):
        return ""


@functools.cache
def environment() -> dict[str, Any]:
    """Return versions of Python and of every package that this one names as its dependency."""
    named = {re.split(r"[^A-Za-z0-9._-]", one)[0] for one in requires(PACKAGE.name) or ()}
    found = {}
    for name in sorted(named):
        with contextlib.suppress(PackageNotFoundError):
            found[name] = version(name)
    return {"python": platform.python_version(), "packages": found}


@functools.cache
def commit_date() -> str:
    """Return the day of the commit, as 2026-01-31; empty: no git. What has a date has this one, so
    that the same commit makes the same bytes."""
    try:
        _git("ls-files", "--error-unmatch", "paths.py")
        return _git("show", "--no-patch", "--format=%cs", "HEAD")
    except (OSError, subprocess.SubprocessError):
        return ""


def _git(*arguments: str) -> str:
    command = ["git", "-C", str(PACKAGE), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=20)
    return done.stdout.strip()


def settings_digest(*settings: BaseModel) -> str:
    """Return the digest of settings, defaults included."""
    content = [s.model_dump(mode="json") for s in settings]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]
