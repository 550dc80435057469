"""Variants: one evaluation with changed data, features, sound, split, model or scene.

Each file `reports/variants/<name>.yaml` of the project is measured in a job of its own. Its first
variant is the reference.
"""

from __future__ import annotations

import math

from ajgdata.evaluate.crossval import CrossValidation
from ajgdata.evaluate.parts import GROUPED, RANDOM, part_columns
from ajgdata.evaluate.splits import column_folds
from ajgdata.experiments.base import Experiment, Inputs, Outcome
from ajgdata.experiments.built_in import BUILT_IN
from ajgdata.experiments.cross_validation import cross_validated
from ajgdata.experiments.scores import ScoreKey, ScoreRow, fold_scores, score_table
from ajgdata.experiments.settings import VariantsSettings
from ajgdata.experiments.variant_data import FEATURE_S, VariantData, VariantRecordings
from ajgdata.experiments.variant_figures import plots, summary
from ajgdata.store.metrics import COST
from ajgdata.types.variants import NamedVariant

TITLE = "Variants"


def measure(inputs: Inputs, settings: VariantsSettings, name: str) -> Outcome:
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
            split = GROUPED if variant.change.split == "grouped" else RANDOM
            tests = {
                split: result.scores,
                **{part: tested.scores for part, tested in result.extra_tests.items()},
            }
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
    task = inputs.task_settings
    known = data.known
    if variant.change.split == "random":
        return cross_validated(inputs, model, known, None, folds=task.folds)
    folds = column_folds(known.value, known.group, task.groups, task.kind, task.folds, inputs.seed)
    return cross_validated(inputs, model, known, known.group, folds=folds, extra_tests=data.tests)


EXPERIMENT = Experiment(
    BUILT_IN["variants"],
    measure=measure,
    plots=plots,
    summary=summary,
)
