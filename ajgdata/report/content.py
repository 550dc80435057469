"""What a report is made of: plain values and arrays, checked on creation.

The order of arguments is the order in which a reader asks: what is it, how good, at what cost,
against what. What one model is worth on one task is in `results`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ajgdata.report.comparison import Reason
from ajgdata.report.embedded import Embedded
from ajgdata.report.format import Score, Source
from ajgdata.report.further import (
    ChanceTest,
    Curves,
    Energies,
    Experiments,
    Further,
    SortingResult,
    StftResult,
    Transfers,
)
from ajgdata.report.job_times import Stages
from ajgdata.report.paper import PaperFigure
from ajgdata.report.results import (
    HEADLINE,
    Cost,
    ElsewhereResult,
    PartResult,
    Predictions,
    SilentResult,
    SkippedTask,
    TaskResult,
    ValueErrors,
    pareto_front,
)
from ajgdata.types import FeatureSettings, Finding

__all__ = [
    "HEADLINE",
    "Cost",
    "DatasetSummary",
    "ElsewhereResult",
    "PaperFigure",
    "PartResult",
    "Predictions",
    "Provenance",
    "Report",
    "Score",
    "SilentResult",
    "SkippedTask",
    "Source",
    "Spectra",
    "TaskResult",
    "ValueErrors",
    "pareto_front",
]


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


@dataclass(frozen=True, eq=False)
class Report:
    """Everything on the page, in the order in which it is shown."""

    title: str
    version: str
    commit: str
    datasets: tuple[DatasetSummary, ...]
    results: tuple[TaskResult, ...]
    skipped: tuple[SkippedTask, ...] = ()
    curves: tuple[Curves, ...] = ()
    tests: tuple[ChanceTest, ...] = ()
    sorting: tuple[SortingResult, ...] = ()
    energies: tuple[Energies, ...] = ()
    transfers: tuple[Transfers, ...] = ()
    stfts: tuple[StftResult, ...] = ()
    embeddings: tuple[Embedded, ...] = ()
    stages: Stages | None = None
    paper: tuple[PaperFigure, ...] = ()  #: all that the paper reports, whether it is here or not
    reasons: tuple[Reason, ...] = ()

    def __post_init__(self) -> None:
        sources = {d.name: d.source for d in self.datasets}
        if len(sources) != len(self.datasets):
            raise ValueError("two data sets of the report share a name")
        seen = set()
        for r in self.results:
            if r.dataset not in sources:
                raise ValueError(f"{r.where}: the report has no data set {r.dataset}")
            if r.source != sources[r.dataset]:
                raise ValueError(f"{r.where}: {r.source}, but its data set is not")
            if r.where in seen:
                raise ValueError(f"{r.where} occurs twice")
            seen.add(r.where)

    def experiments(self, dataset: str, task: str) -> Experiments:
        """What else was made of a task."""

        def of_task(one: Further) -> bool:
            return (one.about.dataset, one.about.task) == (dataset, task)

        return Experiments(
            tuple(filter(of_task, self.curves)),
            tuple(filter(of_task, self.tests)),
            tuple(filter(of_task, self.sorting)),
            tuple(filter(of_task, self.energies)),
            tuple(filter(of_task, self.transfers)),
            tuple(filter(of_task, self.stfts)),
        )

    def without_models(self, dataset: str) -> list[str]:
        """Tasks of a data set of which no model was evaluated, but something else made."""
        made: tuple[Further, ...] = (
            *self.curves,
            *self.tests,
            *self.sorting,
            *self.energies,
            *self.transfers,
            *self.stfts,
        )
        tasks = dict.fromkeys(one.about.task for one in made if one.about.dataset == dataset)
        evaluated = {result.task for result in self.results if result.dataset == dataset}
        return [task for task in tasks if task not in evaluated]

    def leveled(self) -> list[tuple[TaskResult, ...]]:
        """Tasks whose models were tested at three levels or more, their own included."""
        return [task for task in self.tasks() if len(task[0].levels()) > 2]

    def tasks(self, dataset: str | None = None) -> list[tuple[TaskResult, ...]]:
        """Results by task, the models of one task together, in order of first appearance."""
        grouped: dict[tuple[str, str], list[TaskResult]] = {}
        for r in self.results:
            if dataset in (None, r.dataset):
                grouped.setdefault((r.dataset, r.task), []).append(r)
        return [tuple(models) for models in grouped.values()]

    def compared(self) -> list[TaskResult]:
        """Results that were also evaluated on a split that ignores the groups."""
        return [r for r in self.results if r.random_split is not None]
