"""Stores, results of experiments and findings -> the report's page and figures."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ajgdata.experiments.base import Lookup, TaskResults
from ajgdata.experiments.cross_validation_results import training_cost
from ajgdata.experiments.hypotheses import (
    CAUSES_PAGE,
    cause_tables,
    divided_by_page,
    reasons_of,
)
from ajgdata.experiments.registry import EXPERIMENTS, load_experiment
from ajgdata.experiments.requests import MeasurementKey, Request, TaskKey, requests_for
from ajgdata.pages import page_causes, page_figures
from ajgdata.paths import EXPERIMENT_PAGES_FOLDER, FIGURES_FOLDER, TABLES_FOLDER, Paths
from ajgdata.pipeline.dataset_summary import summary
from ajgdata.pipeline.exports import with_tables, write_csv, write_exports
from ajgdata.pipeline.machine import cpu_name
from ajgdata.pipeline.run_summary import run_cost
from ajgdata.pipeline.site import pages_of
from ajgdata.pipeline.studies import STUDIES
from ajgdata.pipeline.task_results import Measurement, computed, measurements, read_results
from ajgdata.report.answer import answer, placebo_sentence
from ajgdata.report.comparison import (
    PaperComparison,
    PaperFigure,
    Reason,
    in_papers_order,
    parse_paper,
    tally,
)
from ajgdata.report.format import Source, number, words
from ajgdata.report.navigation import LEADS, Group, Link, experiment_link, navigation
from ajgdata.report.render import draw_figures
from ajgdata.report.report_data import Report, ReportPart, TaskSection
from ajgdata.report.study_page import render_study
from ajgdata.report.study_tables import holds
from ajgdata.store.features import open_store, read_store
from ajgdata.store.files import json_bytes, read_json, write_bytes
from ajgdata.store.models import ABOUT_FILE, read_description
from ajgdata.store.provenance import environment, software
from ajgdata.store.report_files import (
    read_experiment_text,
    read_machine_spread,
    read_paper,
    read_practice,
)
from ajgdata.store.sessions import read_dataset
from ajgdata.store.tables import read_tables
from ajgdata.types import CROSS_VALIDATION, DataError, DatasetSpec
from ajgdata.types.table import Table

#: Title of the report of a project whose results are compared with the paper.
TITLE = "Recognising objects by sound in a soft gripper"


def published_values(paths: Paths) -> dict[str, PaperFigure]:
    """Return the published values by id, with the measured difference between machines."""
    return parse_paper(read_paper(paths), spread=read_machine_spread(paths))


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
    project. One line of the report counts results that do not exist, another those
    that the target did not request: they are of an earlier run and may be outdated.
    """
    specs = {name: read_dataset(paths, name) for name in datasets}
    expected = requests_for(specs, tasks)
    available, errors = measurements(paths, expected)
    requests = computed(expected, available)
    measured = {key: available[key] for request in requests for key in request.keys}
    existing = {}
    for name, spec in specs.items():
        if _exists(paths.features(name), _check_features, errors):
            existing[name] = spec
    present = [name for name in published if paths.published_sums(name).is_file()]
    pages = _pages(paths, studies, errors)
    paper = published_values(paths)
    all_results, skipped = _read(measured, specs, requests, paper)
    results, causes = divided_by_page(all_results)
    unread = {
        key
        for request in expected
        for job in request.jobs
        if {paths.experiment(*job), paths.experiment_cost(*job)} & errors.keys()
        for key in request.keys
    } - measured.keys()
    missing = {
        "experiments": sum(len(request.keys) for request in expected) - len(measured) - len(unread),
        "simulation studies": len({*studies} - pages.keys()),
        "published data sets": len(published) - len(present),
    }
    report = dataclasses.replace(
        _assembled(paths, existing, requests, results, paper, cause_tables(causes)),
        skipped=skipped,
        missing=tuple(f"{noun} ({count})" for noun, count in missing.items() if count),
        earlier=len({*measured} - {*requested}),
        run_cost=tuple(run_cost(paths, [*existing])),
        **_studies(pages),
    )
    practice = tuple(_practice(paths, report, errors))
    report = dataclasses.replace(report, practice=practice)
    _write(paths, report, results, pages, causes, present)
    about: dict[str, Any] = {
        "datasets": [*existing],
        "pages": [*pages, *([CAUSES_PAGE] if causes else [])],
        "published": present,
    }
    about["unreadable"] = {str(file): str(error) for file, error in errors.items()}
    facts = [measurement.about for measurement in measured.values()]
    write_bytes(paths.runs, json_bytes(about | _contents(report, facts)))


def _exists(file: Path, check: Callable[[Path], object], errors: dict[Path, DataError]) -> bool:
    """Return whether a result exists and can be read.

    `check` raises DataError if it cannot, for example because an earlier version of ajgdata wrote
    it and this target does not compute it again. The error is added to `errors`.
    """
    if not file.is_file():
        return False
    try:
        check(file)
    except DataError as error:
        errors[file] = error
        return False
    return True


def _check_features(file: Path) -> None:
    """Raise DataError if a feature file cannot be read."""
    open_store(file).close()


