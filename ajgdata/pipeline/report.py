"""Stores, metrics and findings -> the report's page and figures."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.paths import ABLATIONS_PAGE, FIGURES, RUNS_FILE, Paths
from ajgdata.pipeline.embed_documents import read_embedded
from ajgdata.pipeline.experiments import runs_of
from ajgdata.pipeline.report_results import left_out_of, task_result
from ajgdata.pipeline.report_rows import (
    curves_of,
    energies_of,
    left_out,
    sorting_of,
    stfts_of,
    tests_of,
    transfers_of,
)
from ajgdata.pipeline.stages import Stopwatch, stages_of
from ajgdata.report.content import (
    DatasetSummary,
    Provenance,
    Report,
    Spectra,
)
from ajgdata.report.paper import parse_paper
from ajgdata.report.reasons import reasons_of
from ajgdata.store.features import Shard, read_store
from ajgdata.store.files import json_bytes, read_json, write_bytes
from ajgdata.store.findings import read_findings
from ajgdata.store.provenance import settings_digest, software
from ajgdata.store.report_files import read_paper
from ajgdata.store.sessions import read_dataset, read_session
from ajgdata.store.tables import read_tables
from ajgdata.types import DataError, DatasetSpec, FeatureSettings

#: As many mean spectra as can be told apart in one figure.
MAX_SPECTRA = 8


def build_report(
    paths: Paths,
    *,
    datasets: Sequence[str],
    tasks: Sequence[tuple[str, str]],
    page: Path,
    pages: Sequence[str] = (),
    embeddings: Sequence[tuple[str, str]] = (),
    ablations: Sequence[str] = (),
    published: Sequence[str] = (),
) -> None:
    """Write the report on `datasets` and on `tasks` and `embeddings`, pairs of data set and name,
    as `page`, its figures and what it is about beside it.

    `pages` are the other pages that it is linked with, `ablations` those that say why simulation
    and paper differ; `published` the data sets whose trees are there.
    """
    from ajgdata.report.page import render_page
    from ajgdata.report.study_page import page_links

    watch = Stopwatch()
    folder = page.parent / FIGURES
    report = _assembled(paths, datasets, tasks, embeddings, ablations)
    svgs = _drawn(report, folder, {})
    whole = bool(pages or published)
    stages = stages_of(paths, datasets=datasets, tasks=tasks, whole=whole, report=watch.so_far())
    report = dataclasses.replace(report, stages=stages)
    svgs = _drawn(report, folder, svgs)
    write_bytes(page, render_page(report, svgs, page_links(pages), published, paths).encode())
    runs = runs_of({name: read_dataset(paths, name) for name in datasets}, tasks)
    content = {"datasets": list(datasets), "runs": runs, "pages": list(pages)}
    content["published"] = list(published)
    write_bytes(page.with_name(RUNS_FILE), json_bytes(content))


def _drawn(report: Report, folder: Path, known: Mapping[str, bytes]) -> dict[str, bytes]:
    """The SVG files of all figures; those that are not `known` are drawn and written."""
    from ajgdata.report.canvas import save_figure
    from ajgdata.report.illustrations import illustrations

    svgs = dict(known)
    for name, illustration in illustrations(report).items():
        if name not in known:
            saved = save_figure(illustration.draw(), folder / name)
            svgs[name] = next(path for path in saved if path.suffix == ".svg").read_bytes()
    return svgs


def _assembled(
    paths: Paths,
    datasets: Sequence[str],
    tasks: Sequence[tuple[str, str]],
    embeddings: Sequence[tuple[str, str]],
    ablations: Sequence[str],
) -> Report:
    """All that the report says, but for the time that it took."""
    paper = parse_paper(read_paper(paths))
    specs = {name: read_dataset(paths, name) for name in datasets}
    stores = {name: read_store(paths.merged(name)) for name in datasets}
    runs = runs_of(specs, tasks)
    documents = {run: read_json(paths.metrics(*run)) for run in runs}
    report = Report(
        title="Acoustic sensing with jamming grippers",
        version=software()["ajgdata_version"],
        commit=software()["git_commit"],
        datasets=tuple(summary(paths, specs[name], stores[name]) for name in datasets),
        results=tuple(
            task_result(paths, specs, run, document, paper)
            for run, document in documents.items()
            if "skipped" not in document
        ),
        skipped=tuple(
            left_out_of(run, document)
            for run, document in documents.items()
            if "skipped" in document
        ),
    )
    tables = [table for name in ablations for table in read_tables(paths.ablation(name))[1]]
    listed = [(specs[dataset], task) for dataset, task in tasks]
    return dataclasses.replace(
        report,
        curves=tuple(c for one in listed for c in curves_of(paths, *one, paper)),
        tests=tuple(t for one in listed for t in tests_of(paths, *one)),
        sorting=tuple(s for one in listed for s in sorting_of(paths, *one, paper)),
        transfers=tuple(t for one in listed for t in transfers_of(paths, *one, specs, paper)),
        stfts=tuple(s for one in listed for s in stfts_of(paths, *one)),
        energies=tuple(e for one in listed for e in energies_of(paths, *one, paper)),
        embeddings=tuple(read_embedded(paths, *one, measured=True) for one in embeddings),
        paper=tuple(paper.values()),
        reasons=tuple(reasons_of(tables, ABLATIONS_PAGE)),
        skipped=(*report.skipped, *(s for one in listed for s in left_out(paths, *one))),
    )


def summary(paths: Paths, spec: DatasetSpec, store: Shard) -> DatasetSummary:
    """What the report says of a data set."""
    settings = json.loads(str(store.attrs["settings"]))
    features = FeatureSettings(**settings["features"])
    return DatasetSummary(
        name=spec.name,
        title=spec.title or spec.name,
        source="simulated" if store.attrs["source"] == "simulated" else "recorded",
        description=spec.description,
        n_recordings=len(store.feature),
        n_sessions=len(np.unique(store.columns["session_id"].values)),
        sample_rate_hz=spec.audio.sample_rate_hz,
        licence=spec.licence,
        citation=spec.citation,
        url=spec.url,
        features=features,
        provenance=Provenance(
            version=str(store.attrs["ajgdata_version"]),
            commit=str(store.attrs["git_commit"]),
            config_hash=settings_digest(spec.audio, spec.features, *spec.tasks.values()),
            inputs_hash=str(store.attrs["inputs_sha256"]),
        ),
        findings=tuple(read_findings(paths.quarantine(spec.name))),
        spectra=mean_spectra(store, spec),
        facts=_facts(paths, spec.name, store),
    )


def _facts(paths: Paths, dataset: str, store: Shard) -> Mapping[str, Any]:
    """What a session of the store says of its source, flattened: `numerics dx_mm`, for instance."""
    sessions = sorted(set(store.columns["session_id"].values.tolist()))
    try:
        session = read_session(paths.session(dataset, sessions[0]))
    except (DataError, IndexError):  # no session is left, or it was spoilt since
        return {}
    facts: dict[str, Any] = {"gripper": session.gripper, "medium": session.medium}
    facts |= {"device": session.device, "written by": session.software}
    for part, content in session.scene.items():
        items = content.items() if isinstance(content, dict) else [("", content)]
        facts |= {f"{part} {key}".strip(): value for key, value in items}
    return {key: value for key, value in facts.items() if value not in ("unknown", "")}


def mean_spectra(store: Shard, spec: DatasetSpec) -> Spectra | None:
    """Mean spectrum of each class, or of equally filled bins, of the first task's target."""
    name = next((task.target for task in spec.tasks.values()), "")
    if name not in store.columns:
        return None
    target, values = spec.targets[name], store.columns[name].values
    if target.kind == "classification":
        classes = [c for c in np.unique(values) if c][:MAX_SPECTRA]
        parts = [(str(c), values == c) for c in classes]
    else:
        present = values[np.isfinite(values)]
        if not len(present):
            return None
        edges = np.unique(np.quantile(present, np.linspace(0, 1, 5)))
        bins = np.clip(np.searchsorted(edges, values, "right") - 1, 0, max(0, len(edges) - 2))
        bins[~np.isfinite(values)] = -1
        parts = [
            (f"{values[bins == b].min():g}–{values[bins == b].max():g} {target.unit}", bins == b)
            for b in np.unique(bins[bins >= 0])
        ]
    if not parts:
        return None
    mean = np.asarray([store.feature[rows].mean(axis=0, dtype=np.float64) for _, rows in parts])
    return Spectra(store.frequency_hz, tuple(label for label, _ in parts), mean, name)
