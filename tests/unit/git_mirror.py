"""A host of git repositories in a folder."""

import hashlib
import os
import subprocess
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import soundfile

NOBODY = {"GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_NOSYSTEM": "1"} | {
    f"GIT_{who}_{what}": "nobody@example.org"
    for who in ("AUTHOR", "COMMITTER")
    for what in ("NAME", "EMAIL")
}


def git(folder: Path, *words: str) -> str:
    done = subprocess.run(
        ["git", *words], cwd=folder, env=os.environ | NOBODY, check=True, capture_output=True,
        text=True,
    )  # fmt: skip
    return done.stdout.strip()


class Mirror:
    """A folder whose `file://` address stands for a host, with the repository of `address`."""

    def __init__(self, folder: Path, address: str) -> None:
        self.url = folder.as_uri()
        self.repository = folder / urlsplit(address).path.strip("/")
        self.repository.mkdir(parents=True)
        git(self.repository, "init", "-q", ".")
        for setting in ("allowFilter", "allowAnySHA1InWant"):  # as public hosts do
            git(self.repository, "config", f"uploadpack.{setting}", "true")

    def commit(self, files: dict[str, bytes]) -> str:
        """Return the hash of a commit with `files` over those of the last one."""
        for name, content in files.items():
            path = self.repository / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        git(self.repository, "add", "--all")
        git(self.repository, "commit", "-q", "-m", "more")
        return git(self.repository, "rev-parse", "HEAD")


def sound(folder: Path, name: str, rate_hz: int, channels: int = 1) -> bytes:
    """Return the bytes of a short recording that no other `name` has."""
    seed = int.from_bytes(hashlib.sha256(name.encode()).digest()[:4], "big")
    samples = 0.1 * np.random.default_rng(seed).standard_normal((800, channels))
    path = folder / f"one{Path(name).suffix}"
    soundfile.write(path, samples, rate_hz)
    return path.read_bytes()
