"""CITATION.cff: the citation of a published data set for GitHub and reference managers."""

from __future__ import annotations

from ajgdata.store.files import yaml_bytes
from ajgdata.store.publishing.about import About


def citation_bytes(about: About) -> bytes:
    """Return CITATION.cff (Citation File Format 1.2.0) of a data set."""
    optional = {
        "date-released": about.date,
        "doi": about.spec.doi,
        "license": about.spdx,
        "url": about.spec.url,
    }
    return yaml_bytes(
        {
            "cff-version": "1.2.0",
            "message": f"Please cite this data set: {about.reference}",
            "type": "dataset",
            "title": about.title,
            "abstract": about.description,
            "version": about.spec.version,
            "authors": [{"name": name} for name in about.authors],
            "keywords": about.keywords,
            **{key: text for key, text in optional.items() if text},
        }
    )
