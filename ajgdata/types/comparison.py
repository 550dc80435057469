"""reports/comparisons/<name>.yaml: variants of one evaluation, on the same grasps and folds."""

from __future__ import annotations

from itertools import product
from typing import Annotated, Any, Literal

from pydantic import Field, JsonValue, model_validator

from ajgdata.types.base import ModelName, Name, Strict


class Variant(Strict):
    """One evaluation; keys that are not given are those of the task."""

    name: str = Field("", description="part of the scores, and label; default: what varies")
    features: dict[str, JsonValue] = Field(
        {}, description="differences from the feature settings of the data set"
    )
    excitation: dict[str, JsonValue] = Field(
        {}, description="another played sound, simulated data sets only: kind, length_s, ..."
    )
    split: Literal["grouped", "random"] = Field(
        "grouped", description="grouped: by the groups of the task; random: by recording"
    )
    models: tuple[ModelName, ...] = Field(
        (), description="models of this variant; default: those of the comparison"
    )
    x: float | None = Field(None, description="position on a numeric axis")
    series: str = Field("", description="line of a figure over a numeric axis")


class Comparison(Strict):
    """Variants that are evaluated with the same models, recordings and folds."""

    title: str = Field(min_length=1, description="title of its figures, a noun phrase")
    question: str = Field(min_length=1, description="question that it answers")
    train: Name = Field(description="data set to train on")
    task: Name = Field(description="task of that data set")
    test: tuple[Name, ...] = Field(
        (), description="further data sets to test on, e.g. the same grasps under noise"
    )
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
    models: tuple[ModelName, ...] = Field(
        ("cnn", "linear_plain"), min_length=1, description="models that are evaluated"
    )

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
            others = (str(value) for key, value in values.items() if key != self.axis)
            content |= {"x": values[self.axis], "series": ", ".join(others)}
        return Variant.model_validate(content)

    @property
    def makes_features(self) -> bool:
        """Whether features are computed anew: another sound or other settings are compared."""
        return any(one.features or one.excitation for one in self.all_variants)

    @model_validator(mode="after")
    def _consistent(self) -> Comparison:
        names = [variant.name for variant in self.all_variants]
        if len(names) < 2 or "" in names or len(set(names)) != len(names):
            raise ValueError("variants: give at least two, each with a name of its own")
        if self.axis and self.axis not in self.vary:
            raise ValueError(f"axis: {self.axis!r} is not a key of vary")
        if self.test and any(one.split == "random" for one in self.all_variants):
            raise ValueError("test: a random split has no further data sets")
        return self
