"""datapackage.json: a Frictionless data package."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ajgdata.paths import Tree
from ajgdata.store.publishing.about import About
from ajgdata.store.publishing.table import PublishedColumn, Table

#: Name of the resource that holds the labels.
LABELS = "metadata"


def datapackage(
    about: About, table: Table, hashes: Mapping[str, str], sizes: Mapping[str, int]
) -> dict[str, Any]:
    """Return the descriptor; `hashes` and `sizes` (bytes) are those of the files that it names."""
    licence = {"name": about.spdx, "path": about.licence_url} if about.spdx else None
    return {
        "profile": "data-package",
        "name": about.name.lower(),
        "title": about.title,
        "description": about.description or about.title,
        "version": about.version,
        "keywords": about.keywords,
        **({"created": f"{about.date}T00:00:00Z"} if about.date else {}),
        **({"homepage": about.url} if about.url else {}),
        **({"licenses": [licence]} if licence else {}),
        "contributors": [{"title": name, "role": "author"} for name in about.authors],
        "resources": [
            {
                **_file(LABELS, Tree.METADATA, "csv", "text/csv", hashes, sizes),
                "profile": "tabular-data-resource",
                "encoding": "utf-8",
                "schema": _schema(table),
            },
            _file("features", Tree.FEATURES, "nc", "application/x-netcdf", hashes, sizes),
            _file("audio", Tree.ARCHIVE, "zip", "application/zip", hashes, sizes),
        ],
    }


def _file(
    name: str,
    path: str,
    suffix: str,
    mime: str,
    hashes: Mapping[str, str],
    sizes: Mapping[str, int],
) -> dict[str, Any]:
    return {
        "name": name,
        "path": path,
        "format": suffix,
        "mediatype": mime,
        "hash": f"sha256:{hashes[path]}",
        "bytes": sizes[path],
    }


def _schema(table: Table) -> dict[str, Any]:
    return {
        "fields": [_field(column) for column in table.columns],
        "missingValues": [""],
        "primaryKey": ["recording"],
    }


def _field(column: PublishedColumn) -> dict[str, Any]:
    described = {"description": column.description} if column.description else {}
    unit = {"unit": column.unit} if column.unit else {}
    required = column.name in ("recording", "file_name", "sha256")
    return {
        "name": column.name,
        "type": column.kind,
        **described,
        **unit,
        "constraints": {"required": required, "unique": required and column.name != "sha256"},
    }
