"""Data set, task and result that the opening picture shows. Light: Snakemake imports this."""

from __future__ import annotations

from collections.abc import Mapping

from ajgdata.types import CROSS_VALIDATION, DatasetSpec
from ajgdata.types.registry import PAPER_MODEL

#: Name of the task and of its target. A picture can show its classes, which are objects.
OBJECT = "object"
#: Experiment and model whose predictions are shown.
SHOWN_RESULT = (CROSS_VALIDATION, PAPER_MODEL)


def subject_of(specs: Mapping[str, DatasetSpec]) -> str:
    """Return the first simulated data set with the paper's model on a task `object`, or ""."""
    for name, spec in specs.items():
        task = spec.tasks.get(OBJECT)
        if spec.recipe and task and task.target == OBJECT and PAPER_MODEL in task.models:
            return name
    return ""
