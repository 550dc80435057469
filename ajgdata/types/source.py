"""source.yaml: source of the recordings of a public data set."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from ajgdata.types.base import Strict


def _inside(path: str) -> str:
    steps = path.split("/") if path else []
    if path.strip() != path or "\\" in path or ":" in path or {"", ".", "..", ".git"} & {*steps}:
        raise ValueError("is no path inside a folder, such as 'data/day1'")
    return path


Inside = Annotated[str, AfterValidator(_inside)]
Address = Annotated[str, Field(pattern=r"^https://[A-Za-z0-9.-]+/[^\s?#]+$")]


class GitPart(Strict):
    """One folder of a repository at one commit."""

    commit: str = Field(
        pattern=r"^[0-9a-f]{40}$", description="the full hash, which holds every byte below it"
    )
    folder: Inside = Field("", description="inside the repository; default: all of it")
    into: Inside = Field("", description="folder that gets it; default: that which is imported")


class GitOrigin(Strict):
    """Folders of a git repository. The hash of a commit covers every byte below it."""

    repository: Address = Field(description="its public address")
    parts: tuple[GitPart, ...] = Field(min_length=1, description="what is brought of it")

    @model_validator(mode="after")
    def _apart(self) -> GitOrigin:
        places = [part.into for part in self.parts]
        if len({*places}) < len(places):
            raise ValueError("two parts are brought into one folder: give them other names by into")
        return self


class DatasetSource(Strict):
    """source.yaml: source of the recordings of a data set. Its dataset.yaml describes them,
    their licence, and how they are read."""

    status: Literal["run in part", "not yet run"] = Field(
        description="what was done with these recordings when this was written"
    )
    size_mb: float = Field(gt=0, description="about how much is brought")
    republish: bool = Field(
        False, description="whether the licence lets others hand the recordings on"
    )
    origin: GitOrigin = Field(description="where they are downloaded from")
