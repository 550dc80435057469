"""Facts of a published data set that croissant.json, datapackage.json and README.md share."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal, NamedTuple

from ajgdata.paths import Tree
from ajgdata.types import DatasetSpec

#: Licences of dataset.yaml that state none.
NO_LICENCE = ("", "not stated", "none stated")


class DescribedFile(NamedTuple):
    """A file of a published data set: name in datapackage.json, suffix, media type, description."""

    name: str
    suffix: str
    media_type: str
    description: str


#: Files that both documents describe, by path.
DESCRIBED_FILES = {
    Tree.METADATA: DescribedFile("metadata", "csv", "text/csv", "labels of every recording"),
    Tree.FEATURES: DescribedFile("features", "nc", "application/x-netcdf", "spectrum and labels"),
    Tree.ARCHIVE: DescribedFile("audio", "zip", "application/zip", "the recordings"),
}


def licence_identifier(licence: str) -> str:
    """Return a licence that is written as an SPDX identifier; empty for another text.

    >>> licence_identifier("CC-BY-4.0"), licence_identifier("not stated")
    ('CC-BY-4.0', '')
    """
    return licence if re.fullmatch(r"[A-Za-z0-9.+-]+", licence) else ""


def described_files(spec: DatasetSpec) -> dict[str, DescribedFile]:
    """Return the files that both documents describe, by path; without sound there is no archive."""
    if spec.features.needs_waveform:
        return DESCRIBED_FILES
    features = DESCRIBED_FILES[Tree.FEATURES]._replace(description="features and labels")
    return {Tree.METADATA: DESCRIBED_FILES[Tree.METADATA], Tree.FEATURES: features}


@dataclass(frozen=True)
class About:
    """Data set config, source, date (e.g. `2026-01-31`) and device of a published data set."""

    spec: DatasetSpec
    source: Literal["simulated", "recorded"]
    date: str
    has_gripper: bool = True

    @property
    def title(self) -> str:
        """Title of the data set."""
        return self.spec.title or self.spec.name

    @property
    def description(self) -> str:
        """Description of the data set; its title if it has none."""
        return self.spec.description or self.title

    @property
    def authors(self) -> tuple[str, ...]:
        """Names of the authors; a placeholder if dataset.yaml has none."""
        unnamed = {"simulated": "The ajgdata developers", "recorded": "Authors not named"}
        return self.spec.authors or (unnamed[self.source],)

    @property
    def spdx(self) -> str:
        """SPDX identifier of the licence; empty if the licence is not written as one."""
        return licence_identifier(self.spec.licence)

    @property
    def licence_url(self) -> str:
        """Address of the licence's text; empty if unknown."""
        return f"https://spdx.org/licenses/{self.spdx}.html" if self.spdx else ""

    @property
    def is_unlicensed(self) -> bool:
        """True if dataset.yaml does not state a licence."""
        return self.spec.licence.strip().lower() in NO_LICENCE

    @property
    def keywords(self) -> list[str]:
        """Keywords for search."""
        gripper = ["jamming gripper", "soft robotics", "tactile"] if self.has_gripper else []
        return ["acoustic sensing", *gripper, self.source]

    @property
    def doi_url(self) -> str:
        """Address of the DOI; empty without a DOI."""
        return f"https://doi.org/{self.spec.doi}" if self.spec.doi else ""

    @property
    def reference(self) -> str:
        """Citation on one line, with the DOI."""
        text = self.spec.citation
        if not text:
            names = ", ".join(self.authors)
            year = f" ({self.date[:4]})" if self.date else ""
            text = f"{names}{year}. {self.title}, version {self.spec.version}. Data set."
        if self.spec.doi and self.spec.doi not in text:
            text = f"{text} {self.doi_url}"
        return text
