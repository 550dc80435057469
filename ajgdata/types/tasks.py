"""Tasks and embeddings of a data set: targets, splits, pair rules, and additional experiments."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, JsonValue, model_validator

from ajgdata.types.base import Distinct, ModelName, Name, Strict

#: The experiment whose settings are the task's own.
CROSS_VALIDATION = "cross_validation"


class CrossValidationSettings(Strict):
    """Cross-validation of models on a task. The keys are those of the task itself."""

    models: Annotated[tuple[ModelName, ...], Distinct] = Field(
        ("cnn", "linear", "knn"), description="models that are trained and evaluated"
    )
    compare_random: bool = Field(
        False, description="also evaluate a split that ignores groups, to show its optimistic bias"
    )
    compare_sessions: bool | tuple[ModelName, ...] = Field(
        True,
        description="also evaluate held-out sessions, if there are two or more: all models, none, "
        "or the named ones",
    )
    test_on: tuple[Name, ...] = Field(
        (),
        description="data sets whose recordings the folds' models are tested on as well, e.g. the "
        "same grasps under noise; of a grasp that both hold, only the fold that holds it out",
    )
    placebo: Name | None = Field(
        None,
        description="data set of one object under the names of the classes, recorded by the same "
        "protocol: its score is the chance level; null: `placebo` of the data set, if it has any",
    )

    def compares_sessions(self, model: str) -> bool:
        """Return whether a model is also evaluated on held-out sessions."""
        if isinstance(self.compare_sessions, bool):
            return self.compare_sessions
        return model in self.compare_sessions


class Task(CrossValidationSettings):
    """Target + split: one row of the report for each model."""

    target: str = Field(description="which of the targets")
    classes: Annotated[tuple[str, ...], Distinct] = Field(
        (), description="classes that the task is about, at least two; default: all of the target"
    )
    groups: str = Field(
        "grasp_id",
        description="column whose values never straddle folds: grasp_id, placement_id (each fold "
        "holds out one placement of every class), session_id, or a label",
    )
    folds: int = Field(5, ge=2, description="of the cross-validation; at most one a group")
    withhold: Annotated[tuple[float, ...], Distinct] = Field(
        (), description="target values that no fold trains on; every fold's model is tested on them"
    )
    period_deg: float | None = Field(
        None,
        gt=0,
        description="the target repeats after this, as a bar's angle after 180: models learn sine "
        "and cosine, errors are the shortest way round",
    )
    experiments: dict[Name, dict[str, JsonValue]] = Field(
        {}, description="what else is measured of it, by name of the experiment, with its settings"
    )
    min_groups: int = Field(
        0, ge=0, description="classes with fewer groups are left out, and named in the report"
    )
    optional: bool = Field(False, description="missing data are reported, and the run succeeds")
    page: Name | None = Field(
        None, description="page of the report that shows its results; default: the data set's"
    )
    paper: str | dict[str, str] = Field(
        "",
        description="published values to compare with, e.g. ycb, or by part (known, "
        "known_by_recording with compare_random, unknown, overall, a data set of test_on, the "
        "name of an experiment, or one of its values, e.g. sorting.correct): "
        "{known: size-known, size_80dba: noise}",
    )

    @property
    def requested(self) -> dict[str, dict[str, Any]]:
        """Return every experiment that is asked for by name, with its settings as they are given.

        Cross-validation, which most tasks want, has its settings in the task itself.
        """
        own = {name: getattr(self, name) for name in CrossValidationSettings.model_fields}
        return ({CROSS_VALIDATION: own} if self.models else {}) | self.experiments

    @property
    def papers(self) -> dict[str, str]:
        """Rows of the paper's figures by part of the evaluation."""
        paper = self.paper
        return ({"known": paper} if paper else {}) if isinstance(paper, str) else paper

    @model_validator(mode="after")
    def _consistent(self) -> Task:
        parts = ("known", *(("unknown", "overall") if self.withhold else ()), *self.test_on)
        parts += ("known_by_recording",) if self.compare_random else ()
        parts += tuple(self.experiments)
        # an experiment with several published values: `sorting.correct`
        values = [part for part in self.papers if part.partition(".")[0] in self.experiments]
        parts += tuple(values)
        if CROSS_VALIDATION in self.experiments:
            raise ValueError(f"{CROSS_VALIDATION} has its settings in the task itself: models, ...")
        if len(self.classes) == 1:
            raise ValueError("classes: name at least two, or none for all")
        if unknown := sorted(set(self.papers) - set(parts)):
            known = ", ".join(parts)
            raise ValueError(f"paper.{unknown[0]} is no part of this task: it has {known}")
        return self


Dimension = Annotated[int, Field(ge=1, le=256)]


class Embedding(Strict):
    """Contrastive embedding (Hadsell, Chopra, LeCun 2006). No setting is tuned to a data set."""

    instance: str = Field(
        "object",
        description="column of the acquisition log that says which physical thing was recorded: two"
        " recordings of one are similar if their grasps differ, of two are dissimilar",
    )
    supervision: str = Field(
        min_length=1, description="what this pair rule had to know, in a sentence for the report"
    )
    groups: str = Field("grasp_id", description="column whose values never straddle folds")
    folds: int = Field(5, ge=2, description="of the cross-validation")
    inits: int = Field(2, ge=1, description="initialisations of each fold's network")
    dimensions: Annotated[tuple[Dimension, ...], Distinct] = Field(
        (2, 3, 4, 6, 8, 12, 16, 32, 64), min_length=1, description="of the latent, for k-NN"
    )
    shown: Dimension = Field(8, description="dimension of what is measured further (paper: 8)")
    most_recordings: int = Field(
        2000,
        ge=100,
        description="largest number of recordings, evenly of all grasps:"
        " its networks alone take two minutes of a core for each thousand",
    )
    margin: float = Field(1.0, gt=0, description="distance beyond which dissimilar pairs rest")
    epochs: int = Field(
        15, ge=1, description="passes over the training recordings; the loss has vanished by then"
    )
    batch_instances: int = Field(8, ge=2, description="things in a batch")
    batch_recordings: int = Field(4, ge=2, description="recordings of each of them in a batch")
    target: str = Field(description="target that k-NN is scored on")
    category: str = Field("", description="classes of the distance matrix; default: `target`")
    optional: bool = Field(False, description="missing data are reported, and the run succeeds")

    @model_validator(mode="after")
    def _consistent(self) -> Embedding:
        if self.shown not in self.dimensions:
            raise ValueError(f"shown {self.shown} is not among the dimensions")
        return self
