"""Variants: one evaluation with changed data, features, sound, split, model or scene.

Each file `reports/variants/<name>.yaml` of the project is measured in a job of its own. Its first
variant is the reference.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pydantic import Field

from ajgdata.evaluate.parts import GROUPED, RANDOM, part_columns
from ajgdata.experiments.base import Division, Experiment, Inputs, MeasuredPart, Outcome
from ajgdata.experiments.scores import ScoreKey, ScoreRow, fold_scores, score_table
from ajgdata.experiments.variant_data import FEATURE_S, VariantData, VariantRecordings
from ajgdata.experiments.variant_figures import plots, summary
from ajgdata.store.metrics import COST
from ajgdata.store.variants import VARIANTS
from ajgdata.types import Name, Strict
from ajgdata.types.variants import NamedVariant, Variants

if TYPE_CHECKING:
    from ajgdata.evaluate.crossval import CrossValidation

TITLE = "Variants"


class Settings(Strict):
    """Files of `reports/variants/` on a task. They are read from there; do not write this key."""

    files: dict[Name, Variants] = Field(min_length=1, description="content of the files by name")
    test_on: tuple[Name, ...] = Field((), description="other data sets that they test on")
    train_on: tuple[Name, ...] = Field((), description="other data sets that they train on")

    @property
    def other_tasks(self) -> tuple[str, ...]:
        """Other tasks of the data set that variants evaluate."""
        return tuple(dict.fromkeys(name for file in self.files.values() for name in file.tasks))


@dataclass(frozen=True)
class ByFile(Division):
    """One measurement for each file, in a job of its own."""

    def parts(self, settings: Settings) -> list[MeasuredPart]:
        """Return a part for each file."""
        return [
            MeasuredPart(name, name, title=file.title, is_late=file.explains_differences)
            for name, file in settings.files.items()
        ]

    def only(self, settings: Settings, parts: Sequence[str]) -> Settings:
        """Return the settings of some files, with the data sets that these files need."""
        return settings_of({name: settings.files[name] for name in parts})


def settings_of(files: Mapping[str, Variants]) -> Settings:
    """Return the settings of files, with the data sets that they need."""
    test_on = [name for file in files.values() for name in file.test_sets]
    train_on = [name for file in files.values() for name in file.train_sets]
    return Settings(
        files=files,
        test_on=tuple(dict.fromkeys(test_on)),
        train_on=tuple(dict.fromkeys(train_on)),
    )


def measure(inputs: Inputs, settings: Settings, name: str) -> Outcome:
    """Return the scores of all models with each variant of the file `name`."""
    file = settings.files[name]
    recordings = VariantRecordings(inputs, file)
    scores: list[ScoreRow] = []
    costs: list[ScoreRow] = []
    for variant in file.all_variants:
        key = ScoreKey(comparison=name, condition=variant.name)
        data = recordings.data(variant)
        feature_s = recordings.feature_s(variant)
        if math.isfinite(feature_s):
            costs.append(ScoreRow(FEATURE_S, COST, feature_s, key))
        for model in file.models_of(variant.change):
            result = evaluated(recordings.inputs_of(variant.change), variant, data, model)
            tests = {GROUPED if variant.change.split == "grouped" else RANDOM: result.scores}
            tests |= {part: tested.scores for part, tested in result.extra_tests.items()}
            held_out_set = file.held_out_set(variant.change)
            for part, part_scores in tests.items():
                columns = part_columns(part, held_out_set)._asdict()
                scores += fold_scores(part_scores, key._replace(model=model, **columns))
            train_cpu_s = result.cost.train_cpu_s
            costs.append(ScoreRow("train_cpu_s", COST, train_cpu_s, key._replace(model=model)))
    return Outcome((score_table(scores, TITLE),), (score_table(costs, TITLE),))


def evaluated(
    inputs: Inputs, variant: NamedVariant, data: VariantData, model: str
) -> CrossValidation:
    """Return the cross-validation of a model with a variant. A random split has no further tests,
    because each of their grasps could be in the training data."""
    from ajgdata.evaluate.crossval import cross_validate
    from ajgdata.evaluate.splits import column_folds, random_folds

    task = inputs.task_settings
    known = data.known
    is_grouped = variant.change.split == "grouped"
    if is_grouped:
        folds = column_folds(
            known.value, known.group, task.groups, task.kind, task.folds, inputs.seed
        )
    else:
        folds = random_folds(known.value, task.kind, task.folds, inputs.seed)
    return cross_validate(
        known.feature,
        known.value,
        known.group if is_grouped else None,
        kind=task.kind,
        model=model,
        folds=folds,
        seed=inputs.seed,
        period=task.period_deg,
        extra_tests=data.tests if is_grouped else None,
    )


EXPERIMENT = Experiment(
    name=VARIANTS,
    order=70,
    title=TITLE,
    settings=Settings,
    measure=measure,
    plots=plots,
    summary=summary,
    division=ByFile(),
    reads_recordings=True,
    renders=True,
)
