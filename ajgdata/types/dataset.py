"""The content of dataset.yaml."""

from __future__ import annotations

from enum import StrEnum
from itertools import takewhile
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from ajgdata.types.base import Distinct, Strict
from ajgdata.types.excitation import DEFAULT_EXCITATION, ExcitationSpec, PassiveRecording
from ajgdata.types.features import AnyFeature, FeatureSettings
from ajgdata.types.names import Name
from ajgdata.types.protocol import ACQUIRED_COLUMNS, GraspProtocol
from ajgdata.types.recipe import Recipe
from ajgdata.types.registry import Kind
from ajgdata.types.session import SESSION_COLUMNS, is_reserved
from ajgdata.types.settings import AudioSettings, Level, Target
from ajgdata.types.task_settings import TaskSettings, TrainingSettings
from ajgdata.types.tasks import Embedding, Task


class OnChange(StrEnum):
    """The treatment of imported recordings whose file or labels have changed in the folder."""

    KEEP = "keep"
    FILES = "files"
    LABELS = "labels"
    PRUNE = "prune"


class JoinSettings(Strict):
    """A table, e.g. of a robot, whose nearest row in time gives columns to each recording."""

    table: Annotated[str, Field(min_length=1)] = Field(description="table in the folder")
    time: Annotated[str, Field(min_length=1)] = Field(
        description="column of the table with the time: seconds, e.g. Unix, or ISO 8601"
    )
    recording_time: Annotated[str, Field(min_length=1)] = Field(
        description="column of `imports.table`, or group of `imports.pattern`, with the time of a "
        "recording; for segments of a file without a table: the time of the beginning of the file"
    )
    tolerance_s: float = Field(
        ge=0, description="largest difference in time of a recording and its row, in seconds"
    )
    latency_s: float = Field(
        0,
        allow_inf_nan=False,
        description="measured time in s by which the sound is late, which is subtracted from the "
        "times of recordings",
    )
    columns: Annotated[tuple[str, ...], Distinct] = Field(
        (), description="joined columns; none: all columns except the time"
    )
    utc_offset: Annotated[str, Field(pattern=r"^(Z|[+-]\d{2}:\d{2})?$")] = Field(
        "",
        description="offset of ISO 8601 times that state none, e.g. '+01:00' or Z; empty: they are "
        "an error",
    )


class SegmentSettings(Strict):
    """Rules for files with many sounds: each recording is a segment of a file."""

    labels: Literal["track", "table"] | None = Field(
        None,
        description="intervals with labels: `track`: Audacity's label track NAME.txt next to "
        "NAME.wav; `table`: columns `start` and `end` (in s) of `table`; null: none",
    )
    period_s: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = Field(
        None,
        description="length of the segments in s, into which each interval, or each file, is "
        "divided; null: an interval is one segment",
    )
    offset_s: float = Field(
        0,
        ge=0,
        allow_inf_nan=False,
        description="time from the beginning of an interval, or file, to its first segment, in s",
    )

    @model_validator(mode="after")
    def _has_rule(self) -> SegmentSettings:
        if self.labels is None and self.period_s is None:
            raise ValueError("give labels (--segments) or period_s (--period)")
        if self.offset_s and self.period_s is None:
            raise ValueError("offset_s (--offset) needs period_s (--period)")
        return self


class ImportSettings(Strict):
    """Rules for the import of a folder of recordings: the options of `ajgdata import`."""

    pattern: str = Field(
        "",
        description="'starter-kit' or a regular expression with named groups; with `table`: its "
        "groups are further columns",
    )
    table: str = Field(
        "",
        description="table of labels in the folder; with *, one table per folder, e.g. "
        "'*/labels.csv'",
    )
    file: str = Field(
        "",
        description="with `table`: path of a row's file, e.g. 'wav/{name}.wav'; if `table` has *: "
        "relative to the folder of its table",
    )
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
    join: JoinSettings | None = Field(
        None, description="table that is joined to the recordings by time; null: none"
    )
    segments: SegmentSettings | None = Field(
        None, description="rules for files with many sounds; null: a file is one recording"
    )

    @model_validator(mode="after")
    def _one_way(self) -> ImportSettings:
        if self.pattern == "starter-kit" and self.table:
            raise ValueError("pattern starter-kit and table exclude each other")
        if bool(self.table) != bool(self.file):
            raise ValueError("table and file (--file, e.g. 'audio/{name}.wav') need each other")
        if self.segments and self.segments.labels == "table" and not self.table:
            raise ValueError("segments of a table (--segments table) need table (--table)")
        is_divided = self.segments and (self.segments.labels == "track" or self.segments.period_s)
        if self.join and self.table and is_divided:
            raise ValueError(
                "join needs a time of each segment: use a pattern with the time of the file, or a"
                " table with a row per segment"
            )
        return self


