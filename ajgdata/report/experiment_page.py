"""Page on an experiment: answer, comparison with the paper, causes of differences, and details."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from ajgdata.report.answer import best_sentence, compared_sentence
from ajgdata.report.comparison import PaperComparison, Reason, evidence, tally, tally_text
from ajgdata.report.forest import ForestTable, paper_forest
from ajgdata.report.format import DASH, Source, sentence, short_commit
from ajgdata.report.navigation import experiment_link
from ajgdata.report.predictions import PredictionList
from ajgdata.report.render import DrawnFigure
from ajgdata.report.report_data import (
    DatasetSummary,
    ExperimentPage,
    Illustration,
    Report,
    ReportPart,
    TaskSection,
)
from ajgdata.report.results_table import ResultsTable, results_table
from ajgdata.types import many

#: Figures of a page that are not folded.
MAX_OPEN_FIGURES = 4
#: Rows of a table, and lines of a list, that are not folded.
MAX_OPEN_ROWS = 6

#: An experiment on a task, with the section of the task.
SectionPart = tuple[TaskSection, ReportPart]


class TestedCause(NamedTuple):
    """A tested cause of differences: names of its results in brackets, claim and evidence.

    `evidence` is empty if the cause is not supported.
    """

    is_supported: bool
    results: str
    claim: str
    link: str
    evidence: str


class FoldedPart(NamedTuple):
    """Details of an experiment on a task that a page shows on demand."""

    title: str
    summary: str
    figures: tuple[DrawnFigure, ...]


class TaskPredictions(NamedTuple):
    """Listed predictions of a task."""

    title: str
    list: PredictionList


class MethodLink(NamedTuple):
    """Link to the description of a method, and the punctuation after it."""

    experiment: str
    title: str
    punctuation: str


class UsedDataset(NamedTuple):
    """A data set of the page, with its number of recordings and sessions in words."""

    name: str
    title: str
    source: Source
    size: str
    commit: str


@dataclass(frozen=True)
class ExperimentView:
    """Values of the template of a page on an experiment."""

    title: str
    question: str
    command: str
    sources: list[Source]
    verdicts: str
    is_empty: bool
    answer: str
    first_figures: list[DrawnFigure]
    comparison_note: str
    forest: ForestTable | None
    remarks: list[str]
    causes: list[TestedCause]
    untested: list[str]
    has_differences: bool
    more_heading: str
    headlines: list[str]
    more_figures: list[DrawnFigure]
    results: ResultsTable | None
    are_results_open: bool
    folded: list[FoldedPart]
    predictions: list[TaskPredictions]
    predictions_heading: str
    methods: list[MethodLink]
    datasets: list[UsedDataset]
    version: str
    commit: str


def experiment_view(
    page: ExperimentPage, report: Report, figures: Mapping[str, DrawnFigure]
) -> ExperimentView:
    """Return the values of a page; `figures` are those of the report by name."""
    sections = report.on(page.name)
    link = experiment_link(page.name)
    comparisons = [row for row in report.comparisons if row.page == link]
    parts = ordered_parts(sections, comparisons)
    open_names = [figure.name for figure in open_figures(page, [part for _, part in parts])]
    opened = [figures[name] for name in open_names]
    headlines = headlines_by_dataset(parts) if len(parts) > 1 else []
    causes = tested_causes(comparisons)
    untested = [row.name for row in comparisons if row.differs and not row.reasons]
    has_more = bool(headlines or opened[1:])
    n_rows = sum(len(section.rows) for section in sections)
    predictions = [
        TaskPredictions(section.title, part.predictions)
        for section, part in parts
        if part.predictions
    ]
    can_listen = any(task.list.has_sound for task in predictions)
    return ExperimentView(
        title=page.title,
        question=page.question,
        command=page.command,
        sources=sorted({section.source for section in sections}),
        verdicts=verdicts_text(comparisons),
        is_empty=not sections,
        answer=page_answer(page, comparisons, parts),
        first_figures=opened[:1],
        comparison_note=page.comparison_note,
        forest=paper_forest(comparisons, with_badges=report.has_both_sources),
        remarks=[f"{row.name}: {row.agrees}; {row.remark}." for row in comparisons if row.remark],
        causes=causes,
        untested=untested,
        has_differences=bool(causes or untested),
        more_heading=_more_heading(parts) if has_more else "",
        headlines=headlines,
        more_figures=opened[1:],
        results=results_table(sections),
        are_results_open=not comparisons and n_rows <= MAX_OPEN_ROWS,
        folded=list(folded_parts(page, sections, open_names, figures)),
        predictions=predictions,
        predictions_heading=f"Look at {'and listen to ' if can_listen else ''}predictions",
        methods=_method_links(parts),
        datasets=_used_datasets(report.datasets, sections),
        version=report.version,
        commit=short_commit(report.commit),
    )


def ordered_parts(
    sections: Sequence[TaskSection], comparisons: Sequence[PaperComparison]
) -> list[SectionPart]:
    """Return the parts of a page; the part of the first comparison with the paper comes first."""
    first = {(row.dataset, row.task, row.experiment) for row in comparisons[:1]}
    parts = [(section, part) for section in sections for part in section.parts]
    return sorted(
        parts, key=lambda pair: (pair[0].dataset, pair[0].task, pair[1].experiment) not in first
    )


def verdicts_text(comparisons: Iterable[PaperComparison]) -> str:
    """Return the verdict of all results, or the number of results with each verdict."""
    counts = tally(comparisons)
    if len(counts) == 1:
        return next(iter(counts))
    return tally_text(counts)


def page_answer(
    page: ExperimentPage,
    comparisons: Sequence[PaperComparison],
    parts: Sequence[SectionPart],
) -> str:
    """Return the first sentence of a page: on the paper's result, the figure or the best model.

    Without a comparison with the paper, the best model comes before the figure. The sentence is
    empty if a page has none of the three.
    """
    compared = [compared_sentence(row) for row in comparisons]
    best = [
        best_sentence(section, row) for section, part in parts for row in part.rows if row.answer
    ]
    titles = [figure.title for figure in page.figures] + [part.headline for _, part in parts]
    conclusions = [f"{sentence(title)}." for title in titles if title]
    sentences = [*compared, *conclusions, *best] if comparisons else [*best, *conclusions]
    return next(filter(None, sentences), "")


def open_figures(page: ExperimentPage, parts: Sequence[ReportPart]) -> list[Illustration]:
    """Return the figures of a page that are not folded.

    A page with its own figures shows only them. Other pages show the first figure of each part.
    """
    figures = page.figures or [part.figures[0] for part in parts if part.figures]
    return list(figures[:MAX_OPEN_FIGURES])


def headlines_by_dataset(parts: Sequence[SectionPart]) -> list[str]:
    """Return one line per data set with the conclusions on its tasks, up to `MAX_OPEN_ROWS`."""
    headlines: dict[str, list[str]] = {}
    for section, part in parts:
        if part.headline:
            dataset, _, task = section.title.rpartition(" · ")
            headlines.setdefault(dataset, []).append(f"{task}, {part.headline}")
    lines = [f"{dataset}: {'; '.join(texts)}." for dataset, texts in headlines.items()]
    hidden = len(lines) - MAX_OPEN_ROWS
    if hidden > 0:
        return [*lines[:MAX_OPEN_ROWS], f"{hidden} more data sets: see the details."]
    return lines


def _more_heading(parts: Sequence[SectionPart]) -> str:
    return "Results by data set" if len(parts) > 1 else "More results"


def tested_causes(comparisons: Sequence[PaperComparison]) -> list[TestedCause]:
    """Return the tested causes of differences, supported causes first."""
    results: dict[tuple[bool, Reason], list[str]] = {}
    for row in comparisons:
        if row.differs:
            for reason in row.reasons:
                results.setdefault((reason in row.why, reason), []).append(row.name)
    causes = [
        TestedCause(
            is_supported,
            f" ({'; '.join(names)})" if len(comparisons) > 1 else "",
            reason.claim,
            reason.link,
            evidence(reason) if is_supported else "",
        )
        for (is_supported, reason), names in results.items()
    ]
    return sorted(causes, key=lambda cause: not cause.is_supported)


def replaced_names(page: ExperimentPage) -> set[str]:
    """Return the names of the figures of experiments that the figures of a page replace."""
    return {name for figure in page.figures for name in figure.replaces}


def folded_parts(
    page: ExperimentPage,
    sections: Sequence[TaskSection],
    open_names: Sequence[str],
    figures: Mapping[str, DrawnFigure],
) -> Iterator[FoldedPart]:
    """Yield the folded details of each part that has a summary, or figures that are not open.

    A figure that a figure of the page replaces is not shown.
    """
    hidden = {*open_names, *replaced_names(page)}
    for section in sections:
        for part in section.parts:
            own = [figures[figure.name] for figure in part.figures if figure.name not in hidden]
            if part.summary or own:
                title = f"{section.title}: {part.title.lower()}"
                yield FoldedPart(title, part.summary, tuple(own))


def _method_links(parts: Sequence[SectionPart]) -> list[MethodLink]:
    methods = dict.fromkeys((part.experiment, part.title) for _, part in parts if part.text)
    last = len(methods) - 1
    return [
        MethodLink(experiment, title, ", " if number < last else ".")
        for number, (experiment, title) in enumerate(methods)
    ]


def _used_datasets(
    datasets: Sequence[DatasetSummary], sections: Sequence[TaskSection]
) -> list[UsedDataset]:
    names = {section.dataset for section in sections}
    return [
        UsedDataset(
            dataset.name,
            dataset.title,
            dataset.source,
            f"{dataset.n_recordings:,} recordings in {many(dataset.n_sessions, 'session')}",
            short_commit(dataset.provenance["commit"]) or DASH,
        )
        for dataset in datasets
        if dataset.name in names
    ]
