"""croissant.json: the description of a published data set for Croissant 1.0."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import mlcroissant as mlc

from ajgdata.paths import AUDIO_FOLDER, Tree
from ajgdata.store.publishing.about import About, described_files
from ajgdata.store.publishing.table import FILE_NAME, PublishedTable

#: Record sets of croissant.json.
RECORDINGS = "recordings"
AUDIO = "audio"
_AUDIO_FILES = "audio-files"
_AUDIO_TYPES = {
    ".aac": "audio/aac",
    ".aif": "audio/aiff",
    ".aiff": "audio/aiff",
    ".flac": "audio/flac",
    ".m4a": "audio/mp4",
    ".mp3": "audio/mpeg",
    ".oga": "audio/ogg",
    ".ogg": "audio/ogg",
    ".opus": "audio/ogg",
}
#: Media type (as in mlcroissant) and description of the file from which Croissant reads labels.
_TYPED_FILE = ("application/x-parquet", "labels of every recording, with the type of each column")


def croissant(
    about: About, table: PublishedTable, hashes: Mapping[str, str], sizes: Mapping[str, int]
) -> dict[str, Any]:
    """Return croissant.json; `hashes` and `sizes` (bytes) are those of the files it names."""
    record_sets = [_recordings(table)]
    if about.spec.features.needs_waveform:
        record_sets.append(_audio())
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
        url=about.spec.url or about.doi_url or "https://arxiv.org/abs/2603.00351",
        version=about.spec.version,
        distribution=_distribution(about, table, hashes, sizes),
        record_sets=record_sets,
    )
    document: dict[str, Any] = metadata.to_json()
    return {**document, "alternateName": about.title}


def _distribution(
    about: About, table: PublishedTable, hashes: Mapping[str, str], sizes: Mapping[str, int]
) -> list[Any]:
    """Return the files of the data set, and the set of recordings in the archive, if it has one."""
    described = {
        path: (file.media_type, file.description)
        for path, file in described_files(about.spec).items()
    }
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
    if not about.spec.features.needs_waveform:
        return files
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
    name = _file_property(mlc.FileProperty.fullpath)
    content = _file_property(mlc.FileProperty.content)
    fields = [
        (FILE_NAME, "as in the other record set", mlc.DataType.TEXT, name),
        ("content", "bytes of the file", mlc.DataType.AUDIO_OBJECT, content),
    ]
    return _record_set(AUDIO, "the recordings, one record per file", FILE_NAME, fields)


def _file_property(extracted: mlc.FileProperty) -> Any:
    """Return a property of each recording in the archive."""
    return mlc.Source(file_set=_AUDIO_FILES, extract=mlc.Extract(file_property=extracted))


def _record_set(
    identity: str, description: str, key: str, fields: Sequence[tuple[str, str, Any, Any]]
) -> Any:
    """Return a record set of `fields`: name, description, type and source."""
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
