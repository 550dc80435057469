"""Tasks of a data set as declared: what is predicted, how it is split, what else is asked."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from ajgdata.types.base import ModelName, Name, Strict


class Curve(Strict):
    """Learning curve: training grasps per class, each drawn `repeats` times."""

    groups: tuple[Annotated[int, Field(ge=1)], ...] = Field(
        min_length=2, description="numbers of training grasps per class"
    )
    repeats: int = Field(5, ge=2, description="draws of each number")
    models: tuple[ModelName, ...] = Field(
        ("cnn", "linear", "knn"), min_length=1, description="models that get a curve"
    )


class Sorting(Strict):
    """Sorting by sound, offline: objects in random order until none is probable enough."""

    objects: tuple[str, ...] = Field(min_length=2, description="values of the target")
    threshold: float = Field(0.6, gt=0, le=1, description="probability that is enough (paper)")
    models: tuple[ModelName, ...] = Field(("cnn",), min_length=1, description="models that sort")


class Energy(Strict):
    """Energy of the recordings of each class of the target, against those of one of them."""

    reference: str = Field(description="value of the target, e.g. air: the empty gripper")
    band_hz: tuple[float, float] = Field(description="frequencies that count, low to high")

    @model_validator(mode="after")
    def _ordered(self) -> Energy:
        if not 0 <= self.band_hz[0] < self.band_hz[1]:
            raise ValueError(f"energy.band_hz {self.band_hz} must be 0 <= low < high")
        return self


class Calibrate(Strict):
    """The task on other grippers, with a few of their grasps added to the training."""

    test_on: tuple[Name, ...] = Field(min_length=1, description="data sets of the other grippers")
    grasps: tuple[Annotated[int, Field(ge=0)], ...] = Field(
        (0, 1, 2, 4), min_length=1, description="calibration grasps of each class, or value"
    )
    models: tuple[ModelName, ...] = Field(
        ("cnn", "linear", "knn"), min_length=1, description="models that are taken there"
    )


class FeatureChange(Strict):
    """The settings that differ from the data set's own feature settings."""

    window: int | None = Field(None, ge=16, description="STFT window in samples")
    hop: int | None = Field(None, ge=1, description="samples between windows")
    band_hz: tuple[float, float] | None = Field(None, description="keep bins from low to high")


class Stft(Strict):
    """Error against run time of the feature, for other settings of the STFT."""

    settings: tuple[FeatureChange, ...] = Field(
        min_length=1, description="what is tried beside the data set's own settings"
    )
    models: tuple[ModelName, ...] = Field(
        ("ridge", "knn"), min_length=1, description="models that are evaluated with each"
    )


class Task(Strict):
    """Target + split: one row of the report for each model."""

    target: str = Field(description="which of the targets")
    groups: str = Field("grasp_id", description="column whose values never straddle folds")
    folds: int = Field(5, ge=2, description="of the cross-validation; at most one a group")
    models: tuple[ModelName, ...] = Field(
        ("cnn", "linear", "knn"), description="models that are trained and evaluated"
    )
    compare_random: bool = Field(
        False, description="also evaluate a split that ignores the groups, to show what it flatters"
    )
    withhold: tuple[float, ...] = Field(
        (), description="target values that no fold trains on; every fold's model is tested on them"
    )
    period_deg: float | None = Field(
        None,
        gt=0,
        description="the target repeats after this, as a bar's angle after 180: models learn sine "
        "and cosine, errors are the shortest way round",
    )
    test_on: tuple[Name, ...] = Field(
        (),
        description="data sets whose recordings the folds' models are tested on as well, e.g. the "
        "same grasps under noise; of a grasp that both hold, only the fold that holds it out",
    )
    silent: tuple[Name, ...] = Field(
        (),
        description="those of test_on that were recorded with the speaker silent: a model whose "
        "predictions from them depend on the target has learned another sound, and is flagged",
    )
    curve: Curve | None = Field(None, description="accuracy against number of training grasps")
    permutations: int = Field(
        0, ge=0, description="labels permuted so often for a test against chance; 0: no test"
    )
    sorting: Sorting | None = Field(None, description="sorting by this target's classes")
    stft: Stft | None = Field(None, description="the feature's settings against its run time")
    energy: Energy | None = Field(
        None,
        description="how much sound comes back, by class; it needs features.quantity power and "
        "features.normalisation none",
    )
    calibrate: Calibrate | None = Field(
        None, description="error on other grippers against the number of calibration grasps"
    )
    experiments: tuple[Name, ...] = Field(
        (), description="`snakemake report_NAME` reports on the tasks of NAME; default: data set"
    )
    paper: str | dict[str, str] = Field(
        "",
        description="rows of the paper's figures to stand beside, e.g. ycb, or by part (known, "
        "unknown, overall, a data set of test_on, or a further experiment: curves, permutations, "
        "sorting, energies, transfers): {known: size-known, size_80dba: noise}",
    )

    @property
    def others(self) -> tuple[str, ...]:
        """Data sets that this task needs beside its own."""
        return (*self.test_on, *(self.calibrate.test_on if self.calibrate else ()))

    @property
    def further(self) -> tuple[str, ...]:
        """Kinds of further experiments that are asked for."""
        asked = {
            "curves": self.curve,
            "permutations": self.permutations,
            "sorting": self.sorting,
            "energies": self.energy,
            "transfers": self.calibrate,
        }
        return tuple(kind for kind, settings in asked.items() if settings)

    @property
    def papers(self) -> dict[str, str]:
        """Rows of the paper's figures by part of the evaluation."""
        given = self.paper
        return ({"known": given} if given else {}) if isinstance(given, str) else given

    @model_validator(mode="after")
    def _distinct(self) -> Task:
        if len(set(self.withhold)) != len(self.withhold):
            raise ValueError("withhold lists a value twice")
        parts = ("known", *(("unknown", "overall") if self.withhold else ()), *self.test_on)
        parts += self.further
        if more := sorted(set(self.silent) - set(self.test_on)):
            raise ValueError(f"silent: {more[0]} is not in test_on; add it there")
        if more := sorted(set(self.papers) - set(parts)):
            raise ValueError(f"paper.{more[0]} is no part of this task: it has {', '.join(parts)}")
        return self
