"""Description of a published data set: croissant.json (Croissant 1.0) and datapackage.json
(Frictionless), with the libraries of both formats."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from ajgdata.paths import AUDIO_FOLDER, Tree
from ajgdata.store.files import read_json
from ajgdata.store.publishing.table import FILE_NAME, PublishedColumn, PublishedTable
from ajgdata.types import DataError, DatasetSpec
from ajgdata.types.formats import PACKAGE_KEY, PUBLISHED_FORMAT

#: Record sets of croissant.json.
RECORDINGS, AUDIO = "recordings", "audio"
#: Largest datapackage.json that is read; it has a few lines per column of the labels.
MAX_PACKAGE_BYTES = 8 * 2**20
NO_LICENCE = ("", "not stated", "none stated")
_AUDIO_FILES = "audio-files"
_AUDIO_TYPES = {".flac": "audio/flac", ".ogg": "audio/ogg"}
#: Files that both documents describe: name in the data package, format, type and description.
_FILES = {
    Tree.METADATA: ("metadata", "csv", "text/csv", "labels of every recording"),
    Tree.FEATURES: ("features", "nc", "application/x-netcdf", "spectrum and labels"),
    Tree.ARCHIVE: ("audio", "zip", "application/zip", "the recordings"),
}
#: Type (as mlcroissant names it) and description of the file that Croissant reads the labels from.
_TYPED_FILE = ("application/x-parquet", "labels of every recording, with the type of each column")
#: Form of metadata.csv. Frictionless guesses a form that is not stated.
_CSV_DIALECT = {
    "delimiter": ",",
    "lineTerminator": "\n",
    "quoteChar": '"',
    "doubleQuote": True,
    "skipInitialSpace": False,
}


@dataclass(frozen=True)
class About:
    """Data set config, source, date (`2026-01-31`) and kind of device of a published data set."""

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
        is_identifier = re.fullmatch(r"[A-Za-z0-9.+-]+", self.spec.licence)
        return self.spec.licence if is_identifier else ""

    @property
    def licence_url(self) -> str:
        """Address of the licence's text; empty if unknown."""
        return f"https://spdx.org/licenses/{self.spdx}.html" if self.spdx else ""

    @property
    def is_unlicensed(self) -> bool:
        """True if dataset.yaml states no licence."""
        return self.spec.licence.strip().lower() in NO_LICENCE

    @property
    def keywords(self) -> list[str]:
        """Keywords for search."""
        gripper = ["jamming gripper", "soft robotics", "tactile"] if self.has_gripper else []
        return ["acoustic sensing", *gripper, self.source]

    @property
    def reference(self) -> str:
        """Citation on one line."""
        year = f" ({self.date[:4]})" if self.date else ""
        names, version = ", ".join(self.authors), self.spec.version
        return self.spec.citation or f"{names}{year}. {self.title}, version {version}. Data set."


def croissant(
    about: About, table: PublishedTable, hashes: Mapping[str, str], sizes: Mapping[str, int]
) -> dict[str, Any]:
    """Return croissant.json; `hashes` and `sizes` (bytes) are those of the files it names."""
    import mlcroissant as mlc

    metadata = mlc.Metadata(
        name=about.spec.name,
        description=about.description,
        cite_as=about.reference,
        conforms_to="http://mlcommons.org/croissant/1.0",
        creators=[mlc.Person(name=name) for name in about.authors],
        date_published=about.date or None,
        in_language=["en"],
        keywords=about.keywords,
        license=[about.licence_url or about.spec.licence],
        url=about.spec.url or "https://arxiv.org/abs/2603.00351",
        version=about.spec.version,
        distribution=_distribution(table, hashes, sizes),
        record_sets=[_recordings(table), _audio()],
    )
    document: dict[str, Any] = metadata.to_json()
    return {**document, "alternateName": about.title}


def _distribution(
    table: PublishedTable, hashes: Mapping[str, str], sizes: Mapping[str, int]
) -> list[Any]:
    """Return the files of the data set, and the set of recordings in the archive."""
    import mlcroissant as mlc

    described = {name: (mime, text) for name, (_, _, mime, text) in _FILES.items()}
    described[Tree.TYPED_METADATA] = _TYPED_FILE
    files: list[Any] = [
        mlc.FileObject(
            id=name,
            name=name,
            description=description,
            content_url=name,
            content_size=f"{sizes[name]} B",
            encoding_formats=[mime],
            sha256=hashes[name],
        )
        for name, (mime, description) in described.items()
    ]
    suffixes = sorted({Path(row[FILE_NAME]).suffix for row in table.rows})
    audio = mlc.FileSet(
        id=_AUDIO_FILES,
        name=_AUDIO_FILES,
        description="the recordings, one file each",
        contained_in=[Tree.ARCHIVE],
        encoding_formats=sorted({_AUDIO_TYPES.get(suffix, "audio/wav") for suffix in suffixes}),
        includes=[f"{AUDIO_FOLDER}/*{suffix}" for suffix in suffixes],
    )
    return [*files, audio]


