"""Specification of an experiment: all that the workflow must know to plan its jobs.

Light: Snakemake imports this.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ajgdata.experiments.division import Division
from ajgdata.types import FeatureKind, Kind, Strict


@dataclass(frozen=True, kw_only=True)
class ExperimentSpec:
    """Name, settings and inputs of an experiment, without the code that measures and draws it.

    `test_on` of the settings model, if it has one, names further data sets. `division` divides the
    measurement into parts and jobs. `check(settings, kind, features)` raises ValueError for
    settings that the task cannot have.

    Experiments `of_embedding` have their own page. Their settings are the declaration of the
    embedding; they are compared with the published value `paper` if a task of the data set is.
    """

    name: str
    title: str
    settings: type[Strict]
    check: Callable[[Any, Kind, FeatureKind], None] = lambda settings, kind, features: None
    division: Division = field(default_factory=Division)
    order: int = 50  #: place in the report
    kinds: tuple[Kind, ...] = ("regression", "classification")
    reads_recordings: bool = False
    renders: bool = False
    of_embedding: bool = False
    vectors: bool = False  #: whether it measures targets of several columns
    by_placement: bool = False  #: whether its folds can hold out one placement of every class
    augments: bool = False  #: whether its models are also trained on the copies of `augment`
    balances: bool = False  #: whether its training parts follow `balance` of the task
    covariates: bool = False  #: whether its models get the covariates of a task
    paper: str = ""

    @property
    def job_type(self) -> str:
        """Return the type of its job in `store.code_hash`: what its measurement is made from."""
        if self.renders:
            return "experiment on rendered sounds"
        return "experiment on recordings" if self.reads_recordings else "experiment"
