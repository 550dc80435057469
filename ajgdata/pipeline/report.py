"""The job `report`: read all existing results, and write the pages with figures and tables."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.hypotheses import CAUSES_PAGE, cause_tables, divided_by_page
from ajgdata.experiments.registry import EXPERIMENTS
from ajgdata.experiments.requests import MeasurementKey, Request, TaskKey, requests_for
from ajgdata.paths import EXPERIMENT_PAGES_FOLDER, FIGURES_FOLDER, TABLES_FOLDER, Paths
from ajgdata.pipeline.exports import with_tables, write_csv, write_exports
from ajgdata.pipeline.report_content import practice_topics, published_values, report_content
from ajgdata.pipeline.run_summary import run_cost
from ajgdata.pipeline.studies import STUDIES
from ajgdata.pipeline.task_results import Measurement, computed, measurements, read_results
from ajgdata.report.answer import placebo_sentence
from ajgdata.report.comparison import PaperFigure, tally
from ajgdata.report.format import Source, words
from ajgdata.report.navigation import LEADS, Group, Link, experiment_link, navigation
from ajgdata.report.page import illustrations, render_pages
from ajgdata.report.render import draw_figures
from ajgdata.report.report_data import Report
from ajgdata.report.studies import conclusions, figures_of
from ajgdata.report.study_page import render_study
from ajgdata.report.study_tables import holds
from ajgdata.store.features import open_store
from ajgdata.store.files import json_bytes, write_bytes
from ajgdata.store.provenance import environment, software
from ajgdata.store.sessions import read_dataset
from ajgdata.store.tables import read_tables
from ajgdata.types import CROSS_VALIDATION, DataError, DatasetSpec
from ajgdata.types.table import Table

#: Provenance and tables of simulation studies, by name.
Studies = Mapping[str, tuple[Mapping[str, Any], Sequence[Table]]]
#: Facts of a measurement that the summary of a run needs.
SUMMARISED = ("dataset", "task", "experiment", "model", "skipped", "left_out", "others")


def build_report(
    paths: Paths,
    *,
    datasets: Sequence[str],
    tasks: Sequence[TaskKey],
    requested: Sequence[MeasurementKey],
    studies: Sequence[str] = (),
    published: Sequence[str] = (),
) -> None:
    """Write the report on all existing results.

    `datasets`, `tasks` (data set and name), `studies` and `published` data sets are those of the
    project. One line of the report counts the results that do not exist. Another line counts
    results that the target did not request: they are of an earlier run and may be outdated.
    """
    specs = {name: read_dataset(paths, name) for name in datasets}
    expected = requests_for(specs, tasks)
    available, errors = measurements(paths, expected)
    requests = computed(expected, available)
    measured = {key: available[key] for request in requests for key in request.keys}
    specs_with_features = _with_features(paths, specs, errors)
    existing_studies = _read_studies(paths, studies, errors)
    existing_published = [name for name in published if paths.published_sums(name).is_file()]

    paper = published_values(paths)
    all_results, skipped = _task_results(measured, specs, requests, paper)
    results, causes = divided_by_page(all_results)
    tables_of_causes = cause_tables(causes)
    page_names = [*existing_studies]
    if causes:
        page_names.append(CAUSES_PAGE)
    missing = {
        "experiments": _missing_measurements(paths, expected, measured, errors),
        "simulation studies": len({*studies} - existing_studies.keys()),
        "published data sets": len(published) - len(existing_published),
    }

    report = report_content(paths, specs_with_features, requests, results, tables_of_causes, paper)
    study_tables = {name: existing_studies[name][1] for name in STUDIES if name in existing_studies}
    verdicts = [holds(row) for tables in study_tables.values() for t in tables for row in t.rows]
    checks = [verdict for verdict in verdicts if verdict is not None]
    report = dataclasses.replace(
        report,
        skipped=skipped,
        missing=tuple(f"{noun} ({count})" for noun, count in missing.items() if count),
        earlier=len(measured.keys() - {*requested}),
        run_cost=tuple(run_cost(paths, [*specs_with_features])),
        studies=tuple(
            (LEADS[name].title, f"{name}.html", conclusions(name, tables))
            for name, tables in study_tables.items()
        ),
        checks=(len(checks), sum(checks)),
        practice=tuple(practice_topics(paths, report.sections, errors)),
    )

    nav = navigation(
        [Link(experiment_link(page.name), page.title, page.about) for page in report.pages],
        page_names,
        compares=bool(report.comparisons),
        diagnoses=bool(report.diagnoses),
    )
    _write_pages(paths, report, results, nav, existing_published)
    _write_study_pages(paths, existing_studies, causes, tables_of_causes, nav)
    facts = {
        "datasets": [*specs_with_features],
        "pages": page_names,
        "published": existing_published,
        "unreadable": {str(file): str(error) for file, error in errors.items()},
        **_facts(report, [measurement.about for measurement in measured.values()]),
    }
    write_bytes(paths.runs, json_bytes(facts))


def _with_features(
    paths: Paths, specs: Mapping[str, DatasetSpec], errors: dict[Path, DataError]
) -> dict[str, DatasetSpec]:
    """Return the data sets whose feature file exists and can be read.

    A file cannot be read, for example, if an earlier version of ajgdata wrote it, and this target
    does not compute it again. The error is added to `errors`.
    """
    readable = {}
    for name, spec in specs.items():
        file = paths.features(name)
        if file.is_file():
            try:
                open_store(file).close()
            except DataError as error:
                errors[file] = error
            else:
                readable[name] = spec
    return readable


def _read_studies(paths: Paths, names: Sequence[str], errors: dict[Path, DataError]) -> Studies:
    """Return the named studies that exist.

    The errors of files that cannot be read are added to `errors`.
    """
    studies = {}
    for name in names:
        file = paths.study(name)
        if file.is_file():
            try:
                studies[name] = read_tables(file)
            except DataError as error:
                errors[file] = error
    return studies


def _task_results(
    measured: Mapping[MeasurementKey, Measurement],
    specs: Mapping[str, DatasetSpec],
    requests: Sequence[Request],
    paper: Mapping[str, PaperFigure],
) -> tuple[list[TaskResults], tuple[str, ...]]:
    """Return the results of each experiment on each task, and a line on each skipped part."""
    results = []
    lines = []
    for request in requests:
        result, skipped = read_results(measured, request, specs, paper)
        if result.results:
            results.append(result)
        experiment = EXPERIMENTS[result.experiment].title.lower()
        for label, reason in skipped:
            suffix = f" · {label}" if label else ""
            task = f"{result.dataset} · {words(result.task)}"
            lines.append(f"{task}, {experiment}{suffix}: {reason}")
    pages: dict[tuple[str, str], list[TaskResults]] = {}
    for result in results:
        pages.setdefault((result.experiment, result.page), []).append(result)
    on_pages = [
        dataclasses.replace(result, same_page=tuple(pages[result.experiment, result.page]))
        for result in results
    ]
    return on_pages, tuple(lines)


def _missing_measurements(
    paths: Paths,
    expected: Sequence[Request],
    measured: Mapping[MeasurementKey, Measurement],
    errors: Mapping[Path, DataError],
) -> int:
    """Return the number of expected measurements that do not exist. Unreadable ones do exist."""
    keys = {key for request in expected for key in request.keys}
    unreadable = set()
    for request in expected:
        for job in request.jobs:
            if {paths.experiment(*job), paths.experiment_cost(*job)} & errors.keys():
                unreadable.update(request.keys)
    return len(keys - measured.keys() - unreadable)


def _write_pages(
    paths: Paths,
    report: Report,
    results: Sequence[TaskResults],
    nav: Sequence[Group],
    published: Sequence[str],
) -> None:
    """Write the pages of the report, except those on studies and causes, with figures and tables.

    Old pages that the report may no longer have are removed.
    """
    folder = paths.report.parent
    # The rule requires this folder, also if there are no experiments.
    (folder / EXPERIMENT_PAGES_FOLDER).mkdir(parents=True, exist_ok=True)
    drawn = draw_figures(illustrations(report), folder / FIGURES_FOLDER)
    tables = write_exports(report, results, folder / TABLES_FOLDER)
    figures = {name: with_tables(figure, tables) for name, figure in drawn.items()}
    html = render_pages(report, figures, nav, published, project=paths)
    for name, text in html.items():
        write_bytes(folder / name, text.encode())
    old = [*STUDIES, CAUSES_PAGE, "ablations"]  # the last one is the former name of the causes
    if not report.comparisons:
        old.append("paper")
    if not report.diagnoses:
        old.append("diagnosis")
    for name in old:
        paths.page(name).unlink(missing_ok=True)


def _write_study_pages(
    paths: Paths,
    studies: Studies,
    causes: Sequence[TaskResults],
    tables_of_causes: Sequence[Table],
    nav: Sequence[Group],
) -> None:
    """Write the page of each study, and the page on causes if there are results on causes."""
    for name, (provenance, tables) in studies.items():
        build_page(paths, name, provenance, tables, nav)
    if causes:
        provenance = {"quick": False, **causes[0].results[0].about["provenance"]}
        sources = tuple(dict.fromkeys(task.source for task in causes))
        build_page(paths, CAUSES_PAGE, provenance, tables_of_causes, nav, sources)


def build_page(
    paths: Paths,
    name: str,
    provenance: Mapping[str, Any],
    tables: Sequence[Table],
    nav: Sequence[Group],
    sources: Sequence[Source] = (),
) -> None:
    """Draw the figures of the page `name` and write it, with the navigation of the report.

    `provenance` states what computed its `tables`. `sources` are those of its data; default: those
    of the page.
    """
    figures = draw_figures(figures_of(name, tables), paths.page_figures(name))
    for table in tables:
        write_csv(paths.page_figures(name) / f"{table.name}.csv", table)
    html = render_study(name, provenance, tables, figures, nav, paths, sources)
    write_bytes(paths.page(name), html.encode())


def _facts(report: Report, measured: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the facts on a report that the summary of the run needs.

    These are the software, the measurements, the tally of comparisons with the paper, the answer,
    the placebo, and the cost of all results.
    """
    runs = [
        (about["dataset"], about["task"], about["model"])
        for about in measured
        if about["experiment"] == CROSS_VALIDATION
    ]
    return {
        "software": {**software(), **environment()},
        "runs": runs,
        "measurements": [
            {key: about[key] for key in SUMMARISED if key in about} for about in measured
        ],
        "agreements": tally(report.comparisons),
        "answer": report.answer,
        "placebo": placebo_sentence(report),
        "cost": report.cost,
    }
