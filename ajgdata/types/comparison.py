"""Variants of one evaluation on the same grasps and folds: reports/comparisons/<name>.yaml, and
reports/ablations/<name>.yaml, whose hypotheses could explain a difference from the paper."""

from __future__ import annotations

from itertools import product
from typing import Annotated, Any, Literal

from pydantic import Field, JsonValue, model_validator

from ajgdata.types.base import ModelName, Name, Strict

#: Name of the test on the values that the task withholds from training.
WITHHELD = "withheld"


class Evaluation(Strict):
    """The evaluation that all variants change."""

    title: str = Field(min_length=1, description="title of its figures or table, a noun phrase")
    train: Name = Field(description="data set to train on")
    task: Name = Field(description="task of that data set")
    test: tuple[Name, ...] = Field(
        (), description="further data sets to test on, e.g. the same grasps under noise"
    )
    models: tuple[ModelName, ...] = Field(
        ("cnn", "linear_plain"), min_length=1, description="models that are evaluated"
    )


class Variant(Strict):
    """One evaluation; keys that are not given are those of the task."""

    name: str = Field("", description="part of the scores, and label; default: what varies")
    features: dict[str, JsonValue] = Field(
        {}, description="differences from the feature settings of the data set"
    )
    excitation: dict[str, JsonValue] = Field(
        {}, description="another played sound, simulated data sets only: kind, length_s, ..."
    )
    x: float | None = Field(None, description="position on a numeric axis")
    series: str = Field("", description="line of a figure over a numeric axis")


class Comparison(Evaluation):
    """Variants that are evaluated with the same models, recordings and folds."""

    question: str = Field(min_length=1, description="question that it answers")
    vary: dict[str, Annotated[tuple[JsonValue, ...], Field(min_length=1)]] = Field(
        {},
        description="keys of a variant and their values, e.g. {features.hop: [128, 512]}; several "
        "keys are combined",
    )
    name: str = Field(
        "", description="pattern of the names of varied variants, e.g. 'stft:{window}/{hop}'"
    )
    axis: str = Field("", description="key of `vary` whose values are the numeric axis")
    variants: tuple[Variant, ...] = Field((), description="variants, in addition to `vary`")

    @property
    def all_variants(self) -> tuple[Variant, ...]:
        """Variants of `vary`, all combinations, then `variants`; the first is the reference."""
        if not self.vary:
            return self.variants
        varied = [
            self._varied(dict(zip(self.vary, values, strict=True)))
            for values in product(*self.vary.values())
        ]
        return (*varied, *self.variants)

    def _varied(self, values: dict[str, Any]) -> Variant:
        content: dict[str, Any] = {}
        for key, value in values.items():
            head, _, tail = key.partition(".")
            content.setdefault(head, {})[tail] = value
            if not tail:
                content[head] = value
        tails = {key.rpartition(".")[2]: value for key, value in values.items()}
        name = ", ".join(f"{key} {value}" for key, value in tails.items())
        content["name"] = self.name.format(**tails) if self.name else name
        if self.axis:
            labels = (str(value) for key, value in values.items() if key != self.axis)
            content |= {"x": values[self.axis], "series": ", ".join(labels)}
        return Variant.model_validate(content)

    @property
    def makes_features(self) -> bool:
        """Whether features are computed again: another sound or other settings are compared."""
        return any(variant.features or variant.excitation for variant in self.all_variants)

    @model_validator(mode="after")
    def _consistent(self) -> Comparison:
        names = [variant.name for variant in self.all_variants]
        if len(names) < 2 or "" in names or len(set(names)) != len(names):
            raise ValueError("variants: give at least two, each with a name of its own")
        if self.axis and self.axis not in self.vary:
            raise ValueError(f"axis: {self.axis!r} is not a key of vary")
        return self


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
    """Model and data of one evaluation; keys that are not given are those of the task."""

    train: tuple[Name, ...] = Field(
        (), description="data sets to train on, together; default: that of the ablation"
    )
    task: Name | None = Field(None, description="another task of the data set, for its target")
    model: ModelName | None = Field(
        None, description="another model, evaluated in place of each model of the ablation"
    )
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


class GridAxis(Strict):
    """One changed quantity of a grid: its values, and the scene of each."""

    title: str = Field(min_length=1, description="title of the axis, without unit")
    unit: str = Field("", description="unit of the values")
    scenes: dict[float, dict[str, JsonValue]] = Field(
        min_length=1, description="changed settings of the scene by value"
    )


class Grid(Strict):
    """Errors at withheld values over two changed quantities: all grasps are simulated again."""

    name: Name = Field(description="name of its table")
    title: str = Field(min_length=1, description="title of its table, a noun phrase")
    note: str = Field("", description="sentences above its table")
    train: Name = Field(description="data set whose recipe is changed")
    tasks: dict[Name, str] = Field(
        min_length=1, description="tasks of the data set with the same target, and their labels"
    )
    model: ModelName = Field("cnn", description="model that is evaluated")
    sessions: int = Field(1, ge=1, description="first sessions of the recipe")
    scene: dict[str, JsonValue] = Field({}, description="changed settings of all scenes")
    x: GridAxis = Field(description="quantity on the axis of the figure")
    series: GridAxis = Field(description="quantity with one line per value")


class Ablation(Evaluation):
    """Variants of one evaluation on the same grasps, and hypotheses on their differences."""

    note: str = Field("", description="sentences above its table")
    exclude: tuple[str, ...] = Field((), description="classes that are not evaluated")
    variants: dict[str, AblationVariant] = Field(min_length=2, description="variants by name")
    why: tuple[Why, ...] = Field(min_length=1, description="hypotheses")
    grid: Grid | None = Field(None, description="errors over two changed quantities")

    @property
    def datasets(self) -> tuple[str, ...]:
        """Data sets that it needs."""
        trained = [name for variant in self.variants.values() for name in variant.train]
        if self.grid is not None:
            trained.append(self.grid.train)
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
