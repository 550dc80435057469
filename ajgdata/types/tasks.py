"""Settings of tasks and embeddings in dataset.yaml."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, JsonValue, model_validator

from ajgdata.types.augment import Augment
from ajgdata.types.base import Distinct, Strict
from ajgdata.types.names import ModelName, Name
from ajgdata.types.registry import COVARIATES_ALONE

#: Name of the experiment whose settings are keys of the task itself.
CROSS_VALIDATION = "cross_validation"


class CrossValidationSettings(Strict):
    """Settings of the cross-validation of models on a task. They are keys of the task itself."""

    models: Annotated[tuple[ModelName, ...], Distinct] = Field(
        ("cnn", "linear", "knn"), description="models that are trained and evaluated"
    )
    compare_random: bool = Field(
        False, description="also evaluate a split that ignores groups, to show its optimistic bias"
    )
    compare_sessions: bool | tuple[ModelName, ...] = Field(
        True,
        description="also evaluate held-out sessions, if there are two or more sessions; true: for "
        "all models; false: for none; a list: for these models",
    )
    test_on: tuple[Name, ...] = Field(
        (),
        description="other data sets that the model of each fold is also tested on, e.g. the same "
        "grasps with noise; a grasp of both data sets is tested only in the fold that holds it out",
    )
    placebo: Name | None = Field(
        None,
        description="data set of one object that was recorded under the names of the classes with "
        "the same protocol; its score is the real chance level; null: `placebo` of this data set",
    )

    def compares_sessions(self, model: str) -> bool:
        """Return whether a model is also evaluated on held-out sessions."""
        if isinstance(self.compare_sessions, bool):
            return self.compare_sessions
        return model in self.compare_sessions


class Task(CrossValidationSettings):
    """A target and the settings of its evaluation. Each model is one row of the report."""

    target: str = Field(description="name of the target")
    classes: Annotated[tuple[str, ...], Distinct] = Field(
        (), description="classes that the task distinguishes, at least two; default: all classes"
    )
    groups: str = Field(
        "grasp_id",
        description="column whose equal values are never in both parts of a split: grasp_id, "
        "placement_id (each fold holds out one placement of every class), session_id, or a label",
    )
    folds: int = Field(
        5,
        ge=2,
        description="number of cross-validation folds; with fewer groups: one fold per group",
    )
    withhold: Annotated[tuple[float, ...], Distinct] = Field(
        (),
        description="target values that no fold trains on; the model of each fold is tested on "
        "them",
    )
    period_deg: float | None = Field(
        None,
        gt=0,
        description="period of an angle in degrees, e.g. 180 for a bar; models learn its sine and "
        "cosine, and an error is the shortest way round",
    )
    augment: Augment | None = Field(
        None,
        description="changed copies of the recordings that models are also trained on, e.g. with "
        "noise; the models of cross-validation and the final models; null: none",
    )
    balance: bool = Field(
        False,
        description="true: training parts have equally many recordings of each class, which are "
        "drawn at random; test parts have all",
    )
    by_confidence: bool = Field(
        False,
        description="true: the report also shows the accuracy of the most confident predictions",
    )
    map: tuple[str, str] | None = Field(
        None,
        description="two columns with a position, e.g. [x, y]: the report also shows true and "
        "predicted class over them; null: no map",
    )
    covariates: Annotated[tuple[str, ...], Distinct] = Field(
        (),
        description="columns of known numbers that models get besides the feature, e.g. "
        "robot_force_n; predictions also need their values",
    )
    experiments: dict[Name, dict[str, JsonValue]] = Field(
        {}, description="settings of additional experiments, by name of the experiment"
    )
    min_groups: int = Field(
        0,
        ge=0,
        description="smallest number of groups of a class; the task excludes other classes, and "
        "the report names them",
    )
    optional: bool = Field(
        False, description="true: the run also succeeds if the data are not sufficient for the task"
    )
    page: Name | None = Field(
        None,
        description="page of the report with the results; default: the page of the data set",
    )
    paper: str | dict[str, str] = Field(
        "",
        description="name of the published value to compare with, e.g. ycb, or a mapping by part "
        "of the evaluation, e.g. {known: size-known, size_80dba: noise}; parts: known, "
        "known_by_recording with compare_random, unknown and overall with withhold, a data set of "
        "test_on, an experiment, or a value of an experiment, e.g. sorting.correct",
    )

    @property
    def requested(self) -> dict[str, dict[str, Any]]:
        """The settings of each requested experiment by name, as in dataset.yaml."""
        experiments: dict[str, dict[str, Any]] = {}
        if self.models:
            experiments[CROSS_VALIDATION] = {
                key: getattr(self, key) for key in CrossValidationSettings.model_fields
            }
            if self.covariates and COVARIATES_ALONE not in self.models:
                experiments[CROSS_VALIDATION]["models"] = (*self.models, COVARIATES_ALONE)
        experiments.update(self.experiments)
        return experiments

    @property
    def papers(self) -> dict[str, str]:
        """Names of published values by part of the evaluation."""
        if not isinstance(self.paper, str):
            return self.paper
        return {"known": self.paper} if self.paper else {}

    @model_validator(mode="after")
    def _consistent(self) -> Task:
        if CROSS_VALIDATION in self.experiments:
            raise ValueError(f"{CROSS_VALIDATION} has its settings in the task itself: models, ...")
        if len(self.classes) == 1:
            raise ValueError("classes: name at least two, or none for all")
        parts = ["known"]
        if self.withhold:
            parts += ["unknown", "overall"]
        parts += self.test_on
        if self.compare_random:
            parts.append("known_by_recording")
        parts += self.experiments
        for part in sorted(self.papers):
            experiment, _, _ = part.partition(".")  # `sorting.correct` is a value of `sorting`
            if part not in parts and experiment not in self.experiments:
                known = ", ".join(parts)
                raise ValueError(f"paper.{part} is not a part of this task: it has {known}")
        return self


Dimension = Annotated[int, Field(ge=1, le=256)]


class Embedding(Strict):
    """Contrastive embedding (Hadsell, Chopra, LeCun 2006). No setting is tuned to a data set."""

    instance: str = Field(
        "object",
        description="column that identifies the physical object; two recordings are similar if "
        "they are different grasps of one object, and dissimilar if the objects differ",
    )
    supervision: str = Field(
        min_length=1,
        description="sentence for the report: the knowledge that these pairs require",
    )
    groups: str = Field(
        "grasp_id", description="column whose equal values are never in both parts of a split"
    )
    folds: int = Field(5, ge=2, description="number of cross-validation folds")
    inits: int = Field(2, ge=1, description="networks per fold, with different initial weights")
    dimensions: Annotated[tuple[Dimension, ...], Distinct] = Field(
        (2, 3, 4, 6, 8, 12, 16, 32, 64),
        min_length=1,
        description="dimensions of the embedding that k-NN is evaluated with",
    )
    shown: Dimension = Field(
        8, description="dimension of the embedding in all other measurements (paper: 8)"
    )
    most_recordings: int = Field(
        2000,
        ge=100,
        description="largest number of recordings, which are sampled evenly from all grasps; the "
        "networks need two minutes of CPU time per 1,000 recordings",
    )
    margin: float = Field(
        1.0, gt=0, description="distance beyond which dissimilar pairs do not add to the loss"
    )
    epochs: int = Field(
        15, ge=1, description="passes over the training recordings; the loss is then close to zero"
    )
    batch_instances: int = Field(8, ge=2, description="objects per batch")
    batch_recordings: int = Field(4, ge=2, description="recordings of each object per batch")
    target: str = Field(description="target that k-NN predicts")
    category: str = Field(
        "", description="target with the classes of the distance matrix; default: `target`"
    )
    optional: bool = Field(
        False,
        description="true: the run also succeeds if the data are not sufficient for the embedding",
    )

    @model_validator(mode="after")
    def _consistent(self) -> Embedding:
        if self.shown not in self.dimensions:
            raise ValueError(f"shown {self.shown} is not among the dimensions")
        return self
