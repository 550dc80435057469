"""Folders of a git repository at given commits, downloaded by a partial clone with `git`.

Only the requested folders are downloaded: the server filters the rest. The hash of a commit covers
every byte below it, so a mirror need not be trusted.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from ajgdata.store.files import write_if_changed
from ajgdata.types import DataError, GitPart

Each = Callable[[list[str]], Iterable[str]]
AGAIN = "run it again: what is complete is kept"
#: One call of git, which a slow server cannot block for longer.
MAX_S = 6 * 3600.0
#: Files are stored unchanged: line ends are not converted and no filter of the user is run.
_UNCHANGED = b"* -text !eol -ident -filter -working-tree-encoding\n"
_SETTINGS = (
    "core.autocrlf=false", "core.symlinks=false", "core.hooksPath=", "core.fsmonitor=false",
    "gc.auto=0", "maintenance.auto=false", "fetch.negotiationAlgorithm=noop",
    "http.lowSpeedLimit=1000", "http.lowSpeedTime=30",
)  # fmt: skip
#: A phrase of git that has one meaning, the problem, and what to do. Other phrases are only quoted.
_FAILURES = (
    ("No space left", "the disk is full",
     f"make room, or set AJGDATA_CACHE to a folder on another disk, then {AGAIN}"),
    ("Disk quota exceeded", "the disk quota is used up",
     f"make room, or set AJGDATA_CACHE to a folder on another disk, then {AGAIN}"),
    ("not our ref", "the server does not have this commit", "name another --mirror"),
    ("unadvertised object", "the server does not send single commits",
     "name another --mirror, or set uploadpack.allowAnySHA1InWant on this one"),
    ("does not appear to be a git repository", "there is no git repository",
     "correct the address, or name another --mirror"),
    ("' not found", "there is no public repository", "name another --mirror"),
    ("could not read Username", "there is no public repository", "name another --mirror"),
    ("Could not resolve host", "the server was not found", f"check the network, then {AGAIN}"),
    ("Failed to connect", "the server does not answer", f"check the network, then {AGAIN}"),
)  # fmt: skip


class GitFolders:
    """Parts of the repository at `address`, in `folder`; git stores its objects in `objects`."""

    def __init__(self, address: str, folder: Path, objects: Path) -> None:
        self.address = address
        self.folder, self.objects = folder.absolute(), objects.absolute()

    def bring(self, parts: Sequence[GitPart], each: Each) -> None:
        """Write the files of each part, as in its commit; `each` iterates over the parts' names.

        After an interruption, the same call resumes at the first part that is not complete. Raises
        DataError for anything that cannot be downloaded.
        """
        names = {part.into or part.folder or self.folder.name: part for part in parts}
        with self._lock():
            self._git("init", "--quiet", "--bare", "--template=", str(self.objects))
            self._git("config", "remote.origin.url", self.address)
            write_if_changed(self.objects / "info" / "attributes", _UNCHANGED)
            trees = {name: self._tree(part) for name, part in names.items()}
            for name in each(list(names)):
                self._check_out(names[name], trees[name])

    @contextmanager
    def _lock(self) -> Iterator[None]:
        self.objects.mkdir(parents=True, exist_ok=True)
        lock = FileLock(self.objects.with_suffix(".lock"), timeout=0)
        try:
            lock.acquire()
        except Timeout:
            fix = "wait until it has ended"
            raise DataError(self.folder, "another process fetches it", fix) from None
        try:
            for stale in self.objects.glob("*.lock"):  # of a git that was killed
                stale.unlink()
            yield
        finally:
            lock.release()

    def _tree(self, part: GitPart) -> str:
        """Return the hash of a part's folder.

        Of its commit, only the folders that lead to it are downloaded.
        """
        known = self._git("rev-list", "--max-count=1", "--missing=print", part.commit, fails=True)
        if known != part.commit:
            levels = len(Path(part.folder).parts)
            kept = f"--filter=tree:{levels}" if levels else "--filter=blob:none"
            self._git(
                "fetch", "--quiet", "--no-tags", "--no-write-fetch-head", "--no-recurse-submodules",
                "--depth=1", kept, "origin", part.commit,
            )  # fmt: skip
        if not part.folder:
            return self._git("rev-parse", f"{part.commit}^{{tree}}")
        found = self._git("ls-tree", "--full-tree", "-d", part.commit, "--", part.folder)
        if not found:
            problem = f"commit {part.commit[:12]} has no folder {part.folder!r}"
            raise DataError(self.address, problem, "correct `folder` in source.yaml")
        return found.split()[2]  # mode, type, hash, name

    def _check_out(self, part: GitPart, tree: str) -> None:
        """Write the files of a part, which git downloads now; complete files are left unchanged."""
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
        try:
            done = subprocess.run(
                [program, *settings, *places, *words],
                stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace",
                check=False, env=_environment(index), cwd=folder or self.objects, timeout=MAX_S,
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
        """Return git's own words, with an explanation if their meaning is certain."""
        lines = [line for line in text.splitlines() if line.startswith(("fatal:", "error:"))]
        quoted = " ".join("; ".join(dict.fromkeys(lines or text.splitlines()[:1])).split())
        quoted = "".join(letter for letter in quoted if letter.isprintable())[:400]
        for phrase, problem, fix in _FAILURES:
            if phrase in text:
                return DataError(self.address, f"{problem} ({quoted})", fix)
        problem = f"git failed ({quoted or 'it gives no reason'})"
        return DataError(self.address, problem, f"correct the cause that git names, then {AGAIN}")


def _environment(index: Path | None) -> dict[str, str]:
    """Return the environment of git: it asks no question, and uses no other repository."""
    own = ("GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE", "GIT_OBJECT_DIRECTORY", "GIT_NAMESPACE",
           "GIT_COMMON_DIR", "GIT_ALTERNATE_OBJECT_DIRECTORIES", "GIT_PREFIX")  # fmt: skip
    kept = {key: value for key, value in os.environ.items() if key not in own}
    kept |= {"GIT_TERMINAL_PROMPT": "0", "LC_ALL": "C"}
    return kept | ({"GIT_INDEX_FILE": str(index)} if index else {})
