"""Settings of the experiments of this package, as in `experiments` of a task in dataset.yaml.

Those of cross-validation and of embeddings are in `types.tasks`. Light: Snakemake imports this.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from ajgdata.types import FeatureKind, FeatureSettings, Kind, ModelName, Name, Strict
from ajgdata.types.variants import Variants


class LearningCurveSettings(Strict):
    """Learning curve: training grasps per class, each number drawn `repeats` times."""

    groups: tuple[Annotated[int, Field(ge=1)], ...] = Field(
        min_length=2, description="numbers of training grasps per class"
    )
    repeats: int = Field(5, ge=2, description="draws of each number")
    models: tuple[ModelName, ...] = Field(
        ("cnn", "linear_plain", "knn_plain"), min_length=1, description="models that get a curve"
    )


class ShortcutSettings(Strict):
    """Test of the folds' models on recordings with the speaker silent."""

    test_on: tuple[Name, ...] = Field(
        min_length=1,
        description="data sets that were recorded with the speaker silent: a model whose "
        "predictions from them depend on the target has learned another sound, and is flagged",
    )
    models: tuple[ModelName, ...] = Field(
        ("cnn", "linear", "knn"), min_length=1, description="models that are tested"
    )


class ReflectedEnergySettings(Strict):
    """Energy of the recordings of each class of the target, against those of one of them."""

    reference: str = Field(description="value of the target, e.g. air: the empty gripper")
    band_hz: tuple[float, float] = Field(description="frequencies that count, low to high")

    @model_validator(mode="after")
    def _ordered(self) -> ReflectedEnergySettings:
        if not 0 <= self.band_hz[0] < self.band_hz[1]:
            raise ValueError(f"band_hz {self.band_hz} must be 0 <= low < high")
        return self


def check_energies(_: ReflectedEnergySettings, __: Kind, features: FeatureKind) -> None:
    """Raise ValueError for features that are no energies."""
    is_energy = (
        isinstance(features, FeatureSettings)
        and features.quantity == "power"
        and features.normalisation == "none"
    )
    if not is_energy:
        raise ValueError(
            "reflected_energy needs features.quantity power and features.normalisation none"
        )


class ConformalIntervalsSettings(Strict):
    """Prediction intervals of stated coverage for a number."""

    coverages: tuple[Annotated[float, Field(gt=0, lt=1)], ...] = Field(
        (0.5, 0.8, 0.9, 0.95),
        min_length=1,
        description="shares of true values that intervals must contain",
    )
    models: tuple[ModelName, ...] = Field(
        ("linear", "knn"), min_length=1, description="models that get intervals"
    )


class SortingSettings(Strict):
    """Sorting by sound, offline: objects in random order until none is probable enough."""

    threshold: float = Field(0.6, gt=0, le=1, description="probability that is enough (paper)")
    models: tuple[ModelName, ...] = Field(("cnn",), min_length=1, description="models that sort")
    scenario: str = Field("", description="name of the scenario in the comparison with the paper")


class NovelObjectsSettings(Strict):
    """Detection of objects that are held out, by several detectors."""

    false_alarm: float = Field(
        0.05, gt=0, lt=1, description="share of grasps of known objects that may be flagged"
    )


class CrossGripperSettings(Strict):
    """The task on other grippers, with a few of their grasps added to the training."""

    test_on: tuple[Name, ...] = Field(min_length=1, description="data sets of the other grippers")
    grasps: tuple[Annotated[int, Field(ge=0)], ...] = Field(
        (0, 1, 2, 4), min_length=1, description="calibration grasps of each class, or value"
    )
    models: tuple[ModelName, ...] = Field(
        ("cnn", "linear_plain", "knn_plain"),
        min_length=1,
        description="models that are taken there",
    )


#: Normalisations of features by group.
Normalisation = Literal["none", "group"]


class TransferSettings(Strict):
    """The task on groups of recordings that are left out, for example on new fingers."""

    leave_out: str = Field(
        description="column whose values are left out in turn: session_id, or a label, e.g. finger"
    )
    groups: tuple[Annotated[int, Field(ge=1)], ...] = Field(
        (),
        description="numbers of training groups, each drawn `repeats` times; all groups that are "
        "not left out are always one of the numbers",
    )
    normalise: tuple[Normalisation, ...] = Field(
        ("none", "group"),
        description="none; group: each bin gets the same mean and deviation in all groups, from "
        "unlabelled recordings",
    )
    align: tuple[Annotated[int, Field(ge=0)], ...] = Field(
        (0,),
        description="numbers of labelled grasps of the left-out group that fit an affine map of "
        "its features; 0: no map",
    )
    repeats: int = Field(
        3, ge=1, description="draws of training groups and of labelled grasps for each left-out one"
    )
    models: tuple[ModelName, ...] = Field(
        ("linear_plain", "knn_plain"), min_length=1, description="models that are transferred"
    )
    placebo: Name | None = Field(
        None,
        description="data set of one object under the names of the classes, with the same column; "
        "null: `placebo` of this data set",
    )

    @model_validator(mode="after")
    def _with_references(self) -> TransferSettings:
        if "none" not in self.normalise:
            raise ValueError("normalise must list none: the gain is measured against it")
        if 0 not in self.align:
            raise ValueError("align must list 0: the gain is measured against it")
        return self


class RepeatedFitsSettings(Strict):
    """Score on other data sets over many fits of models that are trained on the task's own."""

    test_on: tuple[Name, ...] = Field(
        min_length=1, description="data sets that the models are tested on, e.g. under noise"
    )
    repeats: int = Field(10, ge=3, le=100, description="cross-validations with other seeds")
    models: tuple[ModelName, ...] = Field(
        ("cnn",), min_length=1, description="models; the first is compared with the paper"
    )


class VariantsSettings(Strict):
    """Files of `reports/variants/` on a task. They are read from there; do not write this key."""

    files: dict[Name, Variants] = Field(min_length=1, description="content of the files by name")

    @property
    def test_on(self) -> tuple[str, ...]:
        """Other data sets that variants test on."""
        return tuple(dict.fromkeys(name for file in self.files.values() for name in file.test_sets))

    @property
    def train_on(self) -> tuple[str, ...]:
        """Other data sets that variants train on."""
        return tuple(
            dict.fromkeys(name for file in self.files.values() for name in file.train_sets)
        )

    @property
    def other_tasks(self) -> tuple[str, ...]:
        """Other tasks of the data set that variants evaluate."""
        return tuple(dict.fromkeys(name for file in self.files.values() for name in file.tasks))
