"""source.yaml: the source of the recordings of a public data set."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from ajgdata.types.base import Strict


def _checked_subfolder(path: str) -> str:
    """Return `path`. Raises ValueError unless it is "", or a path below a folder."""
    steps = path.split("/") if path else []
    has_forbidden_step = not {"", ".", "..", ".git"}.isdisjoint(steps)
    if path.strip() != path or "\\" in path or ":" in path or has_forbidden_step:
        raise ValueError("is not a path inside a folder, such as 'data/day1'")
    return path


Subfolder = Annotated[str, AfterValidator(_checked_subfolder)]
Address = Annotated[str, Field(pattern=r"^https://[A-Za-z0-9.-]+/[^\s?#]+$")]


class GitPart(Strict):
    """One folder of a git repository at one commit."""

    commit: str = Field(
        pattern=r"^[0-9a-f]{40}$",
        description="full hash of the commit, which identifies the content of all files",
    )
    folder: Subfolder = Field("", description="folder in the repository; default: all folders")
    into: Subfolder = Field(
        "", description="subfolder for the files; default: the folder that is imported"
    )


class GitOrigin(Strict):
    """The folders of a git repository that contain the recordings."""

    repository: Address = Field(description="public address of the repository")
    parts: tuple[GitPart, ...] = Field(min_length=1, description="folders that are downloaded")

    @model_validator(mode="after")
    def _separate_folders(self) -> GitOrigin:
        folders = [part.into for part in self.parts]
        if len(set(folders)) < len(folders):
            raise ValueError("two parts are written into one folder: give them different `into`")
        return self


class DatasetSource(Strict):
    """source.yaml: the source of the recordings of a data set.

    The dataset.yaml in the same folder describes the recordings, their licence and their import.
    """

    status: Literal["run in part", "not yet run"] = Field(
        description="whether the workflow has used these recordings, at least in part"
    )
    size_mb: float = Field(gt=0, description="approximate size of the download in MB")
    republish: bool = Field(
        False, description="whether the licence permits users to publish the recordings again"
    )
    origin: GitOrigin = Field(description="place from which the recordings are downloaded")
