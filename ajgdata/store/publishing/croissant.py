"""croissant.json: Croissant 1.0 with its vocabulary for responsible AI."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ajgdata.paths import AUDIO_FOLDER, Tree
from ajgdata.store.publishing.about import About
from ajgdata.store.publishing.table import FILE_NAME, PublishedColumn, Table

RECORDINGS, AUDIO = "recordings", "audio"
AUDIO_FILES = "audio-files"
MIME = {".wav": "audio/wav", ".wave": "audio/wav", ".flac": "audio/flac", ".ogg": "audio/ogg"}
_TYPES = {"string": "sc:Text", "integer": "sc:Integer", "number": "sc:Float"}
#: The context of Croissant 1.0, spelled out: a reader need not fetch anything.
CONTEXT: dict[str, Any] = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "citeAs": "cr:citeAs",
    "column": "cr:column",
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "equivalentProperty": "cr:equivalentProperty",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "extract": "cr:extract",
    "field": "cr:field",
    "fileObject": "cr:fileObject",
    "fileProperty": "cr:fileProperty",
    "fileSet": "cr:fileSet",
    "format": "cr:format",
    "includes": "cr:includes",
    "isLiveDataset": "cr:isLiveDataset",
    "jsonPath": "cr:jsonPath",
    "key": "cr:key",
    "md5": "cr:md5",
    "parentField": "cr:parentField",
    "path": "cr:path",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "recordSet": "cr:recordSet",
    "references": "cr:references",
    "regex": "cr:regex",
    "repeated": "cr:repeated",
    "replace": "cr:replace",
    "samplingRate": "cr:samplingRate",
    "sc": "https://schema.org/",
    "separator": "cr:separator",
    "source": "cr:source",
    "subField": "cr:subField",
    "transform": "cr:transform",
}


def croissant(
    about: About, table: Table, hashes: Mapping[str, str], sizes: Mapping[str, int]
) -> dict[str, Any]:
    """Return the document; `hashes` and `sizes` (bytes) are those of the files that it names."""
    dated = {"datePublished": about.date} if about.date else {}
    return {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "name": about.name,
        "alternateName": about.title,
        "description": about.description or about.title,
        "citeAs": about.reference,
        "creator": [{"@type": "sc:Person", "name": name} for name in about.authors],
        "inLanguage": "en",
        "isLiveDataset": False,
        "keywords": about.keywords,
        "license": about.licence_url or about.licence,
        "url": about.url or "https://arxiv.org/abs/2603.00351",
        "version": about.version,
        **dated,
        "distribution": _distribution(table, hashes, sizes),
        "recordSet": [_recordings(table), _audio()],
    }


def _distribution(
    table: Table, hashes: Mapping[str, str], sizes: Mapping[str, int]
) -> list[dict[str, Any]]:
    formats = {
        Tree.METADATA: ("text/csv", "labels of every recording"),
        Tree.FEATURES: ("application/x-netcdf", "spectrum and labels of every recording"),
        Tree.ARCHIVE: ("application/zip", "the recordings"),
    }
    files = [
        {
            "@type": "cr:FileObject",
            "@id": name,
            "name": name,
            "description": description,
            "contentUrl": name,
            "contentSize": f"{sizes[name]} B",
            "encodingFormat": mime,
            "sha256": hashes[name],
        }
        for name, (mime, description) in formats.items()
    ]
    suffixes = sorted({Path(row[FILE_NAME]).suffix for row in table.rows})
    audio = {
        "@type": "cr:FileSet",
        "@id": AUDIO_FILES,
        "name": AUDIO_FILES,
        "description": "the recordings, one file each",
        "containedIn": {"@id": Tree.ARCHIVE},
        "encodingFormat": MIME.get(suffixes[0], "audio/wav") if suffixes else "audio/wav",
        "includes": [f"{AUDIO_FOLDER}/*{suffix}" for suffix in suffixes],
    }
    return [*files, audio]


def _recordings(table: Table) -> dict[str, Any]:
    return {
        "@type": "cr:RecordSet",
        "@id": RECORDINGS,
        "name": RECORDINGS,
        "description": "labels, one record for each recording",
        "key": {"@id": f"{RECORDINGS}/recording"},
        "field": [_field(column) for column in table.columns],
    }


def _field(column: PublishedColumn) -> dict[str, Any]:
    unit = f" ({column.unit})" if column.unit else ""
    return {
        "@type": "cr:Field",
        "@id": f"{RECORDINGS}/{column.name}",
        "name": column.name,
        "description": f"{column.description or column.name}{unit}",
        "dataType": _TYPES[column.kind],
        "source": {"fileObject": {"@id": Tree.METADATA}, "extract": {"column": column.name}},
    }


def _audio() -> dict[str, Any]:
    """Return the name and bytes of each recording; the name is `file_name` of the other record
    set."""
    parts = {
        FILE_NAME: ("sc:Text", "fullpath", "as in the other record set"),
        "content": ("sc:AudioObject", "content", "bytes of the file"),
    }
    fields = [
        {
            "@type": "cr:Field",
            "@id": f"{AUDIO}/{name}",
            "name": name,
            "description": description,
            "dataType": kind,
            "source": {"fileSet": {"@id": AUDIO_FILES}, "extract": {"fileProperty": extracted}},
        }
        for name, (kind, extracted, description) in parts.items()
    ]
    return {
        "@type": "cr:RecordSet",
        "@id": AUDIO,
        "name": AUDIO,
        "description": "the recordings, one record for each file",
        "key": {"@id": f"{AUDIO}/{FILE_NAME}"},
        "field": fields,
    }
