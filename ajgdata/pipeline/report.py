"""Stores, results of experiments and findings -> the report's page and figures."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.ablations.base import reasons_of
from ajgdata.experiments import EXPERIMENTS
from ajgdata.experiments.base import Lookup, TaskResults
from ajgdata.paths import ABLATIONS_PAGE, FIGURES, RUNS_FILE, Paths
from ajgdata.pipeline.experiments import asked_for, models_of, read_results
from ajgdata.pipeline.stages import Stopwatch, stages_of
from ajgdata.report.comparison import PaperComparison, Reason, in_papers_order
from ajgdata.report.paper import PaperFigure, parse_paper
from ajgdata.report.report_data import (
    DatasetSummary,
    Part,
    Provenance,
    Report,
    Skipped,
    Spectra,
    TaskSection,
)
from ajgdata.store.features import Shard, read_store
from ajgdata.store.files import json_bytes, write_bytes
from ajgdata.store.findings import read_findings
from ajgdata.store.provenance import settings_digest, software
from ajgdata.store.report_files import read_experiment_text, read_paper
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
    ablations: Sequence[str] = (),
    published: Sequence[str] = (),
) -> None:
    """Write the report on `datasets` and on `tasks`, pairs of data set and name, as `page`.

    Its figures, and what it is about, are written beside it. `pages` are the other pages that it is
    linked with, `ablations` those that say why simulation and paper differ; `published` the data
    sets whose trees are there.
    """
    from ajgdata.report.page import illustrations, render_page
    from ajgdata.report.render import draw_figures
    from ajgdata.report.study_page import page_links

    watch = Stopwatch()
    folder = page.parent / FIGURES
    specs = {name: read_dataset(paths, name) for name in datasets}
    report = _assembled(paths, specs, tasks, ablations, page)
    figures = draw_figures(illustrations(report), folder)
    whole = bool(pages or published)
    stages = stages_of(paths, datasets=datasets, tasks=tasks, whole=whole, report=watch.so_far())
    report = dataclasses.replace(report, stages=stages)
    later = [one for one in illustrations(report) if one.name not in figures]
    figures |= draw_figures(later, folder)
    html = render_page(report, figures, page_links(pages), published, project=paths)
    write_bytes(page, html.encode())
    content = {"datasets": list(datasets), "runs": models_of(specs, tasks), "pages": list(pages)}
    content["published"] = list(published)
    write_bytes(page.with_name(RUNS_FILE), json_bytes(content))


def _assembled(
    paths: Paths,
    specs: Mapping[str, DatasetSpec],
    tasks: Sequence[tuple[str, str]],
    ablations: Sequence[str],
    page: Path,
) -> Report:
    """Return all that the report says, but for the time that it took."""
    paper = parse_paper(read_paper(paths))
    read = [read_results(paths, asked, specs, paper) for asked in asked_for(specs, tasks)]
    results = [one for one, _ in read if one.results]
    tables = [table for name in ablations for table in read_tables(paths.ablation(name))[1]]
    return Report(
        title="Acoustic sensing with jamming grippers",
        version=software()["ajgdata_version"],
        commit=software()["git_commit"],
        datasets=tuple(summary(paths, specs[n], read_store(paths.merged(n))) for n in specs),
        sections=tuple(_sections(paths, results, page)),
        comparisons=tuple(_comparisons(results, paper, reasons_of(tables, ABLATIONS_PAGE))),
        across=tuple(
            drawing
            for name in dict.fromkeys(one.experiment for one in results)
            for drawing in EXPERIMENTS[name].across(
                [one for one in results if one.experiment == name]
            )
        ),
        skipped=tuple(
            Skipped(one.dataset, f"{one.task}, {_title(one)}", label, reason)
            for one, reasons in read
            for label, reason in reasons.items()
        ),
        paper=tuple(paper.values()),
    )


def _title(results: TaskResults) -> str:
    title = EXPERIMENTS[results.experiment].title
    return title[0].lower() + title[1:]


def _sections(paths: Paths, results: Sequence[TaskResults], page: Path) -> Iterator[TaskSection]:
    """Yield a section for each task that has a result."""
    for dataset, task in dict.fromkeys((one.dataset, one.task) for one in results):
        own = [one for one in results if (one.dataset, one.task) == (dataset, task)]
        parts = tuple(_part(paths, one) for one in own)
        place = paths.explorer(dataset, task)  # an embedding's, beside the whole report alone
        beside = page == paths.report and place.is_file()
        explorer = str(place.relative_to(page.parent)) if beside else ""
        yield TaskSection(dataset, task, own[0].title, own[0].source, parts, explorer)


def _part(paths: Paths, results: TaskResults) -> Part:
    one = EXPERIMENTS[results.experiment]
    return Part(
        experiment=one.name,
        title=one.title,
        summary=one.summary(results),
        text=read_experiment_text(paths, one.name),
        rows=tuple(one.rows(results)),
        figures=tuple(one.figures(results)),
        tables=tuple(one.tables(results)),
    )


def _comparisons(
    results: Sequence[TaskResults], paper: Mapping[str, PaperFigure], reasons: Sequence[Reason]
) -> list[PaperComparison]:
    """Return what stands beside the paper, with its cost and the reasons that were found."""

    def lookup(experiment: str, dataset: str, task: str) -> TaskResults | None:
        """Return results on the task, or else on another of its data set."""
        there = [r for r in results if (r.experiment, r.dataset) == (experiment, dataset)]
        return min(there, key=lambda r: r.task != task, default=None)

    rows = [
        _with_cost(row, lookup)
        for one in results
        for row in EXPERIMENTS[one.experiment].paper_comparison(one, lookup)
    ]
    return [
        dataclasses.replace(row, reasons=tuple(r for r in reasons if row.paper.id in r.of))
        for row in in_papers_order(rows, paper.values())
    ]


def _with_cost(row: PaperComparison, lookup: Lookup) -> PaperComparison:
    """Return the row, with the cost of its model on the task where it does not say one."""
    if row.cost is not None or not row.model:
        return row
    for name in EXPERIMENTS.names():
        found = lookup(name, row.dataset, row.task)
        cost = EXPERIMENTS[name].training_cost(found, row.model) if found else None
        if cost is not None:
            return dataclasses.replace(row, cost=cost)
    return row


def summary(paths: Paths, spec: DatasetSpec, store: Shard) -> DatasetSummary:
    """Return what the report says of a data set."""
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
    """Return what a session says of its source, flattened: `numerics dx_mm`, for instance."""
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
    """Return the mean spectrum of each class, or of equally filled bins, of the first target."""
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