def _write(
    paths: Paths,
    report: Report,
    results: Sequence[TaskResults],
    pages: Mapping[str, Path],
    causes: Sequence[TaskResults],
    published: Sequence[str],
) -> None:
    """Write the pages of the report, with figures and tables.

    `pages` are the files of the studies, and `causes` the results on the page on causes.
    """
    from ajgdata.report.page import illustrations, render_pages

    folder, compares = paths.report.parent, bool(report.comparisons)
    links = [Link(experiment_link(page.name), page.title, page.about) for page in report.pages]
    nav = navigation(links, [*pages, *([CAUSES_PAGE] if causes else [])], compares=compares)
    (folder / EXPERIMENT_PAGES_FOLDER).mkdir(parents=True, exist_ok=True)  # also if it stays empty
    drawn = draw_figures(illustrations(report), folder / FIGURES_FOLDER)
    tables = write_exports(report, results, folder / TABLES_FOLDER)
    figures = {name: with_tables(picture, tables) for name, picture in drawn.items()}
    html = render_pages(report, figures, nav, published, project=paths)
    for name, text in html.items():
        write_bytes(folder / name, text.encode())
    for name in (*STUDIES, CAUSES_PAGE, *([] if compares else ["paper"])):
        paths.page(name).unlink(missing_ok=True)
    for name, file in pages.items():
        provenance, study_tables = read_tables(file)
        build_page(paths, name, provenance, study_tables, nav)
    if causes:
        sources = tuple(dict.fromkeys(task.source for task in causes))
        provenance = {"quick": False, **causes[0].results[0].about["provenance"]}
        build_page(paths, CAUSES_PAGE, provenance, cause_tables(causes), nav, sources)


def build_page(
    paths: Paths,
    name: str,
    provenance: Mapping[str, Any],
    tables: Sequence[Table],
    nav: Sequence[Group],
    sources: Sequence[Source] = (),
) -> None:
    """Draw the figures of the page `name` and write it, with the navigation of the report.

    `provenance` states what made its `tables`. `sources` are those of its data; default: those of
    the page.
    """
    from ajgdata.report.studies import figures_of

    figures = draw_figures(figures_of(name, tables), paths.page_figures(name))
    for table in tables:
        write_csv(paths.page_figures(name) / f"{table.name}.csv", table)
    html = render_study(name, provenance, tables, figures, nav, paths, sources)
    write_bytes(paths.page(name), html.encode())


#: What the summary of a run needs of a measurement.
SUMMARISED = ("dataset", "task", "experiment", "model", "skipped", "left_out", "others")


def _pages(paths: Paths, studies: Sequence[str], errors: dict[Path, DataError]) -> dict[str, Path]:
    """Return the existing file of tables of each study.

    The errors of files that cannot be read are added to `errors`.
    """
    files = {name: paths.study(name) for name in studies}
    return {name: file for name, file in files.items() if _exists(file, read_tables, errors)}


