"""Settings of a task or an embedding, complete with the kind and unit of its target.

`DatasetSpec.task_settings` makes them from dataset.yaml. Jobs receive them as plain values.
"""

from __future__ import annotations

from ajgdata.types.base import Strict
from ajgdata.types.registry import Kind


class TrainingSettings(Strict):
    """The recordings that a model is trained on, and the label that it predicts.

    For the keys of dataset.yaml see `Task`. `kind` and `unit` are those of the target.
    `placebo_objects` are one object under several names; no model is trained on them.
    """

    target: str
    kind: Kind
    unit: str
    groups: str
    classes: tuple[str, ...] = ()
    min_groups: int = 0
    period_deg: float | None = None
    placebo_objects: tuple[str, ...] = ()


class TaskSettings(TrainingSettings):
    """All that a measurement must know of a task, or of an embedding.

    `kinds` are those of all targets of the data set, by name; only embeddings use them.
    """

    folds: int
    withhold: tuple[float, ...] = ()
    kinds: dict[str, Kind] = {}


class TaskTraining(Strict):
    """The models that are trained for a task."""

    models: tuple[str, ...]
    settings: TrainingSettings
