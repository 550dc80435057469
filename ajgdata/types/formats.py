"""Versions of the file formats, and the error for a file of another version.

A format gets a new version if this package cannot read, or misreads, files of the previous version.
A change of a format adds a sentence to its history. Results of another version are computed again.
Each other format names the command that converts older files.
"""

from __future__ import annotations

import reprlib
from dataclasses import dataclass

from ajgdata.types.errors import DataError

#: Key or attribute with the version in a file.
FORMAT_KEY = "format"
#: Key with the version in datapackage.json of a published data set, which other programs read.
PACKAGE_KEY = "ajgdata_format"


class FormatError(DataError):
    """A file of another version of its format."""


@dataclass(frozen=True)
class FileFormat:
    """The format of one kind of file, and the description of each version."""

    files: str  #: names of the files, for people
    place: str  #: place of the version in a file, for people
    history: tuple[str, ...]  #: one sentence per version, version 1 first
    #: Clause with the action that converts a file of an earlier version; "" if version 1 is the
    #: only version, and for results, which are computed again.
    renewal: str = ""
    is_result: bool = False  #: whether the workflow computes these files

    @property
    def version(self) -> int:
        """The version that this package reads and writes."""
        return len(self.history)

    @property
    def unstated(self) -> int | None:
        """Version of a file without a version; None if such a file is not read.

        Before files had versions, results had several formats, and all other files had one.
        """
        return None if self.is_result else 1

    def fix(self, command: str) -> str:
        """Return the clause that says how to get a file of the present version.

        `command` computes a result again; "" if there is no command.
        """
        if not self.is_result:
            return self.renewal
        if not command:
            return "compute it again with this version of ajgdata"
        return f"run `{command}`, which computes it again"

    def check(self, where: object, stated: object, command: str = "") -> None:
        """Raise FormatError unless the version in a file is that of this package.

        `stated` is the value in the file, or None. `command` computes a result again.
        """
        number = self.unstated if stated is None else stated
        fix = self.fix(command)
        reads = f"this version of ajgdata reads format {self.version}"
        if number is None:
            raise FormatError(where, f"states no format; {reads}", fix)
        if type(number) is not int or number < 1:  # isinstance would accept True
            problem = f"{FORMAT_KEY} = {reprlib.repr(number)} is not a version; {reads}"
            raise FormatError(where, problem, fix if self.is_result else "correct the value")
        if number > self.version:
            problem = f"format {number} is of a later version of ajgdata; {reads}"
            raise FormatError(where, problem, fix if self.is_result else "update ajgdata")
        if number < self.version:
            problem = f"format {number} is of an earlier version of ajgdata; {reads}"
            raise FormatError(where, problem, fix)


DATASET_FORMAT = FileFormat(
    files="`dataset.yaml`",
    place="key `format`",
    history=("keys as in docs/configuration.md",),
)
#: session.yaml states the version of the other files in its folder: a CSV table cannot contain it.
SESSION_FORMAT = FileFormat(
    files="`session.yaml`, `recordings.csv` and `changes.jsonl`",
    place="key `format` of `session.yaml`",
    history=("keys and columns as in docs/configuration.md",),
)
FEATURES_FORMAT = FileFormat(
    files="feature files",
    place="attribute `format`",
    history=("features (recording, …) and labels along `recording`",),
    is_result=True,
)
LATENTS_FORMAT = FileFormat(
    files="embedding vectors",
    place="attribute `format`",
    history=("vectors (fold, init, recording, dimension) and labels along `recording`",),
    is_result=True,
)
MODEL_FORMAT = FileFormat(
    files="final models",
    place="key `format` of `model.json`",
    history=(
        "model.json, the estimator (skops) and the arrays of the novelty detection",
        "model.json, the estimator (skops) and the arrays of the novelty detection with objects",
    ),
    is_result=True,
)
TABLES_FORMAT = FileFormat(
    files="tables of experiments and studies (JSON)",
    place="key `format`",
    history=(
        "infinity is stored as the text `inf`, and no version is stated",
        "infinity is stored as an object, so a label `inf` stays a text",
        "scores have columns for split, test set and condition instead of codes in `part`",
    ),
    is_result=True,
)
METRICS_FORMAT = FileFormat(
    files="`metrics.csv` and `predictions.csv`",
    place="column `format`",
    history=(
        "codes in the columns `part` and `task`, and no version is stated",
        "columns as in docs/comparing.md",
    ),
    is_result=True,
)
PUBLISHED_FORMAT = FileFormat(
    files="published data sets",
    place="key `ajgdata_format` of `datapackage.json`",
    history=("files as in docs/publishing.md",),
    renewal="ask its authors to publish it again with this version of ajgdata",
)
#: All formats, in the order of the table in docs/data-model.md.
FORMATS = (
    DATASET_FORMAT,
    SESSION_FORMAT,
    FEATURES_FORMAT,
    LATENTS_FORMAT,
    MODEL_FORMAT,
    TABLES_FORMAT,
    METRICS_FORMAT,
    PUBLISHED_FORMAT,
)
