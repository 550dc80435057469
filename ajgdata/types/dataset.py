"""dataset.yaml: what a data set is."""

from __future__ import annotations

import math
from typing import Any

from pydantic import Field, ValidationError, model_validator

from ajgdata.types.base import Name, Strict
from ajgdata.types.embedding import Embedding
from ajgdata.types.recipe import Recipe
from ajgdata.types.registry import Kind
from ajgdata.types.session import SESSION_COLUMNS, is_reserved
from ajgdata.types.settings import AudioSettings, FeatureSettings, Level, Target
from ajgdata.types.tasks import Task


class ImportSettings(Strict):
    """Rules by which a folder of recordings becomes sessions; the options of `ajgdata import`."""

    pattern: str = Field("", description="'starter-kit' or a regular expression with named groups")
    table: str = Field("", description="CSV of labels inside the folder, instead of a pattern")
    file: str = Field("", description="with table: path of a row's file, e.g. 'wav/{name}.wav'")
    grasp: str = Field("", description="template of grasp_id, e.g. '{stone}'; default: the file")
    object: str = Field("", description="template of object, e.g. '{label}'; default: the label")
    session: str = Field("", description="template of the session; default: the folder")

    @model_validator(mode="after")
    def _one_way(self) -> ImportSettings:
        if self.pattern and self.table:
            raise ValueError("give pattern or table, not both")
        if bool(self.table) != bool(self.file):
            raise ValueError("table needs file (a template such as 'audio/{name}.wav')")
        return self


TRAINING = ("target", "kind", "unit", "groups", "period_deg")


class DatasetSpec(Strict):
    """dataset.yaml: what a data set is."""

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
    level: Level | None = Field(
        None, description="where it stands among the data sets that a task is tested on"
    )
    recipe: Recipe | None = Field(
        None, description="how the virtual gripper makes its sessions; null: they are imported"
    )
    imports: ImportSettings = Field(
        ImportSettings(), description="how `ajgdata import` reads a folder for it"
    )

    @model_validator(mode="after")
    def _consistent(self) -> DatasetSpec:
        for name in self.targets:
            if is_reserved(name) and name not in ("object", *SESSION_COLUMNS):
                raise ValueError(f"target {name} has the name of a standard column")
        if self.recipe:
            for made in self.recipe.objects:
                if unknown := set(made.targets) - set(self.targets):
                    raise ValueError(f"object {made.name}: unknown targets {sorted(unknown)}")
        if self.features.band_hz:
            bins_per_hz = self.features.window / self.audio.sample_rate_hz
            low, high = (edge * bins_per_hz for edge in self.features.band_hz)
            if math.ceil(low) > min(math.floor(high), self.features.window // 2):
                raise ValueError(f"features.band_hz {self.features.band_hz} holds no bin")
        return self

    @model_validator(mode="after")
    def _tasks_of_targets(self) -> DatasetSpec:
        for name, task in self.tasks.items():
            if task.target not in self.targets:
                raise ValueError(f"task {name}: target {task.target!r} is not among the targets")
            if self.targets[task.target].kind == "classification":
                for key in ("withhold", "period_deg"):
                    if getattr(task, key):
                        raise ValueError(f"task {name}: {key} is for a number, not for classes")
            else:
                for key in ("sorting", "energy"):
                    if getattr(task, key):
                        raise ValueError(f"task {name}: {key} is for classes, not for a number")
            measured = self.features.quantity, self.features.normalisation
            if task.energy and measured != ("power", "none"):
                raise ValueError(
                    f"task {name}: energy needs features.quantity power and "
                    "features.normalisation none"
                )
        return self

    @model_validator(mode="after")
    def _embeddings_of_targets(self) -> DatasetSpec:
        for name, one in self.embeddings.items():
            for column in filter(None, (one.target, one.category)):
                if column not in self.targets:
                    raise ValueError(f"embedding {name}: {column!r} is not among the targets")
                if self.targets[column].kind != "classification":
                    raise ValueError(f"embedding {name}: {column!r} is a number, not a class")
        return self

    @model_validator(mode="after")
    def _feature_changes_fit(self) -> DatasetSpec:
        for name in self.tasks:
            try:
                self.feature_variants(name)
            except ValidationError as error:
                message = error.errors()[0]["msg"].removeprefix("Value error, ")
                raise ValueError(f"task {name}: stft.settings: {message}") from None
        return self

    def feature_variants(self, task: str) -> list[FeatureSettings]:
        """Return the feature settings whose error and run time a task compares, its own first."""
        asked = self.tasks[task].stft
        own = self.features.model_dump()
        changes = [one.model_dump(exclude_none=True) for one in asked.settings] if asked else []
        return [FeatureSettings(**(own | change)) for change in ({}, *changes)]

    def evaluation(self, task: str) -> dict[str, Any]:
        """Return what an evaluation of `task` must know, by name."""
        settings = self.tasks[task]
        target = self.targets[settings.target]
        return {
            "target": settings.target,
            "kind": target.kind,
            "unit": target.unit,
            "groups": settings.groups,
            "folds": settings.folds,
            "compare_random": settings.compare_random,
            "withhold": list(settings.withhold),
            "period_deg": settings.period_deg,
            "test_on": list(settings.test_on),
            "silent": list(settings.silent),
        }

    def experiment(self, task: str) -> dict[str, Any]:
        """Return what the further experiments on `task` must know, by name."""
        left_out = ("compare_random", "test_on", "silent")
        return {k: v for k, v in self.evaluation(task).items() if k not in left_out}

    def labelled(self, task: str) -> dict[str, Any]:
        """Return what must be known of `task` where nothing is trained, by name."""
        wanted = ("target", "kind", "unit", "groups")
        return {k: v for k, v in self.evaluation(task).items() if k in wanted}

    @property
    def kinds(self) -> dict[str, Kind]:
        """The kind of each target, by name."""
        return {name: target.kind for name, target in self.targets.items()}

    def training(self, task: str) -> dict[str, Any]:
        """Return what training a model for `task` must know, by name."""
        return {k: v for k, v in self.evaluation(task).items() if k in TRAINING}
