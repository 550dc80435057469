"""numba.njit whose kept machine code is never stale.

Numba looks only at the file of the compiled function: a kernel that calls one of another file keeps
the old code of it (documented: "cache invalidation fails to recognize changes in functions defined
in a different file"), and would go on giving the old numbers. Here the code is kept by the digest
of all sources of the package.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba

FOLDER = Path(__file__).parent
config: Any = numba.config


def sources_digest(folder: Path) -> str:
    """Digest of the Python files of `folder`."""
    digest = hashlib.sha256()
    for file in sorted(folder.glob("*.py")):
        digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Do as numba.njit(**options), with machine code kept beside the sources, or where numba keeps
    it if that folder cannot be written."""

    def compiled(function: Callable[..., Any]) -> Any:
        before = config.CACHE_DIR
        config.CACHE_DIR = str(Path(before or FOLDER / "__pycache__") / sources_digest(FOLDER))
        try:
            return numba.njit(**options)(function)
        finally:
            config.CACHE_DIR = before

    return compiled
