"""Provenance of a result: version, commit, libraries and settings."""

from __future__ import annotations

import functools
import hashlib
import json
import platform
import re
import subprocess
from importlib.metadata import requires, version
from typing import Any

from pydantic import BaseModel

from ajgdata.paths import PACKAGE
from ajgdata.types.extras import installed_version


@functools.cache
def software() -> dict[str, str]:
    """Return `ajgdata_version` and `git_commit`.

    The commit ends with `+` if the working tree has changes, and is empty without git.
    """
    return {
        "ajgdata_version": version("ajgdata"),
        "git_commit": _git("describe", "--always", "--abbrev=40", "--dirty=+"),
    }


@functools.cache
def environment() -> dict[str, Any]:
    """Return the versions of Python and of the installed dependencies, with those of the extras."""
    dependencies = {re.split(r"[^A-Za-z0-9._-]", line)[0] for line in requires(PACKAGE.name) or ()}
    names = sorted(dependencies - {PACKAGE.name})  # an extra may include other extras
    versions = {name: installed_version(name) for name in names}
    installed = {name: text for name, text in versions.items() if text}
    return {"python": platform.python_version(), "packages": installed}


def commit_date() -> str:
    """Return the day of the commit, e.g. 2026-01-31; empty without git.

    All files with a date have this date, so that one commit gives the same bytes.
    """
    return _git("show", "--no-patch", "--format=%cs", "HEAD")


def _git(*arguments: str) -> str:
    """Return the output of git in the repository of this package; empty without a repository."""
    try:
        # An installed package can be inside the repository of another project.
        _run_git("ls-files", "--error-unmatch", "paths.py")
        return _run_git(*arguments)
    except (OSError, subprocess.SubprocessError):
        return ""


def _run_git(*arguments: str) -> str:
    """Return the output of git in the folder of this package. Raises SubprocessError."""
    completed = subprocess.run(
        ["git", *arguments], cwd=PACKAGE, capture_output=True, text=True, timeout=20, check=True
    )
    return completed.stdout.strip()


def settings_digest(*settings: BaseModel) -> str:
    """Return the digest of settings, including their defaults."""
    content = [s.model_dump(mode="json") for s in settings]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]