def _recordings(table: PublishedTable) -> Any:
    """Return the record set of the labels: a field for each column of metadata.parquet."""
    import mlcroissant as mlc

    types = {"string": mlc.DataType.TEXT, "integer": mlc.DataType.INTEGER}
    fields = []
    for column in table.columns:
        unit = f" ({column.unit})" if column.unit else ""
        extract = mlc.Extract(column=column.name)
        source = mlc.Source(file_object=Tree.TYPED_METADATA, extract=extract)
        text = column.description or column.name
        data_type = types.get(column.data_type, mlc.DataType.FLOAT)
        fields.append((column.name, f"{text}{unit}", data_type, source))
    return _record_set(RECORDINGS, "labels, one record per recording", "recording", fields)


def _audio() -> Any:
    """Return the record set of the files: name (as in the other record set) and bytes."""
    import mlcroissant as mlc

    name, content = (
        mlc.Source(file_set=_AUDIO_FILES, extract=mlc.Extract(file_property=extracted))
        for extracted in (mlc.FileProperty.fullpath, mlc.FileProperty.content)
    )
    fields = [
        (FILE_NAME, "as in the other record set", mlc.DataType.TEXT, name),
        ("content", "bytes of the file", mlc.DataType.AUDIO_OBJECT, content),
    ]
    return _record_set(AUDIO, "the recordings, one record per file", FILE_NAME, fields)


def _record_set(
    identity: str, description: str, key: str, fields: Sequence[tuple[str, str, Any, Any]]
) -> Any:
    """Return a record set of `fields`: name, description, type and source."""
    import mlcroissant as mlc

    return mlc.RecordSet(
        id=identity,
        name=identity,
        description=description,
        key=[f"{identity}/{key}"],
        fields=[
            mlc.Field(
                id=f"{identity}/{name}",
                name=name,
                description=text,
                data_types=[data_type],
                source=source,
            )
            for name, text, data_type, source in fields
        ],
    )


def datapackage(
    about: About, table: PublishedTable, hashes: Mapping[str, str], sizes: Mapping[str, int]
) -> dict[str, Any]:
    """Return datapackage.json; `hashes` and `sizes` (bytes) are those of the files it names."""
    import frictionless

    resources = [
        frictionless.Resource(
            name=name,
            path=path,
            format=suffix,
            mediatype=mime,
            hash=f"sha256:{hashes[path]}",
            bytes=sizes[path],
        )
        for path, (name, suffix, mime, _) in _FILES.items()
    ]
    resources[0].encoding = "utf-8"
    resources[0].schema = frictionless.Schema.from_descriptor(
        {
            "fields": [_field(column) for column in table.columns],
            "primaryKey": ["recording"],
            "missingValues": [""],
        }
    )
    package = frictionless.Package(
        name=about.spec.name.lower(),
        title=about.title,
        description=about.description,
        version=about.spec.version,
        keywords=about.keywords,
        created=f"{about.date}T00:00:00Z" if about.date else None,
        homepage=about.spec.url or None,
        licenses=[{"name": about.spdx, "path": about.licence_url}] if about.spdx else [],
        contributors=[{"title": name, "role": "author"} for name in about.authors],
        resources=resources,
    )
    document: dict[str, Any] = package.to_descriptor()
    document["resources"][0]["dialect"] = {"csv": _CSV_DIALECT}
    document[PACKAGE_KEY] = PUBLISHED_FORMAT.version
    return document


def check_published_format(tree: Tree) -> None:
    """Raise FormatError if another version of ajgdata published the data set in a folder.

    Raises DataError if datapackage.json is not a JSON object. A folder without this file states no
    version.
    """
    path = tree / Tree.DATAPACKAGE
    if not path.is_file():
        return
    again = "fetch or copy it again"
    try:
        content = read_json(path, MAX_PACKAGE_BYTES)
    except DataError as error:
        raise DataError(error.where, error.problem, again) from None
    if not isinstance(content, dict):
        raise DataError(path, "is not a JSON object", again)
    PUBLISHED_FORMAT.check(path, content.get(PACKAGE_KEY))


def _field(column: PublishedColumn) -> dict[str, Any]:
    required = column.name in ("recording", FILE_NAME, "sha256")
    described = {"description": column.description, "unit": column.unit}
    return {
        "name": column.name,
        "type": column.data_type,
        **{key: text for key, text in described.items() if text},
        "constraints": {"required": required, "unique": required and column.name != "sha256"},
    }
