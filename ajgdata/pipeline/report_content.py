"""Content of the report: data sets, results on tasks, pages, and the comparison with the paper."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, partial
from pathlib import Path

from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation_results import training_cost
from ajgdata.experiments.diagnosis import diagnosis
from ajgdata.experiments.hypotheses import reasons_of
from ajgdata.experiments.prediction_list import prediction_list
from ajgdata.experiments.registry import load_experiment
from ajgdata.experiments.requests import Request
from ajgdata.pages import page_causes, page_figures
from ajgdata.paths import Paths
from ajgdata.pipeline.dataset_summary import sound_links, summary
from ajgdata.pipeline.experiment_pages import experiment_pages
from ajgdata.pipeline.machine import cpu_name
from ajgdata.report.answer import answer
from ajgdata.report.comparison import (
    PaperComparison,
    PaperFigure,
    Reason,
    in_papers_order,
    parse_paper,
)
from ajgdata.report.format import number
from ajgdata.report.navigation import experiment_link
from ajgdata.report.report_data import Diagnosis, Report, ReportPart, TaskSection
from ajgdata.store.features import read_store
from ajgdata.store.files import read_json
from ajgdata.store.models import ABOUT_FILE, read_description
from ajgdata.store.provenance import software
from ajgdata.store.report_files import (
    read_experiment_text,
    read_machine_spread,
    read_paper,
    read_practice,
)
from ajgdata.types import CROSS_VALIDATION, DataError, DatasetSpec
from ajgdata.types.table import Table

#: Title of the report of a project whose results are compared with the paper.
TITLE = "Recognising objects by sound in a soft gripper"


def published_values(paths: Paths) -> dict[str, PaperFigure]:
    """Return the published values by id, with the measured difference between machines."""
    return parse_paper(read_paper(paths), spread=read_machine_spread(paths))


def report_content(
    paths: Paths,
    specs: Mapping[str, DatasetSpec],
    requests: Sequence[Request],
    results: Sequence[TaskResults],
    causes: Sequence[Table],
    paper: Mapping[str, PaperFigure],
) -> Report:
    """Return the content of a report on the results of tasks, without facts about the run.

    `specs` are the data sets with a feature file, and `causes` the tables of tested hypotheses.
    """
    reasons = [*page_causes(results), *reasons_of(causes)]
    rows = tuple(_comparisons(results, paper, reasons))
    titles = [spec.title or name for name, spec in specs.items()]
    program = software()
    report = Report(
        title=TITLE if rows else ", ".join(titles),
        version=program["ajgdata_version"],
        commit=program["git_commit"],
        datasets=tuple(
            summary(paths, spec, read_store(paths.features(name))) for name, spec in specs.items()
        ),
        sections=tuple(_sections(paths, results)),
        pages=tuple(
            dataclasses.replace(page, figures=page_figures(page.name, results))
            for page in experiment_pages(paths, specs, requests, list(paper))
        ),
        comparisons=rows,
        paper=tuple(paper.values()),
        opening=_opening_picture(paths),
        machine=f"{cpu_name()}, {os.cpu_count()} cores",
        diagnoses=() if rows else tuple(_diagnoses(paths, results)),
    )
    return dataclasses.replace(report, answer=tuple(answer(report)))


def _comparisons(
    results: Sequence[TaskResults], paper: Mapping[str, PaperFigure], reasons: Sequence[Reason]
) -> list[PaperComparison]:
    """Return the comparisons with the paper in its order, with costs and supported reasons."""

    def lookup(experiment: str, dataset: str, task: str) -> TaskResults | None:
        """Return the results on a task, or else on another task of its data set."""
        available = [r for r in results if (r.experiment, r.dataset) == (experiment, dataset)]
        return min(available, key=lambda r: r.task != task, default=None)

    rows = []
    for result in results:
        for row in load_experiment(result.experiment).paper_comparison(result, lookup):
            cost = row.cost
            if cost is None and row.model:
                trained = lookup(CROSS_VALIDATION, row.dataset, row.task)
                if trained is not None:
                    cost = training_cost(trained, row.model)
            rows.append(dataclasses.replace(row, cost=cost, page=experiment_link(result.page)))
    return [
        dataclasses.replace(
            row, reasons=tuple(reason for reason in reasons if reason.is_about(row))
        )
        for row in in_papers_order(rows, paper.values())
    ]


def _sections(paths: Paths, results: Sequence[TaskResults]) -> Iterator[TaskSection]:
    """Yield a section for each task that has a result."""
    by_task: dict[tuple[str, str], list[TaskResults]] = {}
    for result in results:
        by_task.setdefault((result.dataset, result.task), []).append(result)
    links = cache(partial(sound_links, paths))
    for (dataset, task), own in by_task.items():
        parts = tuple(_part(paths, result, links(dataset)) for result in own)
        yield TaskSection(dataset, task, own[0].title, own[0].source, parts)


def _diagnoses(paths: Paths, results: Sequence[TaskResults]) -> Iterator[Diagnosis]:
    """Yield the diagnosis of each task with a cross-validation by grasp."""
    for result in results:
        if result.experiment == CROSS_VALIDATION and result.task_settings.groups == "grasp_id":
            yield diagnosis(result, sound_links(paths, result.dataset))


def _part(paths: Paths, results: TaskResults, link: Callable[[str], str]) -> ReportPart:
    """Return the content of one experiment on one task; `link` returns the link to a recording."""
    experiment = load_experiment(results.experiment)
    sentences = [experiment.summary(results)]
    if results.left_out:
        rare = ", ".join(f"{label} ({count})" for label, count in results.left_out.items())
        sentences.append(f"Classes left out as too rare (min_groups), with their groups: {rare}.")
    return ReportPart(
        experiment=experiment.spec.name,
        page=results.page,
        title=experiment.spec.title,
        summary=" ".join(filter(None, sentences)),
        text=read_experiment_text(paths, experiment.spec.name),
        rows=tuple(experiment.rows(results)),
        figures=tuple(experiment.figures(results)),
        advice=tuple(experiment.advice(results)),
        predictions=(
            prediction_list(results, link) if results.experiment == CROSS_VALIDATION else None
        ),
    )


def _opening_picture(paths: Paths) -> dict[str, str] | None:
    """Return the opening picture; None if it does not exist or could not be drawn."""
    if not paths.opening.is_file():
        return None
    about = read_json(paths.opening)
    if "skipped" in about:
        return None
    image = paths.opening.with_name("opening.svg").relative_to(paths.report.parent)
    return {"image": image.as_posix(), "alt": about["alt"]}


def practice_topics(
    paths: Paths, sections: Sequence[TaskSection], errors: dict[Path, DataError]
) -> Iterator[tuple[str, str, str]]:
    """Yield the topics "In practice" of the first page that have a result: topic, link, conclusion.

    The errors of models that cannot be read are added to `errors`.
    """
    parts = {
        (section.dataset, section.task, part.experiment): part
        for section in sections
        for part in section.parts
    }
    for topic in read_practice(paths):
        part = parts.get((topic["dataset"], topic["task"], topic["experiment"]))
        text = part.headline if part else ""
        model = topic.get("model")
        if model:
            text = _detection(paths.model(topic["dataset"], topic["task"], model), errors)
        if part and text:
            yield topic["topic"], experiment_link(part.page), text


def _detection(model: Path, errors: dict[Path, DataError]) -> str:
    """Return how often a trained model detects novel objects; "" if this was not measured.

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
    calibration = description["calibration"]
    if calibration.get("detection_rate") is None:
        return ""
    rate = number(100 * calibration["detection_rate"], 2)
    alarms = number(100 * calibration["false_alarm"], 2)
    return f"{rate} % are detected, with false alarms for at most {alarms} % of known objects"
