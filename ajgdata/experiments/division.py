"""Division of an experiment into parts that are measured one by one, and into jobs.

Light: Snakemake imports this.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ajgdata.types.registry import PLAIN_MODELS

#: Names of jobs of several models.
PLAIN_JOB = "plain"
ALL_JOB = "all"


@dataclass(frozen=True)
class MeasuredPart:
    """One measurement of an experiment on a task: of a model, of a file of variants, or ("") of
    everything together.

    `job` is the name of its job, which several parts can share. `title` names the part for people
    if it is no model. Only `snakemake everything` measures a part that `is_late`.
    """

    name: str
    job: str
    title: str = ""
    is_late: bool = False


#: The part of an experiment that measures everything together.
TOGETHER = MeasuredPart("", ALL_JOB)


@dataclass(frozen=True)
class Division:
    """Division of an experiment into measurements. By default, it measures everything together."""

    def parts(self, settings: Any) -> list[MeasuredPart]:
        """Return the parts of an experiment with these settings, in the order of the report."""
        return [TOGETHER]

    def only(self, settings: Any, parts: Sequence[str]) -> Any:
        """Return the settings of some parts alone, by name."""
        return settings


@dataclass(frozen=True)
class ByModel(Division):
    """One measurement for each of the `models`. All plain models share a job."""

    def parts(self, settings: Any) -> list[MeasuredPart]:
        """Return a part for each model."""
        return [
            MeasuredPart(model, PLAIN_JOB if model in PLAIN_MODELS else model)
            for model in settings.models
        ]

    def only(self, settings: Any, parts: Sequence[str]) -> Any:
        """Return the settings with some of the models."""
        return settings.model_copy(update={"models": tuple(parts)})


@dataclass(frozen=True)
class ByFile(Division):
    """One measurement for each file of variants, in a job of its own."""

    def parts(self, settings: Any) -> list[MeasuredPart]:
        """Return a part for each file."""
        return [
            MeasuredPart(name, name, title=file.title, is_late=file.explains_differences)
            for name, file in settings.files.items()
        ]

    def only(self, settings: Any, parts: Sequence[str]) -> Any:
        """Return the settings with some of the files."""
        return settings.model_copy(update={"files": {name: settings.files[name] for name in parts}})
