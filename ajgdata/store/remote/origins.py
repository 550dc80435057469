"""Places from which a published data set is fetched: web folder, DOI, Hugging Face, or git.

Each origin downloads files of the data set by name. Nothing of an origin is trusted: the caller
compares the files with SHA256SUMS.
"""

from __future__ import annotations

import re
import shutil
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol
from urllib.parse import quote

from ajgdata.paths import Tree
from ajgdata.store.addresses import without_credentials
from ajgdata.store.git import run_git
from ajgdata.store.publishing.archive import open_archive
from ajgdata.store.remote.download import RUN_AGAIN, download
from ajgdata.types import DataError
from ajgdata.types.extras import optional_packages

DOI_PREFIXES = ("doi:", "https://doi.org/", "http://doi.org/", "https://dx.doi.org/")
HUB_PREFIX = "hf:"
#: Beginnings of addresses of git repositories; `git+` stands before any address of git.
GIT_PREFIXES = ("git+", "git@", "ssh://", "git://")
#: First bytes of a file that Git LFS has not downloaded.
_LFS_POINTER = b"version https://git-lfs"


class Origin(Protocol):
    """A place with the files of one published data set."""

    def download(self, folder: Path, name: str, sha256: str = "") -> None:
        """Write the file `name` into `folder`, which need not exist.

        `sha256` is its hash if it is known: a complete file is then kept. Otherwise, files of an
        earlier download are replaced. Raises DataError if the file cannot be downloaded.
        """


def origin_of(source: str) -> Origin | None:
    """Return the origin of an address; None for the path of a folder.

    Raises DataError for an address of another kind, or that is not complete.
    """
    scheme, separator, _ = source.partition("://")
    origin: Origin | None = None
    if source.startswith(DOI_PREFIXES):
        origin = Deposit.from_address(source)
    elif source.startswith(HUB_PREFIX):
        origin = HubRepository.from_address(source)
    elif source.startswith(GIT_PREFIXES) or (separator and source.endswith(".git")):
        origin = GitRepository(source.removeprefix("git+"))
    elif separator and scheme.lower() in ("http", "https"):
        origin = WebFolder(source.removesuffix(Tree.SUMS))
    elif separator:
        problem = f"addresses that begin with {scheme}:// are not supported"
        raise DataError(without_credentials(source), problem, "use https, or name a folder")
    return origin


@dataclass(frozen=True)
class WebFolder:
    """A published folder at a web address."""

    address: str

    def download(self, folder: Path, name: str, sha256: str = "") -> None:
        """Download one file, see `Origin`."""
        download(f"{self.address.rstrip('/')}/{quote(name)}", folder / name, sha256)


@dataclass(frozen=True)
class Deposit:
    """A deposit with a DOI, for example of Zenodo. Its files have no folders."""

    doi: str

    @classmethod
    def from_address(cls, address: str) -> Deposit:
        """Return the deposit of `doi:10.…` or of an address of doi.org."""
        doi = address
        for prefix in DOI_PREFIXES:
            doi = doi.removeprefix(prefix)
        if not re.fullmatch(r"10\.\d{4,9}/[^\s/?#]+", doi):
            raise DataError(address, "is not a DOI", "use the form doi:10.5281/zenodo.1234567")
        return cls(doi)

    def download(self, folder: Path, name: str, sha256: str = "") -> None:
        """Download one file, or unpack it from the archive of the folders; see `Origin`."""
        if "/" not in name:
            download(f"doi:{self.doi}/{name}", folder / name, sha256)
            if name == Tree.SUMS:
                (folder / Tree.FOLDERS).unlink(missing_ok=True)
            return
        archive = folder / Tree.FOLDERS
        if not archive.is_file():
            download(f"doi:{self.doi}/{Tree.FOLDERS}", archive)
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        try:
            with (
                open_archive(archive) as packed,
                packed.open(name) as source,
                target.open("wb") as stream,
            ):
                shutil.copyfileobj(source, stream)
        except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, LookupError) as error:
            archive.unlink(missing_ok=True)
            problem = f"is damaged or lacks a file ({' '.join(str(error).split())})"
            raise DataError(f"doi:{self.doi}/{Tree.FOLDERS}", problem, RUN_AGAIN) from None


@dataclass(frozen=True)
class HubRepository:
    """A data set repository of Hugging Face, with a branch, tag or commit ("": the newest)."""

    name: str
    revision: str = ""

    @classmethod
    def from_address(cls, address: str) -> HubRepository:
        """Return the repository of `hf:USER/NAME` or `hf:USER/NAME@REVISION`."""
        name, _, revision = address.removeprefix(HUB_PREFIX).partition("@")
        if not re.fullmatch(r"[\w.-]+/[\w.-]+", name):
            raise DataError(address, "is not a repository", "use the form hf:USER/NAME")
        return cls(name, revision)

    def download(self, folder: Path, name: str, sha256: str = "") -> None:
        """Download one file, see `Origin`; the library keeps a file that is complete."""
        with optional_packages(f"{HUB_PREFIX}{self.name}"):
            from huggingface_hub import hf_hub_download  # takes 0.3 s; only this origin needs it
        try:
            hf_hub_download(
                self.name,
                name,
                repo_type="dataset",
                revision=self.revision or None,
                local_dir=folder,
            )
        except Exception as error:  # the library of HTTP differs between versions of the hub's
            reason = without_credentials(" ".join(str(error).split()))
            problem = f"cannot be fetched ({reason[:200]})"
            raise DataError(f"{HUB_PREFIX}{self.name}/{name}", problem, RUN_AGAIN) from None


@dataclass(frozen=True)
class GitRepository:
    """A git repository whose top folder is a published data set."""

    address: str

    def download(self, folder: Path, name: str, sha256: str = "") -> None:
        """Clone the repository if the file without hash is requested; see `Origin`.

        The folder .git, whose settings contain the address with a password, is removed.
        """
        shown = without_credentials(self.address)
        if not sha256:
            shutil.rmtree(folder, ignore_errors=True)
            folder.parent.mkdir(parents=True, exist_ok=True)
            words = ("clone", "--quiet", "--depth=1", "--no-tags", "--template=", "--")
            run_git(
                shown,
                *words,
                self.address,
                str(folder.absolute()),
                folder=folder.parent,
                GIT_ALLOW_PROTOCOL="https:http:ssh:git:file",  # others can start programs
            )
            shutil.rmtree(folder / ".git", ignore_errors=True)
        path = folder / name
        if not path.is_file():
            fix = "publish the data set, and commit all files of its folder"
            raise DataError(shown, f"has no {name}: not a published data set", fix)
        with path.open("rb") as stream:
            is_pointer = stream.read(len(_LFS_POINTER)) == _LFS_POINTER
        if is_pointer:
            fix = "install git-lfs (`git lfs install`), then run it again"
            raise DataError(shown, f"stores {name} with Git LFS", fix)
