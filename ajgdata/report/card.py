"""Texts of a published data set: dataset card and licence."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from markupsafe import Markup

from ajgdata.paths import Paths, Tree
from ajgdata.report.render import environment
from ajgdata.report.report_data import DatasetSummary, IssueLine, findings_by_code
from ajgdata.store.files import yaml_bytes
from ajgdata.store.publishing.about import About
from ajgdata.store.publishing.table import PublishedColumn, PublishedTable
from ajgdata.types import Finding, many

#: Types that pandas has for the columns of metadata.csv.
PANDAS_TYPES = {"string": "str", "integer": "int64", "number": "float64"}
#: Findings that the card lists one by one.
MAX_FINDINGS = 20
#: Files and folders of a published data set, with their content.
FILES = (
    (Tree.METADATA, "labels, one row per recording; text without types"),
    (
        Tree.TYPED_METADATA,
        "the same table with the type of each column, for Hugging Face and Croissant",
    ),
    (Tree.FEATURES, "spectra and labels, netCDF-4"),
    (Tree.ARCHIVE, "the recordings"),
    ("audio/", "the same, one file each"),
    ("sessions/", "of each session: description, recordings and the played sound, for ajgdata"),
    (Tree.DECLARATION, "targets, tasks and settings, for ajgdata"),
    (Tree.CITATION, "citation, for GitHub and reference managers"),
    (Tree.CROISSANT, "description for machines: Croissant"),
    (Tree.DATAPACKAGE, "description for machines: Frictionless"),
    (Tree.SUMS, "SHA-256 of every file: sha256sum -c SHA256SUMS"),
)

#: The same of a data set of tables.
FILES_WITHOUT_SOUND = (
    *(file for file in FILES[:2]),
    (Tree.FEATURES, "features and labels, netCDF-4"),
    ("sessions/", "of each session: description, recordings and table of features, for ajgdata"),
    *(file for file in FILES[6:]),
)


class CardFile(NamedTuple):
    """A file or folder of a published data set; `size` in bytes is "" for a folder."""

    name: str
    size: int | str
    content: str


@dataclass(frozen=True)
class CardView:
    """Values of the template of a dataset card; `about` is the description of the data set.

    `licence` and `groups` are "" if there are none.
    """

    about: About
    front_matter: Markup
    source: str
    source_note: str
    size: str
    licence: str
    label: str
    column_types: Markup
    files: list[CardFile]
    columns: tuple[PublishedColumn, ...]
    groups: str
    left_out_count: str
    n_flagged: int
    is_simulated: bool
    has_sound: bool
    has_spectra: bool
    left_out: list[str]
    n_more_left_out: int
    flagged: list[IssueLine]
    provenance: list[tuple[str, str]]


def render_card(
    about: About,
    summary: DatasetSummary,
    table: PublishedTable,
    sizes: Mapping[str, int],
    provenance: Mapping[str, str],
    project: Paths | None = None,
    models: Sequence[str] = (),
) -> str:
    """Return README.md; `sizes` are bytes of files by name, `provenance` texts by topic.

    `models` are the folders of published models.
    """
    templates = environment(project)
    templates.keep_trailing_newline = True
    templates.filters["cell"] = cell
    view = card_view(about, summary, table, sizes, provenance)
    return templates.get_template("card.md.j2").render(card=view, tree=Tree, models=models)


def card_view(
    about: About,
    summary: DatasetSummary,
    table: PublishedTable,
    sizes: Mapping[str, int],
    provenance: Mapping[str, str],
) -> CardView:
    """Return the values of a dataset card; the arguments are those of `render_card`."""
    is_simulated = about.source == "simulated"
    targets = [column.name for column in table.columns if column.is_target]
    types = {column.name: PANDAS_TYPES[column.data_type] for column in table.columns}
    left_out = [finding for finding in summary.findings if finding.leaves_out]
    flagged = [finding for finding in summary.findings if not finding.leaves_out]
    has_sound = summary.features.needs_waveform
    content = f"{summary.sample_rate_hz} Hz" if has_sound else "without sound"
    files = FILES if has_sound else FILES_WITHOUT_SOUND
    were = "recording was" if summary.n_left_out == 1 else "recordings were"
    return CardView(
        about=about,
        front_matter=Markup(yaml_bytes(front_matter(about)).decode()),
        source="Simulated" if is_simulated else "Recorded",
        source_note=": computed, no microphone was involved" if is_simulated else "",
        size=(
            f"{summary.n_recordings} recordings, {many(summary.n_sessions, 'session')}, {content}"
        ),
        licence="" if about.is_unlicensed else about.spdx or about.spec.licence,
        label=targets[0] if targets else "object",
        column_types=Markup(json.dumps(types)),
        files=[CardFile(name, sizes.get(name, ""), content) for name, content in files],
        columns=table.columns,
        groups=" or ".join(sorted({task.groups for task in about.spec.tasks.values()})),
        left_out_count=f"{summary.n_left_out} {were}",
        n_flagged=summary.n_flagged,
        is_simulated=is_simulated,
        has_sound=has_sound,
        has_spectra=summary.spectra is not None,
        left_out=[_example(finding) for finding in left_out[:MAX_FINDINGS]],
        n_more_left_out=max(0, len(left_out) - MAX_FINDINGS),
        flagged=[
            IssueLine(len(some), code, _example(some[0]))
            for code, some in findings_by_code(flagged)
        ],
        provenance=list(provenance.items()),
    )


def _example(finding: Finding) -> str:
    return f"{finding.session_id}/{finding.recording_id}: {finding.problem}"


def front_matter(about: About) -> dict[str, Any]:
    """Return what Hugging Face shows and searches, and which files are the data."""
    has_sound = about.spec.features.needs_waveform
    classification = "audio-classification" if has_sound else "tabular-classification"
    categories = {"classification": classification, "regression": "tabular-regression"}
    data_files = [Tree.TYPED_METADATA, "audio/**"] if has_sound else [Tree.TYPED_METADATA]
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
                "data_files": [{"split": "train", "path": data_files}],
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
