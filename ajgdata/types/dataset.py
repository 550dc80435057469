"""dataset.yaml: what a data set is."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Annotated, Literal

from pydantic import Field, model_validator

from ajgdata.types.base import Distinct, Name, Strict
from ajgdata.types.excitation import DEFAULT_EXCITATION, ExcitationSpec
from ajgdata.types.protocol import ACQUIRED_COLUMNS, GraspProtocol
from ajgdata.types.recipe import Recipe
from ajgdata.types.registry import Kind
from ajgdata.types.session import SESSION_COLUMNS, is_reserved
from ajgdata.types.settings import AudioSettings, FeatureSettings, Level, Target
from ajgdata.types.task_settings import TaskSettings, TaskTraining, TrainingSettings
from ajgdata.types.tasks import Embedding, Task


class OnChange(StrEnum):
    """What an import does with recordings that differ from the folder."""

    KEEP = "keep"
    FILES = "files"
    LABELS = "labels"
    PRUNE = "prune"


class ImportSettings(Strict):
    """Rules by which a folder of recordings becomes sessions; the options of `ajgdata import`."""

    pattern: str = Field("", description="'starter-kit' or a regular expression with named groups")
    table: str = Field("", description="table of labels inside the folder, instead of a pattern")
    file: str = Field("", description="with table: path of a row's file, e.g. 'wav/{name}.wav'")
    grasp: str = Field(
        "",
        description="template of grasp_id, e.g. '{stone}'; default: the column or group "
        "`grasp_id`, else object and `grasp`, else the file",
    )
    placement: str = Field(
        "",
        description="template of placement_id, e.g. '{object}/{round}'; default: the column or "
        "group `placement_id`, else object and `placement`, else unknown",
    )
    object: str = Field("", description="template of object, e.g. '{label}'; default: the label")
    session: str = Field("", description="template of the session; default: the folder")

    @model_validator(mode="after")
    def _one_way(self) -> ImportSettings:
        if self.pattern and self.table:
            raise ValueError("give pattern or table, not both")
        if bool(self.table) != bool(self.file):
            raise ValueError("table and file (--file, e.g. 'audio/{name}.wav') need each other")
        return self


#: Keys of a task that its kind has no use for.
NOT_FOR: dict[Kind, tuple[str, ...]] = {
    "classification": ("withhold", "period_deg"),
    "regression": ("classes", "min_groups"),
}


class DatasetSpec(Strict):
    """dataset.yaml: what a data set is."""

    format: Literal[1] = Field(1, description="version of the format of this file")
    name: Name = Field(description="its folder's name")
    title: str = Field("", description="a few words, for people")
    description: str = Field("", description="what was recorded, how and why, for people")
    licence: str = Field("not stated", description="under which others may use the recordings")
    authors: tuple[str, ...] = Field((), description="who made it, for the citation")
    citation: str = Field("", description="how to cite it")
    version: str = Field(
        "1.0.0", pattern=r"^\d+\.\d+\.\d+$", description="version of what is published"
    )
    url: str = Field("", description="where it comes from")
    audio: AudioSettings = Field(AudioSettings(), description="what its recordings are")
    excitation: ExcitationSpec = Field(
        DEFAULT_EXCITATION, description="what is played; default: the paper's one-second sweep"
    )
    features: FeatureSettings = Field(
        FeatureSettings(), description="how a recording becomes a spectrum"
    )
    targets: dict[Name, Target] = Field(
        {}, description="columns of recordings.csv that can be learnt, by name"
    )
    tasks: dict[Name, Task] = Field({}, description="what is learnt and evaluated, by name")
    embeddings: dict[Name, Embedding] = Field(
        {}, description="what is embedded by contrast, by name"
    )
    placebo: Annotated[tuple[Name, ...], Distinct] = Field(
        (),
        description="objects that are one physical object, recorded under each of the names: the "
        "score of distinguishing them is the chance level; no task uses them",
    )
    final_models: bool = Field(
        True, description="train models for new recordings; false if it only tests a hypothesis"
    )
    level: Level | None = Field(
        None, description="where it stands among the data sets that a task is tested on"
    )
    recipe: Recipe | None = Field(
        None, description="how the virtual gripper makes its sessions; null: they are imported"
    )
    protocol: GraspProtocol | None = Field(
        None, description="how a person or a robot records it; the workflow never does"
    )
    imports: ImportSettings = Field(
        ImportSettings(), description="how `ajgdata import` reads a folder for it"
    )

    @model_validator(mode="after")
    def _consistent(self) -> DatasetSpec:
        for name in self.targets:
            if is_reserved(name) and name not in ("object", *SESSION_COLUMNS):
                raise ValueError(f"target {name} has the name of a standard column")
        sources = (self.recipe, self.protocol)
        for item in [item for declared in sources if declared for item in declared.objects]:
            if unknown := set(item.targets) - set(self.targets):
                raise ValueError(f"object {item.name}: unknown targets {sorted(unknown)}")
        if self.protocol and (taken := set(self.targets) & set(ACQUIRED_COLUMNS)):
            raise ValueError(f"target {min(taken)} has the name of a column of acquisition")
        if self.features.band_hz:
            bins_per_hz = self.features.window / self.audio.sample_rate_hz
            low, high = (edge * bins_per_hz for edge in self.features.band_hz)
            if math.ceil(low) > min(math.floor(high), self.features.window // 2):
                raise ValueError(f"features.band_hz {self.features.band_hz} holds no bin")
        return self

    @model_validator(mode="after")
    def _no_embedding_of_placebos(self) -> DatasetSpec:
        if self.placebo and self.embeddings:
            raise ValueError(
                "placebo: embeddings would learn its names as different objects; use a data set "
                "without `embeddings`"
            )
        return self

    @model_validator(mode="after")
    def _can_be_played(self) -> DatasetSpec:
        high, rate = getattr(self.excitation, "high_hz", 0.0), self.audio.sample_rate_hz
        if "excitation" in self.model_fields_set and high >= rate / 2:
            raise ValueError(f"excitation.high_hz {high:g} is not below half the rate of {rate} Hz")
        return self

    @model_validator(mode="after")
    def _tasks_of_targets(self) -> DatasetSpec:
        for name, task in self.tasks.items():
            if task.target not in self.targets:
                raise ValueError(f"task {name}: target {task.target!r} is not among the targets")
            kind = self.targets[task.target].kind
            for key in NOT_FOR[kind]:
                if getattr(task, key):
                    raise ValueError(f"task {name}: {key} is not for a {kind}")
        return self

    @model_validator(mode="after")
    def _embeddings_of_targets(self) -> DatasetSpec:
        if both := sorted({*self.tasks} & {*self.embeddings}):
            raise ValueError(f"{both[0]} is both a task and an embedding: rename one of them")
        for name, embedding in self.embeddings.items():
            for column in filter(None, (embedding.target, embedding.category)):
                if column not in self.targets:
                    raise ValueError(f"embedding {name}: {column!r} is not among the targets")
                if self.targets[column].kind != "classification":
                    raise ValueError(f"embedding {name}: {column!r} is a number, not a class")
        return self

    def task_settings(self, task: str) -> TaskSettings:
        """Return the settings of a task, or of the embedding of that name."""
        if task in self.embeddings:
            embedding = self.embeddings[task]
            return TaskSettings(
                target=embedding.target,
                kind="classification",
                unit="",
                groups=embedding.groups,
                folds=embedding.folds,
                kinds=self.kinds,
            )
        declared = self.tasks[task]
        target = self.targets[declared.target]
        return TaskSettings(
            target=declared.target,
            kind=target.kind,
            unit=target.unit,
            groups=declared.groups,
            folds=declared.folds,
            withhold=declared.withhold,
            classes=declared.classes,
            min_groups=declared.min_groups,
            period_deg=declared.period_deg,
            placebo_objects=self.placebo,
        )

    @property
    def kinds(self) -> dict[str, Kind]:
        """The kind of each target, by name."""
        return {name: target.kind for name, target in self.targets.items()}

    def training(self, task: str) -> TrainingSettings:
        """Return the settings of a task that decide what its models are trained on."""
        settings = self.task_settings(task)
        return TrainingSettings.model_validate(
            settings.model_dump(include=set(TrainingSettings.model_fields))
        )

    def trainings(self) -> dict[str, TaskTraining]:
        """Return the training of the models of each task, by task."""
        return {
            name: TaskTraining(models=task.models, settings=self.training(name))
            for name, task in self.tasks.items()
        }
