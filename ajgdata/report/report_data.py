"""Content of a report: plain values, figures that are not drawn yet, and text.

The report knows no experiment by name: a `ReportPart` has the content of one experiment on a task.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ajgdata.report.comparison import Mark, PaperComparison, PaperFigure, Reason, tally, tally_text
from ajgdata.report.format import Caption, Source
from ajgdata.report.predictions import PredictionList
from ajgdata.store.benchmarks import RuleCost, cost_text
from ajgdata.types import (
    FeatureKind,
    Finding,
    IssueCounts,
    flagged,
    issue_counts,
    left_out,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ajgdata.types.table import Table


class Illustration(NamedTuple):
    """A figure that is not drawn yet: file name without suffix, caption, and the drawing function.

    `title` is the conclusion, which is also drawn. `table` has the values of the figure of a page;
    the values of other figures are in the tables of their experiments. The figure of a page
    `replaces` the figures of experiments with the same content; these are their names.
    """

    name: str
    caption: Caption
    draw: Callable[[], Figure]
    title: str = ""
    table: Table | None = None
    replaces: tuple[str, ...] = ()


@dataclass(frozen=True)
class ResultRow:
    """A row of the table of results; missing values are empty.

    `answer` is the value of the best model of a task, with its interval.
    """

    label: str
    metric: str
    value: str
    chance: str = ""
    train_cpu_s: str = ""
    prediction_ms: str = ""
    best: bool = False
    part: str = ""  #: heading of a group of rows
    paper: PaperFigure | None = None
    answer: str = ""
    marks: tuple[Mark, ...] = ()  #: for the forest plot, in `unit`
    unit: str = ""
    controls: str = ""  #: result with held-out sessions and the placebo, for a sentence


@dataclass(frozen=True, eq=False)
class Spectra:
    """Mean feature per class, or per range of the target.

    `frequency_hz` is (f,), `mean` is (n, f), and `labels` are n texts. `grouping` is the target.
    """

    frequency_hz: np.ndarray
    labels: tuple[str, ...]
    mean: np.ndarray
    grouping: str = "class"


@dataclass(frozen=True, eq=False)
class DatasetSummary:
    """A data set in the report and in its dataset card.

    `provenance` has the `commit` of the code, the `config_hash` of the settings, and the
    `inputs_hash` of the recordings.
    """

    name: str
    title: str
    source: Source
    description: str
    n_recordings: int
    n_sessions: int
    sample_rate_hz: int
    licence: str
    citation: str
    features: FeatureKind
    provenance: Mapping[str, str]
    url: str = ""
    findings: tuple[Finding, ...] = ()
    spectra: Spectra | None = None
    samples: tuple[tuple[str, str], ...] = ()  #: label and link of a recording of each class

    @property
    def spectra_name(self) -> str:
        """Return the name of the figure with the mean spectra."""
        return f"spectra--{self.name}"

    @property
    def n_left_out(self) -> int:
        """Return the number of quarantined recordings."""
        return len(left_out(self.findings))

    @property
    def n_flagged(self) -> int:
        """Return the number of recordings that are used although they have issues."""
        return len(flagged(self.findings))

    @property
    def issues(self) -> IssueCounts:
        """Return the numbers of recordings with issues, as `ajgdata check` counts them."""
        return issue_counts(self.findings)


class IssueLine(NamedTuple):
    """Issues of one code: their number and an example."""

    n_issues: int
    code: str
    example: str


def findings_by_code(findings: Iterable[Finding]) -> list[tuple[str, list[Finding]]]:
    """Return the findings of each code, in the alphabetical order of the codes."""
    by_code: dict[str, list[Finding]] = {}
    for finding in findings:
        by_code.setdefault(finding.code, []).append(finding)
    return sorted(by_code.items())


@dataclass(frozen=True)
class ReportPart:
    """One experiment on one task: rows of the table of results, figures and texts.

    `summary` is the first sentence. `text` (Markdown) has question, method, and how to read the
    figure. `advice` are sentences on next steps. `predictions` are listed with their sounds.
    """

    experiment: str
    page: str
    title: str
    summary: str
    text: str
    rows: tuple[ResultRow, ...]
    figures: tuple[Illustration, ...]
    advice: tuple[str, ...] = ()
    predictions: PredictionList | None = None

    @property
    def headline(self) -> str:
        """Return the conclusion of the first figure."""
        return self.figures[0].title if self.figures else ""


@dataclass(frozen=True)
class TaskSection:
    """A task (or an embedding) of a data set with its experiments, in the order of the report."""

    dataset: str
    task: str
    title: str
    source: Source
    parts: tuple[ReportPart, ...]

    @property
    def anchor(self) -> str:
        """Return the anchor of the section, to which links lead."""
        return f"task-{self.dataset}-{self.task}"

    @property
    def rows(self) -> list[ResultRow]:
        """Return the rows of all parts."""
        return [row for part in self.parts for row in part.rows]


@dataclass(frozen=True)
class ExperimentPage:
    """A page on one experiment: the question, and the command that rebuilds the page.

    `about` is its group in the navigation. The page begins with its own `figures`, if it has any.
    `comparison_note` states limits of the comparison with the paper.
    """

    name: str
    title: str
    question: str
    command: str
    about: str
    figures: tuple[Illustration, ...] = ()
    comparison_note: str = ""


class PlanRow(NamedTuple):
    """A line of the plan of a session: an object is placed, and grasped `grasps` times."""

    step: int
    label: str
    placement: int
    grasps: int


class Diagnosis(NamedTuple):
    """Whether a model recognises the object or the placement, and what to record next.

    `title` names the task. `answer` and `explanation` are sentences, `sounds` are texts with links
    to recordings, and `sounds_text` states what to listen for. `plan` is the plan of the next
    session, and `plan_table` the same as a table. The plan is empty for a target of numbers.
    """

    title: str
    source: Source
    answer: str
    explanation: str
    figure: Illustration
    sounds: tuple[tuple[str, str], ...]
    sounds_text: str
    advice: str
    plan: tuple[PlanRow, ...]
    plan_table: Table


@dataclass(frozen=True, eq=False)
class Report:
    """Content of all pages.

    - `opening`: the first picture, with `image` (relative to the folder of the report) and `alt`
    - `checks`: number of checks of the simulation studies, and number of passed checks
    - `skipped`: skipped measurements with reasons, as texts
    - `missing`: number of results that no run has computed yet, as a text per kind of result
    - `earlier`: number of results of an earlier run
    - `paper`: all published values
    - `studies`: title, link and conclusion of each simulation study
    - `answer`: up to three sentences
    - `practice`: topics with links and conclusions
    - `machine`: the computer that wrote the report
    - `diagnoses`: object or placement, for each task of own data
    """

    title: str
    version: str
    commit: str
    datasets: tuple[DatasetSummary, ...]
    sections: tuple[TaskSection, ...] = ()
    pages: tuple[ExperimentPage, ...] = ()
    comparisons: tuple[PaperComparison, ...] = ()
    opening: Mapping[str, str] | None = None
    checks: tuple[int, int] = (0, 0)
    skipped: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    earlier: int = 0
    run_cost: tuple[RuleCost, ...] = ()
    paper: tuple[PaperFigure, ...] = ()
    studies: tuple[tuple[str, str, str], ...] = ()
    answer: tuple[str, ...] = ()
    practice: tuple[tuple[str, str, str], ...] = ()
    machine: str = ""
    diagnoses: tuple[Diagnosis, ...] = ()

    @property
    def issues(self) -> IssueCounts:
        """Return the numbers of recordings with issues, in all data sets."""
        return sum((dataset.issues for dataset in self.datasets), IssueCounts())

    @property
    def cost(self) -> str:
        """Return the cost of all jobs in words; "" if no cost was measured."""
        return cost_text(self.run_cost[-1]) if self.run_cost else ""

    @property
    def advice(self) -> list[tuple[TaskSection, str]]:
        """Return the advice on each task."""
        parts = ((section, part) for section in self.sections for part in section.parts)
        return [(section, text) for section, part in parts for text in part.advice]

    @property
    def causes(self) -> list[tuple[PaperComparison, Reason]]:
        """Return each result that differs from the paper with each supported cause."""
        return [(row, reason) for row in self.comparisons if row.differs for reason in row.why]

    @property
    def absent(self) -> list[PaperFigure]:
        """Return the published values without a result in this report."""
        known = {row.paper.id for row in self.comparisons}
        return [figure for figure in self.paper if figure.id not in known]

    @property
    def tally(self) -> str:
        """Return the number of results with each verdict in words: `5 agree, 8 worse`."""
        return tally_text(tally(self.comparisons))

    @property
    def recordings_by_source(self) -> dict[Source, int]:
        """Return the number of recordings of each source."""
        counts = Counter[Source]()
        for dataset in self.datasets:
            counts[dataset.source] += dataset.n_recordings
        return dict(counts)

    @property
    def is_simulated(self) -> bool:
        """Return whether all recordings are simulated; False without recordings."""
        return list(self.recordings_by_source) == ["simulated"]

    @property
    def has_both_sources(self) -> bool:
        """Return whether some recordings are simulated, and others recorded."""
        return len(self.recordings_by_source) > 1

    def on(self, page: str) -> list[TaskSection]:
        """Return the sections of a page, with the parts that this page shows."""
        sections = []
        for section in self.sections:
            parts = tuple(part for part in section.parts if part.page == page)
            if parts:
                sections.append(replace(section, parts=parts))
        return sections
