"""Shortcut: does a model hear the object, or a sound that comes with the label?

The models of cross-validation are asked about recordings made with the speaker silent, which hold
nothing of the object (see `evaluate.shortcut_test`).
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

from pydantic import Field, model_validator

from ajgdata.experiments.base import Experiment, Inputs, Outcome, score_table
from ajgdata.experiments.cross_validation import GROUPED, elsewhere, evaluate
from ajgdata.types import ModelName, Name, Strict
from ajgdata.types.table import table_of

if TYPE_CHECKING:
    pass

TEST_COLUMNS = {
    "data_set": "Data set", "measure": "Measure", "value": "Value", "null": "By chance",
    "permutations": "Permutations", "p": "p", "flagged": "Flagged",
}  # fmt: skip


class Settings(Strict):
    """Test of the folds' models on recordings with the speaker silent."""

    test_on: tuple[Name, ...] = Field(
        min_length=1,
        description="data sets that were recorded with the speaker silent: a model whose "
        "predictions from them depend on the target has learned another sound, and is flagged",
    )
    sounding: tuple[Name, ...] = Field(
        (),
        description="those of test_on in which the speaker plays all the same: the figure shows "
        "their errors beside, and no model is flagged for them",
    )
    models: tuple[ModelName, ...] = Field(
        ("cnn", "linear", "knn"), min_length=1, description="models that are tested"
    )

    @property
    def silent(self) -> tuple[str, ...]:
        """Return the data sets that were recorded with the speaker silent."""
        return tuple(name for name in self.test_on if name not in self.sounding)

    @model_validator(mode="after")
    def _some_are_silent(self) -> Settings:
        if more := sorted(set(self.sounding) - set(self.test_on)):
            raise ValueError(f"sounding: {more[0]} is not in test_on; add it there")
        if not self.silent:
            raise ValueError("test_on: no data set is left that is silent; add one")
        return self


def measure(inputs: Inputs, settings: Settings, model: str) -> Outcome:
    """Return how far predictions of `model` from silence depend on the target."""
    from ajgdata.evaluate.metrics import METRICS
    from ajgdata.evaluate.shortcut_test import shortcut_test

    found = evaluate(inputs, model, settings.test_on)
    grouped = found.splits[GROUPED]
    tests = {}
    for name in settings.silent:
        p = grouped.extra_tests[elsewhere(name)].predictions
        tests[name] = shortcut_test(
            p.y_true, p.y_pred, p.fold, found.data[elsewhere(name)].group[p.row],
            kind=inputs.kind, period=inputs.period_deg, seed=inputs.seed,
        )  # fmt: skip
    scores = (
        (model, f"silent:{name}", *row)
        for name, test in tests.items()
        for row in (
            (test.measure, "pooled", test.value),
            (test.measure, "chance", test.null),
            ("p", f"of {test.permutations}", test.p),
        )
    )
    metric = METRICS[inputs.kind][0]
    tested = {"": grouped.scores}
    tested |= {name: grouped.extra_tests[elsewhere(name)].scores for name in settings.sounding}
    errors = (
        {"data_set": name, "mean": s.mean[metric], "sd": s.sd[metric], "chance": s.chance[metric]}
        for name, s in tested.items()
    )
    told = ({"data_set": name, **dataclasses.asdict(test)} for name, test in tests.items())
    columns = {"data_set": "Data set", "mean": "Mean", "sd": "Deviation", "chance": "Chance"}
    return Outcome(
        (
            score_table(scores, "Dependence of predictions from silence on the truth"),
            table_of("silence", "Tests of predictions from silence", told, **TEST_COLUMNS),
            table_of("errors", "Errors while something is played", errors, **columns),
        ),
        about={"folds": grouped.scores.folds},
    )


EXPERIMENT = Experiment(
    name="shortcut",
    title="Shortcut",
    settings=Settings,
    measure=measure,
    figures=lambda results: (),
    by_model=True,
)
