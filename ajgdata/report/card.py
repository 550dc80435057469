"""Card, citation and licence of a published data set."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from jinja2 import Environment
from markupsafe import Markup

from ajgdata.paths import Paths, Tree
from ajgdata.report.format import number, value, words
from ajgdata.report.render import environment
from ajgdata.report.report_data import DatasetSummary
from ajgdata.store.files import read_text
from ajgdata.store.publishing.about import CC0_FILE, TOPICS, About
from ajgdata.store.publishing.examples import examples
from ajgdata.store.publishing.table import Table
from ajgdata.types import DatasetSpec, Finding, Session, Target

#: More values than this are counted in this many bins.
MAX_BARS = 24
#: Findings that the card lists one by one.
MAX_FINDINGS = 20
#: Upper ends of Hugging Face's size categories.
_SIZES = ((1e3, "n<1K"), (1e4, "1K<n<10K"), (1e5, "10K<n<100K"), (float("inf"), "100K<n<1M"))


@dataclass(frozen=True, eq=False)
class Counts:
    """Recordings for each value, or range of values, of a target."""

    target: str
    unit: str
    values: tuple[str, ...]
    recordings: tuple[int, ...]
    missing: int


def counts_of(name: str, target: Target, values: np.ndarray) -> Counts:
    """Return how often each value of a target was recorded. `values` (n,): NaN or "" is missing."""
    present = values[values != ""] if values.dtype.kind == "U" else values[np.isfinite(values)]
    distinct, counts = np.unique(present, return_counts=True)
    if len(distinct) > MAX_BARS and values.dtype.kind != "U":
        counts, edges = np.histogram(present, MAX_BARS)
        labels = [f"{number(a)}–{number(b)}" for a, b in pairwise(edges)]
    else:
        labels = [value(one) for one in distinct.tolist()]
    missing = len(values) - len(present)
    return Counts(name, target.unit, tuple(labels), tuple(counts.tolist()), missing)


def answers(
    spec: DatasetSpec, summary: DatasetSummary, sessions: Sequence[Session], unsealed: int
) -> dict[str, str]:
    """Return the notes on a data set, by topic of `TOPICS`, from its declaration and sessions."""
    is_simulated = summary.source == "simulated"
    labels = "; ".join(
        f"{name}: {target.description or words(name)}{f' ({target.unit})' if target.unit else ''}"
        for name, target in spec.targets.items()
    )
    unsealed_text = f", {unsealed} had no hash from the day they were recorded" if unsealed else ""
    groups = sorted({task.groups for task in spec.tasks.values()}) or ["grasp_id"]
    return {
        "collection": _collection(summary, sessions),
        "collection_type": "Simulation" if is_simulated else "Experiment",
        "labels": f"{labels or 'No targets are declared'}. "
        + ("Settings of the simulation." if is_simulated else "Given by the authors, unchecked."),
        "missing": f"{summary.n_left_out} recordings were left out, {summary.n_flagged} are "
        f"flagged{unsealed_text}. A label that was not measured is an empty cell.",
        "preprocessing": "The recordings are unchanged. The spectra are normalised sums over time "
        "of short-time Fourier transforms; their settings are in the attribute `settings` of "
        f"{Tree.FEATURES}.",
        "uses": f"Split by {' or '.join(groups)}, never at random: recordings of one grasp are "
        "near copies.",
        "limitations": _limitations(summary, sessions),
        "personal": "None: simulated."
        if is_simulated
        else "Not known: recordings may contain voices from the room.",
    }


def has_gripper(sessions: Sequence[Session]) -> bool:
    """Return whether somebody said which gripper it was: else it may have been none."""
    return any(session.gripper != "unknown" for session in sessions)


def _collection(summary: DatasetSummary, sessions: Sequence[Session]) -> str:
    told = {
        key: ", ".join(sorted({str(getattr(s, key)) for s in sessions} - {"unknown", ""}))
        for key in ("gripper", "medium", "device", "software")
    }
    facts = "; ".join(f"{key}: {text}" for key, text in told.items() if text)
    sounds = sorted({s.excitation.description for s in sessions if s.excitation} - {""})
    how = "Simulated" if summary.source == "simulated" else "Recorded"
    played = f" Played sound: {', '.join(sounds)}." if sounds else ""
    return f"{how}. {facts[:1].upper()}{facts[1:]}.{played}" if facts else f"{how}.{played}"


def _limitations(summary: DatasetSummary, sessions: Sequence[Session]) -> str:
    if summary.source == "recorded":
        return "Other objects, rooms and set-ups than these."
    grippers = len({session.gripper for session in sessions})
    return (
        f"It is simulated: rigid objects, {grippers} gripper{'s' * (grippers > 1)}, no noise but "
        "its floor unless it says so; a grid of 4.2 mm is right up to about 6 kHz, a coarser one "
        "less far. Accuracies on it are not those of a real gripper."
    )


def render_card(
    about: About,
    summary: DatasetSummary,
    table: Table,
    counts: Sequence[Counts],
    sizes: Mapping[str, int],
    provenance: Mapping[str, str],
    front: str,
    project: Paths | None = None,
) -> str:
    """Return README.md. `front` is the YAML that Hugging Face reads; `sizes` are bytes of files."""
    return _environment(project).get_template("card.md.j2").render(
        about=about,
        summary=summary,
        table=table,
        counts=counts,
        sizes=sizes,
        provenance=provenance,
        front=front,
        topics={topic: title for topic, (title, _) in TOPICS.items()},
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
