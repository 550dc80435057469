"""datapackage.json: the description of a published data set for Frictionless."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import frictionless

from ajgdata.store.publishing.about import About, described_files
from ajgdata.store.publishing.table import FILE_NAME, PublishedColumn, PublishedTable
from ajgdata.types.formats import PACKAGE_KEY, PUBLISHED_FORMAT

#: Form of metadata.csv. Frictionless guesses a form that is not stated.
_CSV_DIALECT = {
    "delimiter": ",",
    "lineTerminator": "\n",
    "quoteChar": '"',
    "doubleQuote": True,
    "skipInitialSpace": False,
}


def datapackage(
    about: About, table: PublishedTable, hashes: Mapping[str, str], sizes: Mapping[str, int]
) -> dict[str, Any]:
    """Return datapackage.json; `hashes` and `sizes` (bytes) are those of the files it names."""
    resources = [
        frictionless.Resource(
            name=file.name,
            path=path,
            format=file.suffix,
            mediatype=file.media_type,
            hash=f"sha256:{hashes[path]}",
            bytes=sizes[path],
        )
        for path, file in described_files(about.spec).items()
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
    if about.doi_url:
        document["id"] = about.doi_url
    document[PACKAGE_KEY] = PUBLISHED_FORMAT.version
    return document


def _field(column: PublishedColumn) -> dict[str, Any]:
    """Return the description of a column."""
    required = column.name in ("recording", FILE_NAME, "sha256")
    described = {"description": column.description, "unit": column.unit}
    return {
        "name": column.name,
        "type": column.data_type,
        **{key: text for key, text in described.items() if text},
        "constraints": {"required": required, "unique": required and column.name != "sha256"},
    }
