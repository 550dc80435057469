"""Settings of a task or an embedding, together with the kind and unit of its target.

`DatasetSpec.task_settings` creates them from dataset.yaml. Jobs receive them as plain values.
"""

from __future__ import annotations

from ajgdata.types.augment import Augment
from ajgdata.types.base import Strict
from ajgdata.types.registry import Kind


class TrainingSettings(Strict):
    """The recordings that a model is trained on, and the label that it predicts.

    `types.tasks.Task` describes the fields that are keys of dataset.yaml.
    """

    target: str
    kind: Kind  #: kind of the target
    unit: str  #: unit of the target
    groups: str
    classes: tuple[str, ...] = ()
    min_groups: int = 0
    period_deg: float | None = None
    axes: tuple[str, ...] = ()  #: columns of a target that is a vector; empty for one column
    placebo_objects: tuple[str, ...] = ()  #: `placebo` of the data set: no model is trained on them
    augment: Augment | None = None
    balance: bool = False
    covariates: tuple[str, ...] = ()  #: columns of numbers that models get besides the feature


class TaskSettings(TrainingSettings):
    """The settings of a task, or of an embedding, that a measurement uses."""

    folds: int
    withhold: tuple[float, ...] = ()
    by_confidence: bool = False
    map: tuple[str, str] | None = None
    kinds: dict[str, Kind] = {}  #: kind of every target of the data set by name, for embeddings