def _contents(report: Report, measured: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return what made a report, the measurements of the run, the tally of comparisons with the
    paper, the answer, and the cost of all results."""
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


def _assembled(
    paths: Paths,
    specs: Mapping[str, DatasetSpec],
    requests: Sequence[Request],
    results: Sequence[TaskResults],
    paper: Mapping[str, PaperFigure],
    causes: Sequence[Table],
) -> Report:
    """Return what the report says of results on tasks; `causes` are tables of tested hypotheses."""
    reasons = [*page_causes(results), *reasons_of(causes)]
    rows = tuple(comparisons(results, paper, reasons))
    report = Report(
        title=TITLE if rows else ", ".join(spec.title or name for name, spec in specs.items()),
        version=software()["ajgdata_version"],
        commit=software()["git_commit"],
        datasets=tuple(
            summary(paths, spec, read_store(paths.features(name))) for name, spec in specs.items()
        ),
        sections=tuple(_sections(paths, results)),
        pages=tuple(
            dataclasses.replace(page, figures=page_figures(page.name, results))
            for page in pages_of(paths, specs, requests)
        ),
        comparisons=rows,
        paper=tuple(paper.values()),
        opening=_opening(paths.opening, paths.report.parent),
        machine=f"{cpu_name()}, {os.cpu_count()} cores",
    )
    return dataclasses.replace(report, answer=tuple(answer(report)))


def _read(
    measured: Mapping[MeasurementKey, Measurement],
    specs: Mapping[str, DatasetSpec],
    requests: Sequence[Request],
    paper: Mapping[str, PaperFigure],
) -> tuple[list[TaskResults], tuple[str, ...]]:
    """Return all results on tasks, and what could not be measured."""
    read = [read_results(measured, request, specs, paper) for request in requests]
    skipped = (
        f"{task.dataset} · {words(task.task)}, {EXPERIMENTS[task.experiment].title.lower()}"
        f"{f' · {label}' if label else ''}: {reason}"
        for task, reasons in read
        for label, reason in reasons
    )
    shown = [result for result, _ in read if result.results]
    pages: dict[tuple[str, str], list[TaskResults]] = {}
    for result in shown:
        pages.setdefault((result.experiment, result.page), []).append(result)
    return [
        dataclasses.replace(result, same_page=tuple(pages[result.experiment, result.page]))
        for result in shown
    ], tuple(skipped)


def _opening(path: Path, folder: Path) -> dict[str, str] | None:
    """Return the picture that the file `path` describes, unless it could not be drawn."""
    if not path.is_file():
        return None
    about = read_json(path)
    if "skipped" in about:
        return None
    image = path.with_name("opening.svg").relative_to(folder).as_posix()
    return {"image": image, "alt": about["alt"]}


def _studies(pages: Mapping[str, Path]) -> dict[str, Any]:
    """Return the conclusions of the simulation studies, and the count of all and passed checks."""
    from ajgdata.report.studies import conclusions

    lines, verdicts = [], []
    for name in (name for name in STUDIES if name in pages):
        tables = read_tables(pages[name])[1]
        lines.append((LEADS[name].title, f"{name}.html", conclusions(name, tables)))
        verdicts += [holds(row) for table in tables for row in table.rows]
    known = [verdict for verdict in verdicts if verdict is not None]
    return {"studies": tuple(lines), "checks": (len(known), sum(known))}


def _practice(
    paths: Paths, report: Report, errors: dict[Path, DataError]
) -> Iterator[tuple[str, str, str]]:
    """Yield each topic of the first page that has a result, with its link and conclusion.

    The errors of models that cannot be read are added to `errors`.
    """
    parts = {
        (section.dataset, section.task, part.experiment): part
        for section in report.sections
        for part in section.parts
    }
    for topic in read_practice(paths):
        part = parts.get((topic["dataset"], topic["task"], topic["experiment"]))
        text = part.headline if part else ""
        if model := topic.get("model"):
            text = _detection(paths.model(topic["dataset"], topic["task"], model), errors)
        if part and text:
            yield topic["topic"], experiment_link(part.page), text


def _detection(model: Path, errors: dict[Path, DataError]) -> str:
    """Return how often a trained model detects novel objects, "" if this was not measured.

    The error of a model that cannot be read is added to `errors`.
    """
    if not (model / ABOUT_FILE).is_file():
        return ""
    try:
        description = read_description(model)
    except DataError as error:
        errors[model / ABOUT_FILE] = error
        return ""
    if "skipped" in description:
        return ""
    about = description["calibration"]
    if about.get("detection_rate") is None:
        return ""
    rate, alarms = (number(100 * about[key], 2) for key in ("detection_rate", "false_alarm"))
    return f"{rate} % are detected, with false alarms for at most {alarms} % of known objects"


def _sections(paths: Paths, results: Sequence[TaskResults]) -> Iterator[TaskSection]:
    """Yield a section for each task that has a result."""
    for dataset, task in dict.fromkeys((result.dataset, result.task) for result in results):
        own = [result for result in results if (result.dataset, result.task) == (dataset, task)]
        yield TaskSection(
            dataset, task, own[0].title, own[0].source, tuple(_part(paths, r) for r in own)
        )


def _part(paths: Paths, results: TaskResults) -> ReportPart:
    experiment = load_experiment(results.experiment)
    return ReportPart(
        experiment=experiment.spec.name,
        page=results.page,
        title=experiment.spec.title,
        summary=" ".join(filter(None, (experiment.summary(results), _left_out(results)))),
        text=read_experiment_text(paths, experiment.spec.name),
        rows=tuple(experiment.rows(results)),
        figures=tuple(experiment.figures(results)),
        advice=tuple(experiment.advice(results)),
    )


def _left_out(results: TaskResults) -> str:
    """Return which classes the task leaves out as too rare, in a sentence."""
    if not results.left_out:
        return ""
    named = ", ".join(f"{label} ({count})" for label, count in results.left_out.items())
    return f"Classes left out as too rare (min_groups), with their groups: {named}."


def comparisons(
    results: Sequence[TaskResults], paper: Mapping[str, PaperFigure], reasons: Sequence[Reason]
) -> list[PaperComparison]:
    """Return the comparison with the paper, with costs and supported reasons."""

    def lookup(experiment: str, dataset: str, task: str) -> TaskResults | None:
        """Return results on the task, or else on another of its data set."""
        there = [r for r in results if (r.experiment, r.dataset) == (experiment, dataset)]
        return min(there, key=lambda r: r.task != task, default=None)

    rows = [
        dataclasses.replace(_with_cost(row, lookup), page=experiment_link(result.page))
        for result in results
        for row in load_experiment(result.experiment).paper_comparison(result, lookup)
    ]
    return [
        dataclasses.replace(row, reasons=tuple(r for r in reasons if r.is_about(row)))
        for row in in_papers_order(rows, paper.values())
    ]


def _with_cost(row: PaperComparison, lookup: Lookup) -> PaperComparison:
    """Return the row, with the cost of its model on the task where it does not say one."""
    results = lookup(CROSS_VALIDATION, row.dataset, row.task)
    if row.cost is not None or not row.model or results is None:
        return row
    return dataclasses.replace(row, cost=training_cost(results, row.model))
