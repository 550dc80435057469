"""Variants of one evaluation on the same grasps: files `reports/variants/<name>.yaml`.

A file names a data set, a task and models, and at least two variants of their evaluation. The first
variant is the reference. Hypotheses predict which of two variants has the better result.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    Field,
    JsonValue,
    SerializerFunctionWrapHandler,
    TypeAdapter,
    ValidationError,
    model_serializer,
    model_validator,
)

from ajgdata.types.base import Strict, describe, overridden
from ajgdata.types.excitation import ExcitationSpec
from ajgdata.types.features import FeatureKind, feature_settings
from ajgdata.types.names import ModelName, Name

#: Value of `tested` in a hypothesis for the values that the task withholds from training.
WITHHELD = "withheld"


class Changes(Strict):
    """Base class of changes of a default.

    Only keys that are given are written. A default value would otherwise replace a change of
    `shared`.
    """

    @model_serializer(mode="wrap")
    def _given_keys(self, serialise: SerializerFunctionWrapHandler) -> dict[str, Any]:
        content = serialise(self).items()
        return {key: value for key, value in content if key in self.model_fields_set}


class ChosenGrasps(Changes):
    """The first grasps of a recipe. They are simulated again if scene, scatter or pose changes."""

    sessions: int = Field(1, ge=1, description="first sessions of the recipe")
    each: int | None = Field(None, ge=1, description="first grasps of each object; default: all")
    all_values: bool = Field(
        False, description="also train on the values that the task withholds from training"
    )
    scene: dict[str, JsonValue] = Field({}, description="changed settings of the scene")
    scatter: float | None = Field(
        None,
        ge=0,
        description="factor for the default scatter of grasps; default: the scatter of the recipe",
    )
    pose: float = Field(
        1.0, ge=0, description="factor for the pose that the recipe varies, and for its error"
    )

    @property
    def is_changed(self) -> bool:
        """Whether the grasps are simulated again."""
        return bool(self.scene) or self.scatter is not None or self.pose != 1


class Variant(Changes):
    """One evaluation. Other keys are those of the file, the task and the data set."""

    train: tuple[Name, ...] = Field((), description="data sets to train on, together")
    task: Name | None = Field(
        None, description="another task of the data set, with the same kind and unit of target"
    )
    model: ModelName | None = Field(None, description="model in place of each model of the file")
    split: Literal["grouped", "random"] = Field(
        "grouped", description="grouped: by the column `groups` of the task; random: by recording"
    )
    one_recording: bool = Field(False, description="only the first recording of each grasp")
    features: dict[str, JsonValue] = Field(
        {}, description="changed feature settings; features are computed from the recordings"
    )
    bins_hz: tuple[float, float] | None = Field(
        None,
        description="lowest and highest frequency in Hz of the used bins of stored features; the "
        "result is that of `features: {band_hz: ...}` except for rounding, but needs no recordings",
    )
    excitation: dict[str, JsonValue] = Field(
        {}, description="another played sound (kind, length_s, ...), only for simulated data sets"
    )
    grasps: ChosenGrasps | None = Field(
        None, description="grasps of the recipe; default: all recordings"
    )

    @property
    def is_computed(self) -> bool:
        """Whether the features are computed from recordings."""
        return bool(self.features or self.excitation)

    def feature_settings(self, own: FeatureKind) -> FeatureKind:
        """Return the changed feature settings of a data set with the settings `own`.

        A change of `kind` starts with the defaults of this kind.
        """
        if self.features.get("kind", own.kind) != own.kind:
            return feature_settings(self.features)
        return feature_settings({**own.model_dump(), **self.features})

    def played(self) -> ExcitationSpec:
        """Return the changed played sound."""
        adapter: TypeAdapter[ExcitationSpec] = TypeAdapter(ExcitationSpec)
        return adapter.validate_python(self.excitation)

    @model_validator(mode="after")
    def _possible(self) -> Variant:
        if self.grasps is not None:
            for key in ("bins_hz", "excitation", "features", "one_recording", "train"):
                if key in self.model_fields_set:
                    raise ValueError(f"grasps and {key} exclude each other")
        kind = self.excitation.get("kind")
        if kind in ("file", "none"):
            raise ValueError(f"excitation.kind {kind}: a variant plays only computed sounds")
        if self.bins_hz is not None and self.is_computed:
            raise ValueError("bins_hz selects stored features: write features.band_hz instead")
        if self.task is not None and self.is_computed:
            raise ValueError("task and computed features (features, excitation) exclude each other")
        return self


class Hypothesis(Strict):
    """A possible cause: if `claim` holds, the change makes the result better, or worse."""

    claim: str = Field(min_length=1, description="possible cause of the difference")
    change: str = Field(min_length=1, description="difference between the two variants")
    explains: tuple[Name, ...] = Field((), description="published values that it could explain")
    expected: Literal["better", "worse"] = Field("better", description="effect if the claim holds")
    before: str = Field(min_length=1, description="variant without the change")
    after: str = Field(min_length=1, description="variant with the change")
    tested: str = Field(
        "",
        description="data set of `test`, or `withheld` for the values that the task withholds; "
        "default: held-out grasps of the training data sets",
    )
    tested_after: str | None = Field(
        None, description="the same for `after`; default: as for `before`"
    )

    @property
    def sides(self) -> tuple[tuple[str, str], tuple[str, str]]:
        """(variant, value of `tested`) before the change, and after the change."""
        tested_after = self.tested if self.tested_after is None else self.tested_after
        return (self.before, self.tested), (self.after, tested_after)


@dataclass(frozen=True)
class NamedVariant:
    """A variant with its name."""

    name: str
    change: Variant
    values: Mapping[str, JsonValue] = field(default_factory=dict)  #: by entry of `vary`


def _text_keys(content: object) -> object:
    """Return a mapping with text as keys, because YAML reads labels such as 2.5 as numbers."""
    if not isinstance(content, dict):
        return content
    return {
        f"{key:g}" if isinstance(key, (int, float)) else key: value
        for key, value in content.items()
    }


#: An entry of `vary`: values of one key of a variant, or changes by label.
Values = (
    Annotated[tuple[JsonValue, ...], Field(min_length=1)]
    | Annotated[dict[str, Variant], Field(min_length=1), BeforeValidator(_text_keys)]
)


class Variants(Strict):
    """Variants of one evaluation, with the same grasps, and hypotheses on their differences."""

    title: str = Field(min_length=1, description="title of the figure or table, a noun phrase")
    question: str = Field(min_length=1, description="question that the figure or table answers")
    note: str = Field("", description="more sentences above the table")
    train: Name = Field(description="data set to train on")
    task: Name = Field(description="task of the data set `train`")
    test: tuple[Name, ...] = Field(
        (), description="other data sets to test on, e.g. the same grasps with noise"
    )
    models: tuple[ModelName, ...] = Field(
        ("cnn", "linear_plain"), min_length=1, description="models that are evaluated"
    )
    exclude: tuple[str, ...] = Field((), description="classes that are not evaluated")
    shared: Variant = Field(Variant(), description="changes of all variants")
    vary: dict[str, Values] = Field(
        {},
        description="values by key of a variant, e.g. {features.hop: [128, 512]}, or changes by "
        "label of a quantity; the variants are all combinations of the entries",
    )
    name: str = Field(
        "", description="pattern of the names of variants from `vary`, e.g. 'stft:{window}/{hop}'"
    )
    axis: str = Field("", description="entry of `vary` that is the numeric axis of the figure")
    panel: str = Field("", description="entry of `vary` with one panel of the figure per value")
    variants: dict[str, Variant] = Field({}, description="variants by name, in addition to `vary`")
    hypotheses: tuple[Hypothesis, ...] = Field((), description="tested differences of variants")
    causes: bool = Field(
        False,
        description="true: the page *Causes of differences* shows the file, as it shows all files "
        "with hypotheses; false: the page of the task",
    )

    @cached_property
    def all_variants(self) -> tuple[NamedVariant, ...]:
        """All combinations of `vary`, then `variants`; the first is the reference."""
        named = []
        if self.vary:
            for values in product(*self.vary.values()):
                named.append(self._varied(dict(zip(self.vary, values, strict=True))))
        for name, variant in self.variants.items():
            named.append(NamedVariant(name, self._with_shared(variant.model_dump())))
        return tuple(named)

    def _varied(self, values: dict[str, Any]) -> NamedVariant:
        """Return the variant with one value of each entry of `vary`."""
        changes: dict[str, Any] = {}
        for key, value in values.items():
            entry = self.vary[key]
            if isinstance(entry, dict):  # changes by label
                changes = overridden(changes, entry[value].model_dump())
            else:
                changes = overridden(changes, _nested(key, value))
        shown = {}
        for key, value in values.items():
            has_labels = isinstance(self.vary[key], dict)
            shown[key if has_labels else _shown_key(key)] = value
        name = ", ".join(f"{key} {value}" for key, value in shown.items())
        if self.name:
            name = self.name.format(**shown)
        return NamedVariant(name, self._with_shared(changes), values)

    def _with_shared(self, changes: dict[str, Any]) -> Variant:
        """Return the variant with the changes of `shared` and its own changes."""
        return Variant.model_validate(overridden(self.shared.model_dump(), changes))

    def x(self, variant: NamedVariant) -> float | None:
        """Return the value of a variant on the numeric axis; None if it has no value."""
        value = variant.values.get(self.axis)
        return None if value is None else float(str(value))

    def panel_of(self, variant: NamedVariant) -> str:
        """Return the panel of a variant; "" if there is one panel."""
        return str(variant.values.get(self.panel, ""))

    def series(self, variant: NamedVariant) -> str:
        """Return the name of the line of a variant in a figure with a numeric axis, else ""."""
        if not self.axis:
            return ""
        others = [
            str(value)
            for key, value in variant.values.items()
            if key not in (self.axis, self.panel)
        ]
        return ", ".join(others)

    def variant(self, name: str) -> NamedVariant:
        """Return a variant by name."""
        return next(variant for variant in self.all_variants if variant.name == name)

    def models_of(self, variant: Variant) -> tuple[str, ...]:
        """Return the models that are evaluated with a variant."""
        return self.models if variant.model is None else (variant.model,)

    def trained_on(self, variant: Variant) -> tuple[str, ...]:
        """Return the data sets that a variant trains on."""
        return variant.train or (self.train,)

    def held_out_set(self, variant: Variant) -> str:
        """Return the name of the held-out grasps of a variant: its training data sets with `+`."""
        return "+".join(self.trained_on(variant))

    @property
    def is_computed(self) -> bool:
        """Whether a variant needs features that are computed from recordings."""
        return any(variant.change.is_computed for variant in self.all_variants)

    @property
    def explains_differences(self) -> bool:
        """Whether the page *Causes of differences* shows the file.

        Only `snakemake everything` computes these files.
        """
        return self.causes or bool(self.hypotheses)

    @property
    def test_sets(self) -> tuple[str, ...]:
        """Other data sets that all variants are tested on."""
        return tuple(name for name in dict.fromkeys(self.test) if name != self.train)

    @property
    def train_sets(self) -> tuple[str, ...]:
        """Other data sets that a variant trains on."""
        names = [name for variant in self.all_variants for name in variant.change.train]
        return tuple(name for name in dict.fromkeys(names) if name != self.train)

    @property
    def tasks(self) -> tuple[str, ...]:
        """Other tasks of the data set that a variant evaluates."""
        names = [variant.change.task for variant in self.all_variants]
        return tuple(dict.fromkeys(name for name in names if name not in (None, self.task)))

    @model_validator(mode="after")
    def _consistent(self) -> Variants:
        for key in (self.axis, self.panel):
            if key and key not in self.vary:
                raise ValueError(f"{key!r} of axis or panel is not a key of vary")
        names, places = self._names_and_places()
        if len(names) < 2 or "" in names or len(set(names)) != len(names):
            raise ValueError("variants: give at least two, each with a name of its own")
        if self.axis and None in places:
            raise ValueError("axis: variants outside of vary have no place on it")
        if self.causes and not self.hypotheses and not self.axis:
            raise ValueError("causes: give hypotheses or an axis")
        for hypothesis in self.hypotheses:
            self._check(hypothesis, names)
        return self

    def _names_and_places(self) -> tuple[list[str], list[float | None]]:
        """Return names of variants and places on the axis. Raises ValueError if one is wrong."""
        try:
            names = [variant.name for variant in self.all_variants]
            places = [self.x(variant) for variant in self.all_variants]
        except ValidationError as error:
            raise ValueError(f"a variant is wrong: {describe(error, '').problem}") from None
        except KeyError as error:
            raise ValueError(f"name: {error} is not a key of vary") from None
        except (AttributeError, IndexError):
            raise ValueError("name: write each entry of vary as {its last part}") from None
        except ValueError as error:
            raise ValueError(f"axis: {error}") from None
        return names, places

    def _check(self, hypothesis: Hypothesis, names: list[str]) -> None:
        """Raise ValueError for a hypothesis on a variant, or on a test, that does not exist."""
        for name, tested in hypothesis.sides:
            if name not in names:
                raise ValueError(f"hypotheses: {name!r} is not a variant")
            if tested not in ("", WITHHELD, *self.test):
                raise ValueError(f"hypotheses: {tested!r} is not tested: add it to test")
            grasps = self.variant(name).change.grasps if tested else None
            if grasps is not None and (tested != WITHHELD or grasps.all_values):
                raise ValueError(
                    f"hypotheses: {name!r} selects grasps: it has no test on {tested!r}"
                )
            if tested and self.variant(name).change.split == "random":
                raise ValueError(
                    f"hypotheses: {name!r} has a random split: it has no test on {tested!r}"
                )


def _nested(key: str, value: JsonValue) -> dict[str, Any]:
    """Return the change of a key with dots.

    >>> _nested("features.hop", 128)
    {'features': {'hop': 128}}
    """
    head, _, tail = key.partition(".")
    return {head: _nested(tail, value) if tail else value}


def _shown_key(key: str) -> str:
    """Return the last part of a key with dots.

    >>> _shown_key("features.hop")
    'hop'
    """
    return key.rpartition(".")[2]
