"""First page: answer, comparison with the paper or the models of each task, and links."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from ajgdata.report.forest import ForestTable, model_forest, paper_forest
from ajgdata.report.format import Source, short_commit, web_link
from ajgdata.report.navigation import experiment_link
from ajgdata.report.render import DrawnFigure
from ajgdata.report.report_data import DatasetSummary, Illustration, Report
from ajgdata.types import many

#: End of the name of a task's figure of error against run time.
RUN_TIME = "--run-time"
#: Experiment that measures the gain from more grasps.
LEARNING_CURVE = "learning_curve"


class Reproduction(NamedTuple):
    """Relation of the report to the paper, with the address of the paper; "" if it is unknown."""

    text: str
    url: str


class RecordingCount(NamedTuple):
    """Number of recordings of a source, in words."""

    text: str
    source: Source


class IndexCause(NamedTuple):
    """A supported cause of differences, with the name of the first result that it explains."""

    result: str
    claim: str
    link: str


class IndexComparison(NamedTuple):
    """Comparison with the paper on the first page."""

    title: str
    forest: ForestTable | None
    causes: list[IndexCause]
    is_a_cause_tested: bool


class SampleRecordings(NamedTuple):
    """Mean spectra of a data set, and label and link of a recording of each class."""

    figures: list[DrawnFigure]
    samples: tuple[tuple[str, str], ...]


class TaskOverview(NamedTuple):
    """Results of a project without published values, with next steps."""

    forest: ForestTable | None
    figures: list[DrawnFigure]
    diagnoses: list[str]
    advice: list[str]
    is_learning_curve_missing: bool
    quarantined: str
    recordings: list[SampleRecordings]


class IndexFooter(NamedTuple):
    """Facts of the run at the end of the first page; texts may be empty."""

    commit: str
    cost: str
    machine: str
    checks: str
    n_quarantined: int
    issues: str
    n_skipped: int
    run_time_link: str


@dataclass(frozen=True)
class IndexView:
    """Values of the template of the first page."""

    title: str
    reproduction: Reproduction | None
    counts: list[RecordingCount]
    opening: Mapping[str, str] | None
    answer: tuple[str, ...]
    comparison: IndexComparison | None
    practice: tuple[tuple[str, str, str], ...]
    studies: tuple[tuple[str, str, str], ...]
    overview: TaskOverview | None
    n_earlier: int
    missing: str
    footer: IndexFooter


def index_view(report: Report, figures: Mapping[str, DrawnFigure]) -> IndexView:
    """Return the values of the first page; `figures` are those of the report by name."""
    has_comparison = bool(report.comparisons)
    counts = [
        RecordingCount(f"{count:,} recordings", source)
        for source, count in report.recordings_by_source.items()
    ]
    return IndexView(
        title=report.title,
        reproduction=_reproduction(report) if has_comparison else None,
        counts=counts,
        opening=report.opening,
        answer=report.answer,
        comparison=_comparison(report) if has_comparison else None,
        practice=report.practice,
        studies=report.studies,
        overview=_overview(report, figures) if report.sections and not has_comparison else None,
        n_earlier=report.earlier,
        missing=", ".join(report.missing),
        footer=_footer(report),
    )


def _reproduction(report: Report) -> Reproduction:
    text = "Simulated reproduction" if report.is_simulated else "Reproduction"
    return Reproduction(text, web_link(report.comparisons[0].paper.url))


def _comparison(report: Report) -> IndexComparison:
    claims: dict[str, IndexCause] = {}
    for row, reason in report.causes:
        claims.setdefault(reason.claim, IndexCause(row.name, reason.claim, reason.link))
    result = "Our result, simulated" if report.is_simulated else "Our result"
    return IndexComparison(
        title=f"{len(report.comparisons)} results of the paper: {report.tally}",
        forest=paper_forest(report.comparisons, with_badges=report.has_both_sources, result=result),
        causes=list(claims.values()),
        is_a_cause_tested=any(row.reasons for row in report.comparisons),
    )


def _overview(report: Report, figures: Mapping[str, DrawnFigure]) -> TaskOverview:
    experiments = {part.experiment for section in report.sections for part in section.parts}
    n_quarantined = _n_quarantined(report.datasets)
    return TaskOverview(
        forest=model_forest(report.sections, with_badges=report.has_both_sources),
        figures=[figures[figure.name] for figure in task_figures(report)],
        diagnoses=[f"{diagnosis.title}: {diagnosis.answer}" for diagnosis in report.diagnoses],
        advice=[f"{section.title}: {text}" for section, text in report.advice],
        is_learning_curve_missing=LEARNING_CURVE not in experiments,
        quarantined=f"{many(n_quarantined, 'recording')} quarantined" if n_quarantined else "",
        recordings=[
            SampleRecordings(
                [figures[dataset.spectra_name]] if dataset.spectra_name in figures else [],
                dataset.samples,
            )
            for dataset in report.datasets
        ],
    )


def task_figures(report: Report) -> list[Illustration]:
    """Return the first figure of each task, or the figure of a page that replaces it."""
    replacing = {
        name: figure for page in report.pages for figure in page.figures for name in figure.replaces
    }
    shown: dict[str, Illustration] = {}
    for section in report.sections:
        for first in section.parts[0].figures[:1]:
            figure = replacing.get(first.name, first)
            shown[figure.name] = figure
    return list(shown.values())


def _footer(report: Report) -> IndexFooter:
    n_checks, n_passed = report.checks
    return IndexFooter(
        commit=short_commit(report.commit),
        cost=report.cost,
        machine=report.machine,
        checks=f"{n_passed} of {n_checks} checks of the simulation passed" if n_checks else "",
        n_quarantined=_n_quarantined(report.datasets),
        issues=str(report.issues),
        n_skipped=len(report.skipped),
        run_time_link=run_time_link(report),
    )


def _n_quarantined(datasets: Sequence[DatasetSummary]) -> int:
    return sum(dataset.n_left_out for dataset in datasets)


def run_time_link(report: Report) -> str:
    """Return the link to the figure of error against run time with most models, or ""."""
    links = {
        f"{experiment_link(part.page)}#{figure.name}": len(part.rows)
        for section in report.sections
        for part in section.parts
        for figure in part.figures
        if figure.name.endswith(RUN_TIME)
    }
    return max(links, key=lambda link: links[link], default="")
