"""reports/ablations/<name>.yaml: a comparison with a hypothesis on a difference from the paper."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, JsonValue, model_validator

from ajgdata.types.base import ModelName, Name, Strict

#: Name of the test on the values that the task withholds from training.
WITHHELD = "withheld"


class Grasps(Strict):
    """First recordings of planned grasps; with a change, these grasps simulated again."""

    sessions: int = Field(1, ge=1, description="first sessions of the recipe")
    each: int | None = Field(None, ge=1, description="first grasps of each object; default: all")
    scene: dict[str, JsonValue] = Field({}, description="changed settings of the scene")
    scatter: float | None = Field(
        None, ge=0, description="scatter of grasps relative to its default; default: as planned"
    )
    pose: float = Field(
        1.0, ge=0, description="factor on what the recipe varies of the pose, and on its error"
    )

    @property
    def is_changed(self) -> bool:
        """Whether the grasps are simulated again."""
        return bool(self.scene) or self.scatter is not None or self.pose != 1


class AblationVariant(Strict):
    """Training and test data of one evaluation; keys that are not given are those of the task."""

    train: tuple[Name, ...] = Field(
        (), description="data sets to train on, together; default: that of the ablation"
    )
    task: Name | None = Field(None, description="another task of the data set, for its target")
    split: Literal["grouped", "random"] = Field(
        "grouped", description="grouped: by grasp; random: by recording"
    )
    one_recording: bool = Field(False, description="only the first recording of each grasp")
    band_hz: tuple[float, float] | None = Field(None, description="only these bins of the feature")
    grasps: Grasps | None = Field(None, description="grasps; default: all recordings")


class Why(Strict):
    """A hypothesis: if `claim` holds, the change makes the result better, or worse.

    `before` and `after` name variants, each optionally with what it is tested on: `quiet
    on:size_80dba`, or `on:withheld` for the values that the task withholds from training.
    """

    claim: str = Field(min_length=1, description="possible cause of the difference")
    change: str = Field(min_length=1, description="difference between the two variants")
    of: tuple[Name, ...] = Field((), description="rows of the paper that it could explain")
    expected: Literal["better", "worse"] = Field("better", description="effect if the claim holds")
    before: str = Field(min_length=1, description="variant without the change")
    after: str = Field(min_length=1, description="variant with the change")


class Ablation(Strict):
    """Variants of one evaluation on the same grasps, and hypotheses on their differences."""

    title: str = Field(min_length=1, description="title of its table, a noun phrase")
    note: str = Field("", description="sentences above its table")
    train: Name = Field(description="data set to train on")
    task: Name = Field(description="task of that data set")
    test: tuple[Name, ...] = Field(
        (), description="data sets to test on as well, on the grasps held out"
    )
    exclude: tuple[str, ...] = Field((), description="classes that are not evaluated")
    variants: dict[str, AblationVariant] = Field(min_length=2, description="variants by name")
    models: tuple[ModelName, ...] = Field(
        ("cnn", "linear_plain"), min_length=1, description="models that are evaluated"
    )
    why: tuple[Why, ...] = Field(min_length=1, description="hypotheses")

    @property
    def datasets(self) -> tuple[str, ...]:
        """Data sets that it needs."""
        trained = [name for one in self.variants.values() for name in one.train]
        return tuple(dict.fromkeys([self.train, *self.test, *trained]))

    @model_validator(mode="after")
    def _consistent(self) -> Ablation:
        for hypothesis in self.why:
            for side in (hypothesis.before, hypothesis.after):
                name, _, tested = side.partition(" on:")
                if name not in self.variants:
                    raise ValueError(f"why: {name!r} is not a variant")
                if tested not in ("", WITHHELD, *self.test):
                    raise ValueError(f"why: {tested!r} is not tested: add it to test")
        return self
