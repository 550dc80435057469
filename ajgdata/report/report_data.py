"""Content of a report: plain values, figures that are not drawn yet, and text.

The report knows a list of experiments and none by name: what one has to show is in its `Part`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ajgdata.report.blocks import Illustration, ResultRow, ShownTable
from ajgdata.report.comparison import PaperComparison
from ajgdata.report.format import Source
from ajgdata.report.job_times import Stages
from ajgdata.report.paper import PaperFigure
from ajgdata.types import FeatureSettings, Finding


@dataclass(frozen=True, eq=False)
class Spectra:
    """Mean feature per class or target bin: frequency_hz (f,), mean (n, f), n labels."""

    frequency_hz: np.ndarray
    labels: tuple[str, ...]
    mean: np.ndarray
    grouping: str = "class"

    def __post_init__(self) -> None:
        expected = (len(self.labels), np.size(self.frequency_hz))
        if np.ndim(self.frequency_hz) != 1 or np.shape(self.mean) != expected:
            raise ValueError(f"spectra must be (labels, frequencies) = {expected}")


@dataclass(frozen=True)
class Provenance:
    """Which code and which inputs made a data set's results."""

    version: str
    commit: str
    config_hash: str
    inputs_hash: str


@dataclass(frozen=True, eq=False)
class DatasetSummary:
    """One data set. `facts` are further lines of provenance, e.g. the solver's `dx` in mm."""

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
    facts: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Part:
    """One experiment on one task: rows of the main table, figures, tables.

    `summary` is said first; `text` (Markdown) says what is asked, how it is made and how its figure
    is read.
    """

    experiment: str
    title: str
    summary: str
    text: str
    rows: tuple[ResultRow, ...]
    figures: tuple[Illustration, ...]
    tables: tuple[ShownTable, ...]


@dataclass(frozen=True)
class TaskSection:
    """A task (or an embedding) of a data set with its experiments, in the order of the report.

    `explorer` is a link to the page on which its recordings are seen and heard, if there is one.
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
    comparisons: tuple[PaperComparison, ...] = ()
    across: tuple[Illustration, ...] = ()  #: figures of all tasks together
    skipped: tuple[Skipped, ...] = ()
    stages: Stages | None = None
    paper: tuple[PaperFigure, ...] = ()  #: all that the paper reports, whether it is here or not

    def __post_init__(self) -> None:
        sources = {d.name: d.source for d in self.datasets}
        if len(sources) != len(self.datasets):
            raise ValueError("two data sets of the report share a name")
        seen = set()
        for section in self.sections:
            where = f"{section.dataset}/{section.task}"
            if section.dataset not in sources:
                raise ValueError(f"{where}: the report has no data set {section.dataset}")
            if section.source != sources[section.dataset]:
                raise ValueError(f"{where}: {section.source}, but its data set is not")
            if where in seen:
                raise ValueError(f"{where} occurs twice")
            seen.add(where)

    @property
    def absent(self) -> list[PaperFigure]:
        """Return what the paper reports and this report does not."""
        found = {row.paper.id for row in self.comparisons}
        return [figure for figure in self.paper if figure.id not in found]

    def of(self, dataset: str) -> list[TaskSection]:
        """Return the sections of a data set."""
        return [section for section in self.sections if section.dataset == dataset]
