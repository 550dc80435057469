"""Folders of a git repository at given commits, brought with the program `git`.

Nothing else of the repository is brought. Each byte is held by the hash of its commit, so that a
mirror need not be trusted.
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
#: An interrupted transfer loses less than this many files.
BATCH = 100
#: Files are taken as they are: no line ends are changed, no filter of the reader's is run.
_AS_THEY_ARE = b"* -text !eol -ident -filter -working-tree-encoding\n"
_SETTINGS = (
    "core.autocrlf=false", "core.symlinks=false", "core.hooksPath=", "core.fsmonitor=false",
    "gc.auto=0", "maintenance.auto=false", "fetch.negotiationAlgorithm=noop",
    "http.lowSpeedLimit=1", "http.lowSpeedTime=60",
)  # fmt: skip
_FETCH = ("fetch", "--quiet", "--no-tags", "--no-write-fetch-head", "--no-recurse-submodules")
#: What git says, what that is, and what to do.
_FAILURES = (
    (("No space left", "Disk quota"), "the disk is full",
     f"make room, or let AJGDATA_CACHE name a folder on another one, then {AGAIN}"),
    (("not our ref", "no such remote ref", "couldn't find remote ref", "unadvertised object"),
     "the commit is not there", "its author took it away: ask for another --mirror"),
    (("not found", "does not appear to be a git repository", "could not read Username",
      "Authentication failed", "error: 404"), "there is no such public repository",
     "it was moved or closed: name a copy of it by --mirror"),
    (("resolve host", "unable to access", "Connection", "timed out", "unexpected disconnect",
      "hung up", "early EOF", "RPC failed"), "the connection failed",
     f"look at the network, then {AGAIN}"),
    (("corrupt", "inflate", "mismatch", "bad object", "pack has", "index-pack"),
     "the bytes are not those of the commit", "nothing of it is used: name another --mirror"),
)  # fmt: skip


class GitFolders:
    """Parts of the repository at `address`, in `folder`. What git knows of them is in `objects`."""

    def __init__(self, address: str, folder: Path, objects: Path) -> None:
        self.address = address
        self.folder, self.objects = folder.absolute(), objects.absolute()

    def bring(self, parts: Sequence[GitPart], each: Each) -> None:
        """Make each part's folder what its commit says; `each` goes through the files to fetch.

        Interrupted, it goes on there. Raises DataError for whatever cannot be brought.
        """
        with self._alone():
            self._prepare()
            trees = [self._tree(part) for part in parts]
            missing = list(dict.fromkeys(one for tree in trees for one in self._missing(tree)))
            self._fetch(missing, each)
            for part, tree in zip(parts, trees, strict=True):
                self._check_out(part, tree)

    @contextmanager
    def _alone(self) -> Iterator[None]:
        self.objects.mkdir(parents=True, exist_ok=True)
        lock = FileLock(self.objects.with_suffix(".lock"), timeout=0)
        try:
            lock.acquire()
        except Timeout:
            raise DataError(
                self.folder, "another process fetches it", "wait for that one"
            ) from None
        try:
            for left in self.objects.glob("*.lock"):  # of a git that was killed
                left.unlink()
            yield
        finally:
            lock.release()

    def _prepare(self) -> None:
        self._git("init", "--quiet", "--bare", "--template=", str(self.objects))
        self._git("config", "remote.origin.url", self.address)
        write_if_changed(self.objects / "info" / "attributes", _AS_THEY_ARE)

    def _tree(self, part: GitPart) -> str:
        """Return the hash of a part's folder, after fetching the names of what is in its commit."""
        known = self._git("rev-list", "--max-count=1", "--missing=print", part.commit, fails=True)
        if known != part.commit:
            self._git(*_FETCH, "--depth=1", "--filter=blob:none", "origin", part.commit)
        place = f"{part.commit}:{part.folder}"
        tree = self._git("rev-parse", "--verify", "--quiet", place, fails=True)
        if not tree or self._git("cat-file", "-t", tree, fails=True) != "tree":
            problem = f"commit {part.commit[:12]} has no folder {part.folder!r}"
            raise DataError(self.address, problem, "correct `folder` in source.yaml")
        return tree

    def _missing(self, tree: str) -> list[str]:
        said = self._git("rev-list", "--objects", "--missing=print", tree)
        return [line[1:] for line in said.splitlines() if line.startswith("?")]

    def _fetch(self, missing: list[str], each: Each) -> None:
        waiting: list[str] = []
        for count, one in enumerate(each(missing), start=1):
            waiting.append(one)
            if len(waiting) == BATCH or count == len(missing):
                names = "".join(f"{name}\n" for name in waiting)
                self._git(*_FETCH, "--filter=blob:none", "--stdin", "origin", given=names)
                waiting.clear()

    def _check_out(self, part: GitPart, tree: str) -> None:
        """Write the files of a part; those that are whole already, by size and time, are left."""
        folder = self.folder / part.into
        folder.mkdir(parents=True, exist_ok=True)
        index = self.objects / f"{part.into.replace('/', '%') or 'all'}.index"
        self._git("read-tree", "--reset", "-u", tree, folder=folder, index=index)

    def _git(
        self,
        *words: str,
        given: str = "",
        fails: bool = False,
        folder: Path | None = None,
        index: Path | None = None,
    ) -> str:
        """Return what git prints, "" if it `fails` where it may; DataError else."""
        program = shutil.which("git")
        if program is None:
            fix = "install git, then run it again"
            raise DataError("git", "this program brings the recordings, and is not here", fix)
        settings = [word for one in _SETTINGS for word in ("-c", one)]
        where = ["--git-dir", str(self.objects)]
        where += ["--work-tree", str(folder)] if folder else []
        done = subprocess.run(
            [program, *settings, *where, *words],
            input=given, capture_output=True, text=True, errors="replace", check=False,
            env=_environment(index), cwd=folder or self.objects,
        )  # fmt: skip
        if not done.returncode:
            return done.stdout.strip()
        if fails:
            return ""
        raise self._failure(done.stderr)

    def _failure(self, said: str) -> DataError:
        """Return what a person can do about git's complaint."""
        lines = [line for line in said.splitlines() if line.startswith(("fatal:", "error:"))]
        quoted = " ".join((lines or said.splitlines() or ["no reason given"])[0].split())[:200]
        for words, problem, fix in _FAILURES:
            if any(word in said for word in words):
                return DataError(self.address, f"{problem} ({quoted})", fix)
        return DataError(self.address, f"git cannot bring it ({quoted})", AGAIN)


def _environment(index: Path | None) -> dict[str, str]:
    """Return the environment of git: no question is asked, and no other repository is meant."""
    ours = ("GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE", "GIT_OBJECT_DIRECTORY", "GIT_NAMESPACE",
            "GIT_COMMON_DIR", "GIT_ALTERNATE_OBJECT_DIRECTORIES", "GIT_PREFIX")  # fmt: skip
    kept = {key: value for key, value in os.environ.items() if key not in ours}
    kept |= {"GIT_TERMINAL_PROMPT": "0", "LC_ALL": "C"}
    return kept | ({"GIT_INDEX_FILE": str(index)} if index else {})
