"""Content of a report: plain values, figures that are not drawn yet, and text.

The report knows a list of experiments and none by name: what one has to show is in its `Part`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ajgdata.report.blocks import Illustration, ResultRow
from ajgdata.report.comparison import PaperComparison, tally
from ajgdata.report.format import Source
from ajgdata.report.paper import PaperFigure
from ajgdata.store.benchmarks import RuleCost
from ajgdata.types import FeatureSettings, Finding, flagged, left_out


@dataclass(frozen=True, eq=False)
class Spectra:
    """Mean feature per class or target bin: frequency_hz (f,), mean (n, f), n labels."""

    frequency_hz: np.ndarray
    labels: tuple[str, ...]
    mean: np.ndarray
    grouping: str = "class"


@dataclass(frozen=True)
class Provenance:
    """Which code and which inputs made a data set's results."""

    version: str
    commit: str
    config_hash: str
    inputs_hash: str


@dataclass(frozen=True, eq=False)
class DatasetSummary:
    """One data set: what the report and the dataset card show of it."""

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
    provenance: Provenance
    url: str = ""
    findings: tuple[Finding, ...] = ()
    spectra: Spectra | None = None

    @property
    def n_left_out(self) -> int:
        """Return the number of recordings that were left out."""
        return len(left_out(self.findings))

    @property
    def n_flagged(self) -> int:
        """Return the number of recordings that are used, and not without remark."""
        return len(flagged(self.findings))


@dataclass(frozen=True)
class Part:
    """One experiment on one task: rows of the main table, figures, tables.

    `name` is what the names of its files begin with. `summary` is said first; `text` (Markdown)
    says what is asked, how it is made and how its figure is read.
    """

    experiment: str
    name: str
    page: str
    title: str
    summary: str
    text: str
    rows: tuple[ResultRow, ...]
    figures: tuple[Illustration, ...]


@dataclass(frozen=True)
class TaskSection:
    """A task (or an embedding) of a data set with its experiments, in the order of the report.

    `explorer` is a link to the scatter plot of its recordings, if there is one.
    """

    dataset: str
    task: str
    title: str
    source: Source
    parts: tuple[Part, ...]
    explorer: str = ""

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
    """A page on one experiment: what is asked, and the command that makes it anew.

    `about` is the group of the navigation that it belongs to.
    """

    name: str
    title: str
    question: str
    command: str
    about: str


class OpeningPicture(NamedTuple):
    """The picture above all others, relative to the report's folder."""

    image: str
    alt: str


@dataclass(frozen=True)
class Checks:
    """How many checks of a study of the virtual gripper hold; `page` is the study's."""

    page: str
    held: int
    made: int


@dataclass(frozen=True)
class Skipped:
    """A measurement that could not be made, and why."""

    dataset: str
    what: str
    model: str
    reason: str


@dataclass(frozen=True, eq=False)
class Report:
    """Everything on the page, in the order in which it is shown."""

    title: str
    version: str
    commit: str
    datasets: tuple[DatasetSummary, ...]
    sections: tuple[TaskSection, ...] = ()
    pages: tuple[ExperimentPage, ...] = ()
    comparisons: tuple[PaperComparison, ...] = ()
    #: figures of several tasks together, by the page that they stand on ("": of all)
    opening: OpeningPicture | None = None
    checks: tuple[Checks, ...] = ()
    skipped: tuple[Skipped, ...] = ()
    run_cost: tuple[RuleCost, ...] = ()
    paper: tuple[PaperFigure, ...] = ()  #: all that the paper reports, whether it is here or not

    @property
    def absent(self) -> list[PaperFigure]:
        """Return what the paper reports and this report does not."""
        found = {row.paper.id for row in self.comparisons}
        return [figure for figure in self.paper if figure.id not in found]

    @property
    def tally(self) -> dict[str, int]:
        """Return how many rows have each verdict, then how many published values are absent."""
        return tally(self.comparisons) | ({"absent": len(self.absent)} if self.absent else {})

    @property
    def answers(self) -> list[tuple[TaskSection, ResultRow]]:
        """Return the best model of each task that has one."""
        found = ((section, row) for section in self.sections for row in section.rows)
        return [(section, row) for section, row in found if row.answer]

    @property
    def recordings(self) -> int:
        """Return the number of recordings that features were made of."""
        return sum(one.n_recordings for one in self.datasets)

    @property
    def recordings_by_source(self) -> dict[Source, int]:
        """Return the number of recordings of each source."""
        found: dict[Source, int] = {}
        for one in self.datasets:
            found[one.source] = found.get(one.source, 0) + one.n_recordings
        return found

    @property
    def left_out(self) -> int:
        """Return the number of recordings that were left out."""
        return sum(one.n_left_out for one in self.datasets)

    @property
    def flagged(self) -> int:
        """Return the number of recordings that are used, and not without remark."""
        return sum(one.n_flagged for one in self.datasets)

    def on(self, page: str) -> list[TaskSection]:
        """Return the sections of a page: those of its parts that stand on it."""
        found = []
        for section in self.sections:
            if parts := tuple(part for part in section.parts if part.page == page):
                found.append(replace(section, parts=parts))
        return found
