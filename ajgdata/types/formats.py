"""Versions of the formats of files, and the error for a file of another version.

A format gets a new version if this package cannot read, or misreads, files of the version before.
Anyone who changes a format adds a sentence to its history. Results are computed again; a format of
other files names the command that brings older files to the new version.
"""

from __future__ import annotations

import reprlib
from dataclasses import dataclass

from ajgdata.types.base import DataError

#: Key, or attribute, that states the version in a file.
FORMAT_KEY = "format"
#: The same in the data package of a published data set, which other programs read.
PACKAGE_KEY = "ajgdata_format"


class FormatError(DataError):
    """A file of another version of its format."""


@dataclass(frozen=True)
class FileFormat:
    """The format of some files: their names, the place of the version, and what each version is.

    `history` has one sentence per version, that of version 1 first. `renewal` is the clause with
    the command that brings a file of an earlier version to the last one; a result has none, because
    it is computed again.
    """

    files: str
    place: str
    history: tuple[str, ...]
    renewal: str = ""
    is_result: bool = False

    @property
    def version(self) -> int:
        """The version that this package reads and writes."""
        return len(self.history)

    @property
    def unstated(self) -> int | None:
        """Version of a file that states no version; None: such a file is not read.

        Before the versions, results had several formats, and all other files had one.
        """
        return None if self.is_result else 1

    def fix(self, command: str) -> str:
        """Return the clause with the command that brings a file to the last version.

        `command` computes a result again; "" if there is no command.
        """
        if not self.is_result:
            return self.renewal
        if not command:
            return "compute it again with this version of ajgdata"
        return f"run `{command}`, which computes it again"

    def check(self, where: object, stated: object, command: str = "") -> None:
        """Raise FormatError unless a file states the version of this package.

        `stated` is the value in the file, or None. `command` computes a result again.
        """
        number = self.unstated if stated is None else stated
        fix = self.fix(command)
        reads = f"this version of ajgdata reads format {self.version}"
        if number is None:
            raise FormatError(where, f"states no format; {reads}", fix)
        if type(number) is not int or number < 1:  # True is an int, too
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
#: A table has no place for its version: session.yaml of the same folder states it.
SESSION_FORMAT = FileFormat(
    files="`session.yaml` and `recordings.csv`",
    place="key `format` of `session.yaml`",
    history=("keys and columns as in docs/configuration.md",),
)
FEATURES_FORMAT = FileFormat(
    files="feature files",
    place="attribute `format`",
    history=("spectra (recording, frequency) and labels along `recording`",),
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
