"""Texts of a published data set: dataset card, citation and licence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from jinja2 import Environment
from markupsafe import Markup

from ajgdata.paths import Paths, Tree
from ajgdata.report.render import environment
from ajgdata.report.report_data import DatasetSummary
from ajgdata.store.files import read_text
from ajgdata.store.publishing.about import CC0_FILE, About, examples
from ajgdata.store.publishing.table import Table
from ajgdata.types import Finding, Session

#: Findings that the card lists one by one.
MAX_FINDINGS = 20
#: Upper ends of Hugging Face's size categories.
_SIZES = ((1e3, "n<1K"), (1e4, "1K<n<10K"), (1e5, "10K<n<100K"), (float("inf"), "100K<n<1M"))


def has_gripper(sessions: Sequence[Session]) -> bool:
    """Return whether somebody said which gripper it was: else it may have been none."""
    return any(session.gripper != "unknown" for session in sessions)


def render_card(
    about: About,
    summary: DatasetSummary,
    table: Table,
    groups: Sequence[str],
    unsealed: int,
    sizes: Mapping[str, int],
    provenance: Mapping[str, str],
    front: str,
    project: Paths | None = None,
) -> str:
    """Return README.md.

    `groups` are the columns that folds must not share, `unsealed` counts recordings without a hash
    from the day of the recording, `sizes` are bytes of files, `front` is the YAML that Hugging Face
    reads.
    """
    return _environment(project).get_template("card.md.j2").render(
        about=about,
        summary=summary,
        table=table,
        groups=groups,
        unsealed=unsealed,
        sizes=sizes,
        provenance=provenance,
        front=front,
        examples=examples(table),
        left_out=[f for f in summary.findings if f.leaves_out],
        flagged=_by_code([f for f in summary.findings if not f.leaves_out]),
        max_findings=MAX_FINDINGS,
        tree=Tree,
    )  # fmt: skip


def front_matter(about: About, recordings: int) -> dict[str, Any]:
    """Return what Hugging Face shows and searches, and which files are the data."""
    kinds = {"classification": "audio-classification", "regression": "tabular-regression"}
    return {
        "pretty_name": about.title,
        "license": about.spdx.lower() or ("unknown" if about.is_unlicensed else "other"),
        "language": ["en"],
        "tags": [word.replace(" ", "-") for word in about.keywords] + ["croissant"],
        "task_categories": sorted(kinds[kind] for kind in about.task_kinds),
        "size_categories": [next(name for top, name in _SIZES if recordings < top)],
        "annotations_creators": [
            "machine-generated" if about.source == "simulated" else "expert-generated"
        ],
        "configs": [
            {
                "config_name": "default",
                "data_files": [{"split": "train", "path": [Tree.METADATA, "audio/**"]}],
            }
        ],
    }


def citation(about: About) -> dict[str, Any]:
    """Return the content of CITATION.cff of the data set."""
    return {
        "cff-version": "1.2.0",
        "message": "If you use this data set, please cite it.",
        "type": "dataset",
        "title": about.title,
        "abstract": about.description or about.title,
        "authors": [{"name": name} for name in about.authors],
        "version": about.version,
        **({"date-released": about.date} if about.date else {}),
        **({"license": about.spdx} if about.spdx else {}),
        **({"url": about.url} if about.url else {}),
        "keywords": about.keywords,
        **({"notes": about.citation} if about.citation else {}),
    }


def licence_text(about: About) -> str:
    """Return the content of LICENSE: the text itself where we have it, else where it is."""
    if about.is_unlicensed:
        return (
            f"No licence is stated for the data set {about.name}.\n"
            f"Ask its authors before you use it or pass it on: {', '.join(about.authors)}.\n"
        )
    head = f"The data set {about.name} is licensed under {about.spdx or about.licence}.\n"
    if about.spdx == "CC0-1.0":
        return f"{head}\n{read_text(CC0_FILE)}"
    return head + (f"Its text: {about.licence_url}\n" if about.licence_url else "")


def _by_code(findings: Sequence[Finding]) -> list[tuple[int, Finding]]:
    """Return how many findings of each kind there are, and the first of each."""
    kinds: dict[str, list[Finding]] = {}
    for one in findings:
        kinds.setdefault(one.code, []).append(one)
    return [(len(found), found[0]) for found in kinds.values()]


def finding_text(finding: Finding) -> str:
    """Return a finding as one line."""
    return f"{finding.session_id}/{finding.recording_id}: {finding.problem}"


def _environment(project: Paths | None) -> Environment:
    templates = environment(project)
    templates.keep_trailing_newline = True
    templates.filters.update(cell=cell, finding=finding_text)
    return templates


def cell(text: object) -> Markup:
    """Return text that stays inside one cell of a Markdown table and one paragraph of a card.

    It is no HTML. Quotes stay: no value stands in an attribute.
    """
    plain = " ".join(str(text).replace("|", "\\|").replace("`", "'").split())
    return Markup(plain.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;"))
