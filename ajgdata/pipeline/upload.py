"""`ajgdata publish --to`: send a published folder to Hugging Face or Zenodo, and check it there."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Protocol
from zipfile import ZipFile

from ajgdata.paths import AUDIO_FOLDER, Paths, Tree
from ajgdata.pipeline.progress import tracked
from ajgdata.store.files import read_yaml, write_bytes
from ajgdata.store.publishing import archive
from ajgdata.store.publishing.about import licence_identifier
from ajgdata.store.remote import hub
from ajgdata.store.remote.origins import HUB_PREFIX, HubRepository
from ajgdata.store.remote.zenodo import Zenodo, deposit_metadata
from ajgdata.store.sources import read_source
from ajgdata.types import DataError, DatasetSpec

ZENODO = "zenodo"


class Destination(Protocol):
    """A place to which published folders are sent."""

    def check(self, declaration: Path, spec: DatasetSpec) -> None:
        """Raise DataError if the data set lacks something that the place requires."""

    def sizes(self, tree: Tree) -> dict[str, int]:
        """Return the sizes in bytes of the files that are sent, by name."""

    def visibility(self) -> str:
        """Return who can see the files after they are sent, as a clause."""

    def send(self, tree: Tree, spec: DatasetSpec) -> list[str]:
        """Send the files, check them there, and return lines about what a person does next."""


def destination_of(to: str) -> HubDestination | ZenodoDestination:
    """Return the destination `hf:USER/NAME` or `zenodo`.

    Raises DataError for another text, and without a token.
    """
    if to == ZENODO:
        return ZenodoDestination(Zenodo.from_environment())
    if not to.startswith(HUB_PREFIX):
        raise DataError("--to", f"unknown destination {to!r}", "use hf:USER/NAME or zenodo")
    repository = HubRepository.from_address(to)
    if repository.revision:
        raise DataError("--to", f"{to!r} names a revision", "use the form hf:USER/NAME")
    hub.check_login(repository.name)
    return HubDestination(repository.name)


def check_may_be_sent(paths: Paths, dataset: str) -> None:
    """Raise DataError for public recordings that other people may not publish again."""
    if paths.source(dataset).is_file() and not read_source(paths, dataset).republish:
        fix = "name its address, so that others can fetch it with `ajgdata fetch`"
        raise DataError(dataset, "its recordings may not be published again", fix)


def published_files(tree: Tree) -> dict[str, Path]:
    """Return all files of a published folder by name."""
    return {
        path.relative_to(tree.root).as_posix(): path
        for path in sorted(tree.root.rglob("*"))
        if path.is_file()
    }


def top_files(tree: Tree) -> dict[str, Path]:
    """Return the files of a published folder that are in no folder below it, by name."""
    return {name: path for name, path in published_files(tree).items() if "/" not in name}


def archived_files(tree: Tree) -> dict[str, Path]:
    """Return the files in folders, by name, without the recordings: they have their own archive."""
    return {
        name: path
        for name, path in published_files(tree).items()
        if "/" in name and not name.startswith(f"{AUDIO_FOLDER}/")
    }


@dataclass(frozen=True)
class HubDestination:
    """A data set repository of Hugging Face."""

    repository: str

    def check(self, declaration: Path, spec: DatasetSpec) -> None:
        """Accept every data set."""

    def sizes(self, tree: Tree) -> dict[str, int]:
        """Return the sizes of all files of a published folder."""
        return {name: path.stat().st_size for name, path in published_files(tree).items()}

    def visibility(self) -> str:
        """Return the visibility of the repository, see `Destination`."""
        is_private = hub.is_private(self.repository)
        if is_private is None:
            return "the repository is new and private"
        if is_private:
            return "the repository exists and is private"
        return "the repository exists and is public: everyone can see the files at once"

    def send(self, tree: Tree, spec: DatasetSpec) -> list[str]:
        """Send all files, see `Destination`."""
        is_private = hub.upload(self.repository, published_files(tree), tree.root, spec.version)
        page = f"https://huggingface.co/datasets/{self.repository}"
        lines = [f"sent and checked: {page}"]
        if is_private:
            lines.append(f"only your account can see it; make it public at {page}/settings")
        return [*lines, f"others then use: ajgdata fetch {HUB_PREFIX}{self.repository}"]


@dataclass(frozen=True)
class ZenodoDestination:
    """A draft of a deposit at Zenodo."""

    zenodo: Zenodo

    def check(self, declaration: Path, spec: DatasetSpec) -> None:
        """Raise DataError without authors, or without a licence that Zenodo can know."""
        if not spec.authors:
            raise DataError(declaration, "has no authors, which Zenodo requires", "add `authors`")
        if not licence_identifier(spec.licence):
            problem = f"licence {spec.licence!r} is not an SPDX identifier, which Zenodo requires"
            raise DataError(declaration, problem, "use for example `licence: CC-BY-4.0`")
        if spec.doi:
            self.zenodo.draft(spec.doi)

    def reserve_doi(self, declaration: Path) -> str:
        """Create a draft and write its DOI into dataset.yaml; return the DOI."""
        doi = self.zenodo.reserve().doi
        add_doi(declaration, doi)
        return doi

    def sizes(self, tree: Tree) -> dict[str, int]:
        """Return the sizes of the files of the top folder, and of the archive of all folders.

        Zenodo has no folders. The archive is not compressed.
        """
        sizes = {name: path.stat().st_size for name, path in top_files(tree).items()}
        archived = sum(path.stat().st_size for path in archived_files(tree).values())
        return {**sizes, Tree.FOLDERS: archived}

    def visibility(self) -> str:
        """Return the visibility of a draft, see `Destination`."""
        return "a draft is private until you publish it"

    def send(self, tree: Tree, spec: DatasetSpec) -> list[str]:
        """Send the files and the description, see `Destination`."""
        draft = self.zenodo.draft(spec.doi)
        self.zenodo.describe(draft, deposit_metadata(tree))
        files = top_files(tree)
        with TemporaryDirectory() as folder:
            files[Tree.FOLDERS] = Path(folder) / Tree.FOLDERS
            with ZipFile(files[Tree.FOLDERS], "w") as packed:
                for name, path in archived_files(tree).items():
                    archive.add(packed, name, path.read_bytes())
            for name in tracked(list(files), "sending"):
                self.zenodo.send(draft, name, files[name])
        lines = [f"sent and checked: draft {spec.doi}"]
        extra = sorted(draft.files.keys() - files.keys())
        if extra:
            lines.append(f"also in the draft, from elsewhere: {', '.join(extra)}")
        return [
            *lines,
            f"nothing is public yet: check the draft and press Publish at {draft.page}",
            f"others then use: ajgdata fetch doi:{spec.doi}",
        ]


def add_doi(declaration: Path, doi: str) -> None:
    """Add the key `doi` at the end of dataset.yaml, whose other bytes stay.

    Raises DataError with the line to add if the file has another form than one key per line.
    """
    content = declaration.read_bytes()
    before = read_yaml(declaration)
    line_end = b"\r\n" if b"\r\n" in content else b"\n"
    end = b"" if content.endswith(b"\n") else line_end
    write_bytes(declaration, b"".join((content, end, f"doi: {doi}".encode(), line_end)))
    try:
        is_added = read_yaml(declaration) == {**before, "doi": doi}
    except DataError:
        is_added = False
    if not is_added:
        write_bytes(declaration, content)
        fix = f"add `doi: {doi}` to it, then run it again"
        raise DataError(declaration, f"the draft {doi} exists, but is not stated here", fix)
