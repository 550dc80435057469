"""Content of a report: plain values, figures that are not drawn yet, and text.

The report has a list of experiments, and none by name: a `ReportPart` has what an experiment shows.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ajgdata.report.comparison import Mark, PaperComparison, PaperFigure, Reason, tally, tally_text
from ajgdata.report.format import Caption, Source
from ajgdata.store.benchmarks import RuleCost, cost_text
from ajgdata.types import (
    FeatureSettings,
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
    """A figure that is not drawn yet: file name without suffix, words, and how to draw it.

    `title` is its conclusion, which is also drawn. `table` has its values; the figures of
    experiments have none, because the tables of the experiments are written. The figure of a page
    `replaces` the figures of experiments that show the same, by name.
    """

    name: str
    caption: Caption
    draw: Callable[[], Figure]
    title: str = ""
    table: Table | None = None
    replaces: tuple[str, ...] = ()


@dataclass(frozen=True)
class ResultRow:
    """A row of the table of results; what a row does not have is empty.

    `answer` is the value with its interval, of the best model of a task.
    """

    label: str
    metric: str
    value: str
    chance: str = ""
    train_cpu_s: str = ""
    prediction_ms: str = ""
    best: bool = False
    part: str = ""  #: heading of the rows that it stands among
    paper: PaperFigure | None = None
    answer: str = ""
    marks: tuple[Mark, ...] = ()  #: for a forest plot, in `unit`
    unit: str = ""
    controls: str = ""  #: result with held-out sessions and the placebo, for a sentence


@dataclass(frozen=True, eq=False)
class Spectra:
    """Mean feature per class or target bin: frequency_hz (f,), mean (n, f), n labels."""

    frequency_hz: np.ndarray
    labels: tuple[str, ...]
    mean: np.ndarray
    grouping: str = "class"


@dataclass(frozen=True, eq=False)
class DatasetSummary:
    """One data set: what the report and the dataset card show of it.

    `provenance`: `commit` of the code, `config_hash` of settings, `inputs_hash`.
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
    features: FeatureSettings
    provenance: Mapping[str, str]
    url: str = ""
    findings: tuple[Finding, ...] = ()
    spectra: Spectra | None = None
    samples: tuple[tuple[str, str], ...] = ()  #: label and link of a recording of each class

    @property
    def spectra_name(self) -> str:
        """Return the name of the figure of its mean spectra."""
        return f"spectra--{self.name}"

    @property
    def n_left_out(self) -> int:
        """Return the number of recordings that were left out."""
        return len(left_out(self.findings))

    @property
    def n_flagged(self) -> int:
        """Return the number of recordings that are used, and not without remark."""
        return len(flagged(self.findings))

    @property
    def issues(self) -> IssueCounts:
        """Return the numbers of recordings with issues, as `ajgdata check` counts them."""
        return issue_counts(self.findings)


def findings_by_code(findings: Iterable[Finding]) -> list[tuple[str, list[Finding]]]:
    """Return the findings of each code, in the alphabetical order of the codes."""
    by_code: dict[str, list[Finding]] = {}
    for finding in findings:
        by_code.setdefault(finding.code, []).append(finding)
    return sorted(by_code.items())


@dataclass(frozen=True)
class ReportPart:
    """One experiment on one task: rows of the main table, figures, tables.

    `summary` stands first; `text` (Markdown) has question, method, and how to read the figure.
    `advice` are sentences on what to do next.
    """

    experiment: str
    page: str
    title: str
    summary: str
    text: str
    rows: tuple[ResultRow, ...]
    figures: tuple[Illustration, ...]
    advice: tuple[str, ...] = ()

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
        """Return the place of the section on the page."""
        return f"task-{self.dataset}-{self.task}"

    @property
    def rows(self) -> list[ResultRow]:
        """Return all its rows of the table of results."""
        return [row for part in self.parts for row in part.rows]


@dataclass(frozen=True)
class ExperimentPage:
    """A page on one experiment: the question, and the command that rebuilds it.

    `about` is the group of the navigation that it belongs to. The page begins with its own
    `figures`, if it has any. `comparison_note` limits its comparison with the paper.
    """

    name: str
    title: str
    question: str
    command: str
    about: str
    figures: tuple[Illustration, ...] = ()
    comparison_note: str = ""


@dataclass(frozen=True, eq=False)
class Report:
    """Everything on the pages, in the order in which it is shown.

    `opening` is the first picture: `image`, relative to the report's folder, and `alt`. `checks`
    counts the checks of the simulation studies, and those of them that hold; `studies` are their
    titles, links and conclusions. `skipped` are texts on measurements that could not be made, with
    the reason. `missing` says how many results of each kind no run has computed yet, `earlier` how
    many are of an earlier run. `paper` is all that the paper reports, whether it is here or not.
    `answer` are up to three sentences, `practice` topics with links and conclusions, and
    `machine` the computer that wrote the report.
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

    @property
    def issues(self) -> IssueCounts:
        """Return the numbers of recordings with issues, in all data sets."""
        return sum((dataset.issues for dataset in self.datasets), IssueCounts())

    @property
    def cost(self) -> str:
        """Return the cost of all jobs in words, "" if nothing was measured."""
        return cost_text(self.run_cost[-1]) if self.run_cost else ""

    @property
    def advice(self) -> list[tuple[TaskSection, str]]:
        """Return what to do next, by task."""
        parts = ((section, part) for section in self.sections for part in section.parts)
        return [(section, text) for section, part in parts for text in part.advice]

    @property
    def causes(self) -> list[tuple[PaperComparison, Reason]]:
        """Return each result that differs from the paper with each supported cause."""
        return [(row, reason) for row in self.comparisons if row.differs for reason in row.why]

    @property
    def absent(self) -> list[PaperFigure]:
        """Return what the paper reports and this report does not."""
        known = {row.paper.id for row in self.comparisons}
        return [figure for figure in self.paper if figure.id not in known]

    @property
    def tally(self) -> str:
        """Return how many rows have each verdict: `5 agree, 8 worse`."""
        return tally_text(tally(self.comparisons))

    @property
    def recordings_by_source(self) -> dict[Source, int]:
        """Return the number of recordings of each source that features were made of."""
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
        """Return the sections of a page: those of its parts that stand on it."""
        sections = []
        for section in self.sections:
            if parts := tuple(part for part in section.parts if part.page == page):
                sections.append(replace(section, parts=parts))
        return sections
