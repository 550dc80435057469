"""Folders of a git repository at given commits, downloaded by a partial clone with `git`.

Only the files of the requested folders are downloaded. The hash of a commit covers every byte below
it, so a mirror need not be trusted.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from ajgdata.store.files import write_if_changed
from ajgdata.store.locks import alone
from ajgdata.types import DataError, GitPart

Each = Callable[[list[str]], Iterable[str]]
AGAIN = "run it again: complete files and folders are kept"
#: Time limit of one call of git.
MAX_S = 6 * 3600.0
#: Files are stored unchanged: line ends are not converted and no filter of the user is run.
_UNCHANGED = b"* -text !eol -ident -filter -working-tree-encoding\n"
_SETTINGS = (
    "core.autocrlf=false", "core.symlinks=false", "core.hooksPath=", "core.fsmonitor=false",
    "gc.auto=0", "maintenance.auto=false", "fetch.negotiationAlgorithm=noop",
    "http.lowSpeedLimit=1000", "http.lowSpeedTime=30",
)  # fmt: skip
#: Phrases of git that have one meaning, and what to do. Other phrases are only quoted.
_FIXES = {
    "No space left": f"make room, or set AJGDATA_CACHE to a folder on another disk, then {AGAIN}",
    "not our ref": "the server does not have this commit: name another --mirror",
    "unadvertised object": "the server does not send single commits: name another --mirror",
    "Could not resolve host": f"check the network, then {AGAIN}",
    "Failed to connect": f"check the network, then {AGAIN}",
}


class GitFolders:
    """Parts of the repository at `address`, in `folder`; git stores its objects in `objects`."""

    def __init__(self, address: str, folder: Path, objects: Path) -> None:
        self.address = address
        self.folder, self.objects = folder.absolute(), objects.absolute()

    def bring(self, parts: Sequence[GitPart], each: Each) -> None:
        """Write the files of each part, as in its commit; `each` iterates over the parts' names.

        Complete files are left unchanged, so the same call resumes after an interruption. Raises
        DataError for anything that cannot be downloaded.
        """
        names = {part.into or part.folder or self.folder.name: part for part in parts}
        with alone(self.objects, "fetching these recordings"):
            self._git("init", "--quiet", "--bare", "--template=", str(self.objects))
            for stale in self.objects.glob("*.lock"):  # of a git that was killed
                stale.unlink()
            self._git("config", "remote.origin.url", self.address)
            write_if_changed(self.objects / "info" / "attributes", _UNCHANGED)
            for name in each(list(names)):
                self._check_out(names[name])

    def _check_out(self, part: GitPart) -> None:
        """Write the files of a part, which git downloads now."""
        known = self._git("rev-list", "--max-count=1", "--missing=print", part.commit, fails=True)
        if known != part.commit:
            options = ("--quiet", "--no-tags", "--no-write-fetch-head", "--depth=1")
            self._git("fetch", *options, "--filter=blob:none", "origin", part.commit)
        tree = f"{part.commit}:{part.folder}"
        if self._git("cat-file", "-t", tree, fails=True) != "tree":
            problem = f"commit {part.commit[:12]} has no folder {part.folder!r}"
            raise DataError(self.address, problem, "correct `folder` in source.yaml")
        folder = self.folder / part.into
        folder.mkdir(parents=True, exist_ok=True)
        index = self.objects / f"{part.into.replace('/', '%') or 'all'}.index"
        self._git("read-tree", "--reset", "-u", tree, folder=folder, index=index)

    def _git(
        self,
        *words: str,
        fails: bool = False,
        folder: Path | None = None,
        index: Path | None = None,
    ) -> str:
        """Return what git prints; "" if it fails and `fails` allows it. Raises DataError."""
        program = shutil.which("git")
        if program is None:
            fix = "install git, then run it again"
            raise DataError("git", "this program downloads the recordings, and is missing", fix)
        settings = [word for setting in _SETTINGS for word in ("-c", setting)]
        places = ["--git-dir", str(self.objects)]
        places += ["--work-tree", str(folder)] if folder else []
        kept = {key: value for key, value in os.environ.items() if not key.startswith("GIT_")}
        allowed = ("GIT_CONFIG", "GIT_SSL", "GIT_SSH", "GIT_PROXY")
        kept |= {key: value for key, value in os.environ.items() if key.startswith(allowed)}
        kept |= {"GIT_TERMINAL_PROMPT": "0", "LC_ALL": "C"}
        try:
            done = subprocess.run(
                [program, *settings, *places, *words],
                stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace",
                check=False, env=kept | ({"GIT_INDEX_FILE": str(index)} if index else {}),
                cwd=folder or self.objects.parent, timeout=MAX_S,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            problem = f"git took longer than {MAX_S / 3600:g} h"
            raise DataError(self.address, problem, AGAIN) from None
        if not done.returncode:
            return done.stdout.strip()
        if fails:
            return ""
        raise self._failure(done.stderr)

    def _failure(self, text: str) -> DataError:
        """Return git's own words, with a fix if their meaning is certain."""
        lines = [line for line in text.splitlines() if line.startswith(("fatal:", "error:"))]
        quoted = " ".join("; ".join(dict.fromkeys(lines or text.splitlines()[:1])).split())
        quoted = "".join(letter for letter in quoted if letter.isprintable())[:400]
        fix = f"correct the cause that git names, then {AGAIN}"
        fix = next((text_fix for phrase, text_fix in _FIXES.items() if phrase in text), fix)
        return DataError(self.address, f"git failed ({quoted or 'it gives no reason'})", fix)
