"""Shortcut: whether a model uses a sound that depends on the label, but not on the object.

The models of cross-validation predict recordings with the speaker silent, which contain no
information about the object (see `evaluate.shortcut_test`).
"""

from __future__ import annotations

import dataclasses

from ajgdata.evaluate.parts import GROUPED, elsewhere, part_columns
from ajgdata.evaluate.shortcut_test import shortcut_test
from ajgdata.experiments.base import Experiment, Inputs, Outcome, TaskResults
from ajgdata.experiments.built_in import BUILT_IN
from ajgdata.experiments.cross_validation import evaluate
from ajgdata.experiments.plots import Plot
from ajgdata.experiments.scores import ScoreKey, ScoreRow, score_table
from ajgdata.experiments.settings import ShortcutSettings
from ajgdata.experiments.silence_tests import silence_tests
from ajgdata.report.format import number
from ajgdata.types.table import table_of

TEST_COLUMNS = {
    "data_set": "Data set",
    "measure": "Measure",
    "value": "Dependence",
    "null": "By chance",
    "permutations": "Permutations",
    "p": "p, uncorrected",
}


def measure(inputs: Inputs, settings: ShortcutSettings, model: str) -> Outcome:
    """Return the dependence of predictions of `model` from silence on the target."""
    evaluation = evaluate(inputs, model, settings.test_on)
    scores: list[ScoreRow] = []
    tests = []
    for name in settings.test_on:
        predictions = evaluation.splits[GROUPED].extra_tests[elsewhere(name)].predictions
        test = shortcut_test(
            predictions.y_true,
            predictions.y_pred,
            predictions.fold,
            evaluation.data[elsewhere(name)].group[predictions.row],
            kind=inputs.task_settings.kind,
            period=inputs.task_settings.period_deg,
            seed=inputs.seed,
        )
        key = ScoreKey(model, *part_columns(elsewhere(name), inputs.dataset))
        scores += [
            ScoreRow(test.measure, "pooled", test.value, key),
            ScoreRow(test.measure, "chance", test.null, key),
            ScoreRow("p", f"of {test.permutations}", test.p, key),
        ]
        tests.append({"data_set": name, **dataclasses.asdict(test)})
    return Outcome(
        (
            score_table(scores, "Dependence of predictions from silence on the truth"),
            table_of("silence", "Tests of predictions from silence", tests, **TEST_COLUMNS),
        )
    )


def verdicts(results: TaskResults) -> str:
    """Return a sentence per test: dependence, chance, corrected p, and whether it is flagged."""
    tests = silence_tests(results)
    lines = [
        f"{result.label} on {results.other_sets[row['data_set']].title}: {row['measure']} with the "
        f"truth {number(row['value'], 2)}, {number(row['null'], 2)} with labels exchanged, "
        f"p = {number(row['p'], 2)}: {'flagged' if row['flagged'] else 'not flagged'}."
        for result, row in tests
    ]
    if not tests:
        return ""
    count = tests[0][1]["tests"]
    return f"{' '.join(lines)} p is corrected for the {count} tests on this page (Holm)."


DEPENDENCE_PLOT = Plot(
    "rows",
    "silence",
    "how far predictions from recordings with the speaker silent depend on the truth",
    x="data_set",
    cells={"data_set": "data set"},
    over="tests",
    chance="null",
)
EXPERIMENT = Experiment(
    BUILT_IN["shortcut"],
    measure=measure,
    plots=(DEPENDENCE_PLOT,),
    summary=verdicts,
)
