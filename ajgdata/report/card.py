"""Texts of a published data set: dataset card and licence."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from markupsafe import Markup

from ajgdata.paths import Paths, Tree
from ajgdata.report.render import environment
from ajgdata.report.report_data import DatasetSummary
from ajgdata.store.files import yaml_bytes
from ajgdata.store.publishing.documents import About
from ajgdata.store.publishing.table import PublishedTable

#: Types that pandas has for the columns of metadata.csv.
PANDAS_TYPES = {"string": "str", "integer": "int64", "number": "float64"}
#: Findings that the card lists one by one.
MAX_FINDINGS = 20


def render_card(
    about: About,
    summary: DatasetSummary,
    table: PublishedTable,
    sizes: Mapping[str, int],
    provenance: Mapping[str, str],
    project: Paths | None = None,
) -> str:
    """Return README.md; `sizes` are bytes of files by name, `provenance` texts by topic."""
    templates = environment(project)
    templates.keep_trailing_newline = True
    templates.filters["cell"] = cell
    targets = (column.name for column in table.columns if column.is_target)
    return templates.get_template("card.md.j2").render(
        about=about,
        summary=summary,
        table=table,
        groups=sorted({task.groups for task in about.spec.tasks.values()}),
        sizes=sizes,
        provenance=provenance,
        front=yaml_bytes(front_matter(about)).decode(),
        label=next(targets, "object"),
        left_out=[f for f in summary.findings if f.leaves_out],
        flagged=[f for f in summary.findings if not f.leaves_out],
        max_findings=MAX_FINDINGS,
        tree=Tree,
        column_types=json.dumps(
            {column.name: PANDAS_TYPES[column.data_type] for column in table.columns}
        ),
    )


def front_matter(about: About) -> dict[str, Any]:
    """Return what Hugging Face shows and searches, and which files are the data."""
    categories = {"classification": "audio-classification", "regression": "tabular-regression"}
    kinds = {about.spec.targets[task.target].kind for task in about.spec.tasks.values()}
    return {
        "pretty_name": about.title,
        "license": about.spdx.lower() or ("unknown" if about.is_unlicensed else "other"),
        "language": ["en"],
        "tags": [word.replace(" ", "-") for word in about.keywords] + ["croissant"],
        "task_categories": sorted(categories[kind] for kind in kinds),
        "configs": [
            {
                "config_name": "default",
                "data_files": [{"split": "train", "path": [Tree.TYPED_METADATA, "audio/**"]}],
            }
        ],
    }


def licence_text(about: About) -> str:
    """Return the content of LICENSE: name and address of the licence."""
    if about.is_unlicensed:
        return (
            f"No licence is stated for the data set {about.spec.name}.\n"
            f"Ask its authors before you use it or pass it on: {', '.join(about.authors)}.\n"
        )
    head = f"The data set {about.spec.name} is licensed under {about.spec.licence}.\n"
    return head + (f"Its text: {about.licence_url}\n" if about.licence_url else "")


def cell(text: object) -> Markup:
    """Return text that stays inside one cell of a Markdown table and one paragraph of a card.

    It is not HTML. Quotes stay, because no value is in an attribute.
    """
    plain = " ".join(str(text).replace("|", "\\|").replace("`", "'").split())
    return Markup(plain.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;"))