#: Keys of a task that are not permitted for a kind of target.
NOT_FOR: dict[Kind, tuple[str, ...]] = {
    "classification": ("withhold", "period_deg"),
    "regression": ("classes", "min_groups", "balance", "by_confidence", "map"),
}
#: Keys of a task that are not permitted for a target that is a vector.
NOT_FOR_VECTORS = ("withhold", "period_deg")


class DatasetSpec(Strict):
    """The content of dataset.yaml."""

    format: Literal[1] = Field(1, description="version of the format of this file")
    name: Name = Field(description="name of the data set, which is the name of its folder")
    title: str = Field("", description="title of the data set in the report")
    description: str = Field("", description="description of the recordings and their purpose")
    licence: str = Field("not stated", description="licence of the recordings, e.g. CC-BY-4.0")
    authors: tuple[str, ...] = Field((), description="authors of the data set, for the citation")
    citation: str = Field("", description="text with which users cite the data set")
    version: str = Field(
        "1.0.0", pattern=r"^\d+\.\d+\.\d+$", description="version of the published data set"
    )
    url: str = Field("", description="web address of the data set")
    doi: str = Field(
        "",
        pattern=r"^(10\.\d{4,9}/\S+)?$",
        description="DOI of the published data set, e.g. 10.5281/zenodo.1234567",
    )
    audio: AudioSettings = Field(
        AudioSettings(), description="sample rate and channel of the recordings"
    )
    excitation: ExcitationSpec = Field(
        DEFAULT_EXCITATION,
        description="played sound, or passive recording; default: the one-second sweep of the "
        "paper",
    )
    features: AnyFeature = Field(
        FeatureSettings(), description="settings of the feature of a recording"
    )
    targets: dict[Name, Target] = Field(
        {}, description="label columns of recordings.csv that models can predict, by name"
    )
    tasks: dict[Name, Task] = Field(
        {}, description="tasks, each with a target and evaluation settings, by name"
    )
    embeddings: dict[Name, Embedding] = Field({}, description="contrastive embeddings, by name")
    placebo: Annotated[tuple[Name, ...], Distinct] = Field(
        (),
        description="names of one physical object that was recorded under all these names; the "
        "score for these names is the real chance level; tasks exclude these recordings",
    )
    final_models: bool = Field(
        True,
        description="train models for new recordings; false for a data set that only tests a "
        "hypothesis",
    )
    level: Level | None = Field(
        None, description="value of a quantity in which data sets with the same task differ"
    )
    recipe: Recipe | None = Field(
        None, description="plan of the sessions with the virtual gripper; null: none"
    )
    protocol: GraspProtocol | None = Field(
        None,
        description="plan of sessions with a real gripper, for `ajgdata record`; null: none",
    )
    imports: ImportSettings = Field(
        ImportSettings(), description="default options of `ajgdata import` for this data set"
    )

    @model_validator(mode="after")
    def _valid_targets(self) -> DatasetSpec:
        for name in {**self.targets, **self.label_targets}:
            if is_reserved(name) and name not in ("object", *SESSION_COLUMNS):
                raise ValueError(f"target {name} has the name of a standard column")
            if self.protocol and name in ACQUIRED_COLUMNS:
                raise ValueError(f"target {name} has the name of a column of acquisition")
        for plan in (self.recipe, self.protocol):
            for item in plan.objects if plan else ():
                unknown = set(item.targets) - set(self.label_targets)
                if unknown:
                    raise ValueError(f"object {item.name}: unknown targets {sorted(unknown)}")
        return self

    @model_validator(mode="after")
    def _valid_vectors(self) -> DatasetSpec:
        for name, target in self.targets.items():
            for column in target.columns:
                declared = self.targets.get(column, target.axis)
                if declared.columns or declared.kind != "regression":
                    raise ValueError(f"target {name}: column {column} is not a target of numbers")
                if (declared.unit, declared.missing) != (target.unit, target.missing):
                    raise ValueError(f"target {name}: {column} has another unit or other `missing`")
        return self

    @model_validator(mode="after")
    def _rate_allows_feature(self) -> DatasetSpec:
        self.features.check(self.audio)
        return self

    @model_validator(mode="after")
    def _table_has_no_sound(self) -> DatasetSpec:
        if self.features.needs_waveform:
            return self
        plans = [name for name in ("recipe", "protocol") if getattr(self, name) is not None]
        if plans:
            raise ValueError(
                f"features.kind is {self.features.kind}, which has no recordings: remove {plans[0]}"
            )
        for name, task in self.tasks.items():
            if task.augment is not None:
                raise ValueError(
                    f"task {name}: augment changes recordings, and features.kind "
                    f"{self.features.kind} has none: remove augment"
                )
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
    def _sound_below_half_the_rate(self) -> DatasetSpec:
        # The default sweep is exempt: it is not played if recordings are imported.
        if "excitation" not in self.model_fields_set:
            return self
        high_hz = getattr(self.excitation, "high_hz", None)
        rate_hz = self.audio.sample_rate_hz
        if high_hz is not None and high_hz >= rate_hz / 2:
            raise ValueError(
                f"excitation.high_hz {high_hz:g} is not below half the rate of {rate_hz} Hz"
            )
        return self

    @model_validator(mode="after")
    def _recipe_has_a_played_sound(self) -> DatasetSpec:
        if self.recipe is not None and isinstance(self.excitation, PassiveRecording):
            raise ValueError(
                "excitation.kind is none, but the virtual gripper records only a played sound: use "
                "another kind, or remove the recipe"
            )
        return self

    @model_validator(mode="after")
    def _valid_tasks(self) -> DatasetSpec:
        for name, task in self.tasks.items():
            if task.target not in self.targets:
                raise ValueError(f"task {name}: target {task.target!r} is not among the targets")
            target = self.targets[task.target]
            for key in NOT_FOR[target.kind]:
                if getattr(task, key):
                    raise ValueError(f"task {name}: {key} is not for a {target.kind}")
            for key in NOT_FOR_VECTORS:
                if target.columns and getattr(task, key):
                    raise ValueError(f"task {name}: {key} is not for a target with columns")
            known = sorted({task.target, *target.columns} & set(task.covariates))
            if known:
                raise ValueError(f"task {name}: covariate {known[0]} is the target itself")
        return self

    @model_validator(mode="after")
    def _names_of_distinct_files(self) -> DatasetSpec:
        # Results are in folders with the names of tasks and embeddings.
        names: dict[str, str] = {}
        for name in (*self.tasks, *self.embeddings):
            other = names.setdefault(name.casefold(), name)
            if other != name:
                raise ValueError(
                    f"{other} and {name} would have the same files on macOS and Windows: rename one"
                )
        return self

    @model_validator(mode="after")
    def _valid_embeddings(self) -> DatasetSpec:
        for name in sorted(self.embeddings):
            if name in self.tasks:
                raise ValueError(f"{name} is both a task and an embedding: rename one of them")
        for name, embedding in self.embeddings.items():
            columns = [embedding.target]
            if embedding.category:
                columns.append(embedding.category)
            for column in columns:
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
        # The results of a task contain only fields that are set.
        added: dict[str, Any] = {}
        if target.columns:
            added["axes"] = target.columns
        for key in ("augment", "balance", "by_confidence", "covariates", "map"):
            if getattr(declared, key):
                added[key] = getattr(declared, key)
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
            **added,
        )

    @property
    def label_targets(self) -> dict[str, Target]:
        """The target of each label column. A target that is a vector has several columns."""
        axes = {
            column: target.axis for target in self.targets.values() for column in target.columns
        }
        own = {name: target for name, target in self.targets.items() if not target.columns}
        return {**axes, **own}

    @property
    def noise_sets(self) -> dict[str, str]:
        """The data set whose recordings are the noise of a task, by the name of the task."""
        augmented = {name: task.augment for name, task in self.tasks.items() if task.augment}
        return {name: augment.noise_set for name, augment in augmented.items() if augment.noise_set}

    @property
    def kinds(self) -> dict[str, Kind]:
        """The kind of each target, by name."""
        return {name: target.kind for name, target in self.targets.items()}

    def training(self, task: str) -> TrainingSettings:
        """Return the settings of a task that its final models depend on."""
        settings = self.task_settings(task)
        return TrainingSettings.model_validate(
            settings.model_dump(include=set(TrainingSettings.model_fields))
        )

    def default_model(self, task: str) -> str:
        """Return the model of a task that commands use if none is named: the CNN if the task has
        it or has no model, else its first model."""
        models = self.tasks[task].models if task in self.tasks else ()
        return "cnn" if "cnn" in models or not models else models[0]

    def trained_models(self) -> list[tuple[str, str]]:
        """Return the final models of a run as (task, model); none if `final_models` is false."""
        if not self.final_models:
            return []
        return [(name, model) for name, task in self.tasks.items() for model in task.models]

    def equal_training(self, task: str, model: str) -> str:
        """Return the first task before `task` with `model` and equal `training`; "" for none."""
        settings = self.training(task)
        for earlier in takewhile(lambda name: name != task, self.tasks):
            if model in self.tasks[earlier].models and self.training(earlier) == settings:
                return earlier
        return ""
