"""Transfer: scores on left-out groups of recordings, with normalisation and alignment per group."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ajgdata.evaluate.agreement import (
    GRASP_INTERVAL,
    NARROW,
    Estimate,
    Interval,
    placebo_test,
)
from ajgdata.evaluate.fold_tests import SIGNIFICANCE_LEVEL, holm, paired_fold_test
from ajgdata.evaluate.metrics import METRICS, perfect_value
from ajgdata.evaluate.parts import PLACEBO_VALUES, TRAINING_VALUES
from ajgdata.evaluate.task_data import TaskData, column_labels, grasp_names
from ajgdata.evaluate.transfer import (
    Adaptation,
    GroupScores,
    TransferPoint,
    group_scores,
    leave_groups_out,
)
from ajgdata.experiments.base import Experiment, Inputs, Outcome, TaskResults
from ajgdata.experiments.built_in import BUILT_IN
from ajgdata.experiments.plots import MODEL_COLUMN, Plot
from ajgdata.experiments.scores import ScoreKey, ScoreRow, score_table
from ajgdata.experiments.settings import TransferSettings
from ajgdata.report.format import number, sentence, with_unit, words
from ajgdata.store.features import FeatureRows
from ajgdata.store.metrics import COST
from ajgdata.types import NotPossibleError
from ajgdata.types.table import Table, table_of

#: Adaptation of features that are used as they are.
UNCHANGED = Adaptation(is_normalised=False, labelled=0)
#: Names of the tables of left-out groups, of their means, and of gains of adaptations.
GROUPS = "left_out"
MEANS = "means"
GAINS = "gains"
GROUP_COLUMNS = {
    "left_out": "Left out",
    "training_groups": "Training groups",
    "adaptation": "Adaptation",
    "metric": "Metric",
    "value": "Value",
}
MEAN_COLUMNS = {
    "training_groups": "Training groups",
    "adaptation": "Adaptation",
    "metric": "Metric",
    "value": "Value",
    "low": "Lower end of the 95 % interval",
    "high": "Upper end",
    "chance": "Chance",
    "placebo": "Placebo",
    "verdict": "Verdict",
}
GAIN_COLUMNS = {
    "adaptation": "Adaptation",
    "gain": "Gain",
    "low": "Lower end of the 95 % interval",
    "high": "Upper end",
    "p": "p, uncorrected",
    "chance": "Chance",
}


class TransferCase(NamedTuple):
    """Number of training groups, and adaptation of the features."""

    training_groups: int
    adaptation: Adaptation


def measure(inputs: Inputs, settings: TransferSettings, model: str) -> Outcome:
    """Return the scores of `model` on each left-out group, by training groups and adaptation."""
    begun = time.process_time()
    data = inputs.data()
    cases = _measured_cases(inputs, settings, model, data, inputs.store, settings.groups)
    unmeasured = ""
    placebo: dict[Adaptation, GroupScores] = {}
    try:
        placebo = _placebo_scores(inputs, settings, model)
    except NotPossibleError as error:
        unmeasured = str(error)
    spent = time.process_time() - begun
    metric = METRICS[inputs.task_settings.kind][0]
    split = f"leave one {settings.leave_out} out"
    scores: list[ScoreRow] = []
    groups: list[dict[str, Any]] = []
    means: list[dict[str, Any]] = []
    for case, result in cases.items():
        key = _score_key(case, model, split, inputs.dataset, TRAINING_VALUES)
        scores += _score_rows(result, metric, key)
        about = {
            "training_groups": case.training_groups,
            "adaptation": adaptation_text(case.adaptation),
        }
        groups += [
            {**about, "left_out": name, "metric": metric, "value": own[metric]}
            for name, own in result.per_group.items()
        ]
        control = placebo.get(case.adaptation)
        means.append(
            {
                **about,
                "metric": metric,
                "value": result.value,
                "low": result.interval.low,
                "high": result.interval.high,
                "chance": result.chance,
                "placebo": None if control is None else control.value,
                "verdict": chance_verdict(result, control, metric),
            }
        )
    all_groups = max(case.training_groups for case in cases)
    for adaptation, result in placebo.items():
        case = TransferCase(all_groups, adaptation)
        key = _score_key(case, model, split, settings.placebo or inputs.dataset, PLACEBO_VALUES)
        scores += _score_rows(result, metric, key)
    cost = [ScoreRow("train_and_predict_s", COST, spent, ScoreKey(model))]
    title = "Left-out groups"
    gain_rows = _gains(cases, metric)
    return Outcome(
        (
            score_table(scores, title),
            table_of(GROUPS, title, groups, **GROUP_COLUMNS),
            table_of(MEANS, "Means over left-out groups", means, **MEAN_COLUMNS),
            table_of(GAINS, "Gains of adaptations", gain_rows, **GAIN_COLUMNS),
        ),
        (score_table(cost, title),),
        {"placebo_problem": unmeasured},
    )


def _measured_cases(
    inputs: Inputs,
    settings: TransferSettings,
    model: str,
    data: TaskData,
    table: FeatureRows,
    sizes: Sequence[int],
) -> dict[TransferCase, GroupScores]:
    """Return the scores of recordings `data` of `table`, by training groups and adaptation.

    The sizes are `sizes`, and all groups that are not left out.
    """
    group = _left_out_labels(table, data, settings.leave_out)
    adaptations = [
        Adaptation(normalise == "group", labelled)
        for normalise in settings.normalise
        for labelled in settings.align
    ]
    points = leave_groups_out(
        data,
        group,
        grasp_names(table, data),
        kind=inputs.task_settings.kind,
        model=model,
        sizes=sorted({*sizes, len(np.unique(group)) - 1}),
        adaptations=adaptations,
        repeats=settings.repeats,
        seed=inputs.seed,
        period=inputs.task_settings.period_deg,
        balance=inputs.task_settings.balance,
    )
    by_case: dict[TransferCase, list[TransferPoint]] = {}
    for point in points:
        by_case.setdefault(TransferCase(point.training_groups, point.adaptation), []).append(point)
    return {
        case: group_scores(
            own,
            inputs.task_settings.kind,
            period=inputs.task_settings.period_deg,
            seed=inputs.seed,
        )
        for case, own in by_case.items()
    }


def _left_out_labels(table: FeatureRows, data: TaskData, column: str) -> np.ndarray:
    """Return the group (n,) of each recording, the text in a column.

    Raises NotPossibleError if there is no such column, for a recording without text, and for a
    single group.
    """
    if column not in table.columns:
        raise NotPossibleError(
            f"experiments.transfer.leave_out: there is no column {column!r}; add it to "
            "recordings.csv, or choose another"
        )
    labels = column_labels(table, data, column)
    is_missing = np.isin(labels, ["", "nan"])
    if is_missing.any():
        name = str(data.name[is_missing][0])
        raise NotPossibleError(f"recording {name!r} has no {column!r}, which transfer leaves out")
    if len(np.unique(labels)) < 2:
        raise NotPossibleError(f"all recordings have the same {column!r}: none can be left out")
    return labels


def _placebo_scores(
    inputs: Inputs, settings: TransferSettings, model: str
) -> dict[Adaptation, GroupScores]:
    """Return the scores of one object under several names; empty if there is no placebo.

    All groups of the placebo that are not left out are in the training part.
    """
    data = inputs.placebo_data(settings.placebo)
    if data is None:
        return {}
    table = inputs.store if settings.placebo is None else inputs.other_sets[settings.placebo]
    cases = _measured_cases(inputs, settings, model, data, table, ())
    return {case.adaptation: result for case, result in cases.items()}


def _score_key(case: TransferCase, model: str, split: str, test_set: str, values: str) -> ScoreKey:
    """Return the columns that identify the scores of a case."""
    return ScoreKey(
        model,
        split,
        test_set,
        values,
        grasps=case.adaptation.labelled,
        comparison="normalised per group" if case.adaptation.is_normalised else "not normalised",
        condition=f"{case.training_groups} training groups",
    )


def _score_rows(result: GroupScores, metric: str, key: ScoreKey) -> Iterator[ScoreRow]:
    """Yield the metrics of each left-out group, and mean, intervals and chance of the first."""
    for name, own in result.per_group.items():
        for each, value in own.items():
            yield ScoreRow(each, f"group {name}", value, key)
    yield ScoreRow(metric, "mean", result.value, key)
    yield ScoreRow(metric, "chance", result.chance, key)
    for statistic, value in zip(("low", "high"), result.over_groups, strict=True):
        yield ScoreRow(metric, statistic, value, key)
    for statistic, value in zip(GRASP_INTERVAL, result.over_grasps, strict=True):
        yield ScoreRow(metric, statistic, value, key)


def _gains(cases: dict[TransferCase, GroupScores], metric: str) -> Iterator[dict[str, Any]]:
    """Yield the gain of each adaptation with all training groups, group by group."""
    largest = max(case.training_groups for case in cases)
    before = cases[TransferCase(largest, UNCHANGED)]
    for case, after in cases.items():
        if case.training_groups == largest and case.adaptation != UNCHANGED:
            pair = [
                [own[metric] for own in scores.per_group.values()] for scores in (before, after)
            ]
            test = paired_fold_test(*pair, metric=metric, paired=True)
            yield {
                "adaptation": adaptation_text(case.adaptation),
                "gain": test.gain,
                "low": test.low,
                "high": test.high,
                "p": test.p,
                "chance": before.chance,
            }


def adaptation_text(adaptation: Adaptation) -> str:
    """Return an adaptation for people.

    >>> adaptation_text(Adaptation(True, 4))
    'normalised, aligned with 4 grasps'
    """
    texts = []
    if adaptation.is_normalised:
        texts.append("normalised")
    if adaptation.labelled:
        grasps = "1 grasp" if adaptation.labelled == 1 else f"{adaptation.labelled} grasps"
        texts.append(f"aligned with {grasps}")
    return ", ".join(texts) or "unchanged"


def group_noun(column: str) -> str:
    """Return what a column names, for people: `session_id` is the column of a session."""
    return words(column.removesuffix("_id"))


def chance_verdict(result: GroupScores, placebo: GroupScores | None, metric: str) -> str:
    """Return whether scores are better than chance and than the placebo, if there is one.

    Without an interval, nothing is concluded.
    """
    if not result.interval.is_defined:
        return "inconclusive"
    score = _estimate(result, metric)
    is_better = score.is_better_than_chance
    if placebo is not None:
        is_better = placebo_test(score, _estimate(placebo, metric)).is_better
    if is_better:
        return "better than chance"
    worst_end = result.interval.low if score.perfect < score.chance else result.interval.high
    is_worse = (worst_end - score.chance) * (score.perfect - score.chance) < 0
    return "worse than chance" if is_worse else "inconclusive"


def _estimate(result: GroupScores, metric: str) -> Estimate:
    """Return the mean over groups with its wider interval."""
    return Estimate(result.value, result.interval, result.chance, perfect_value(metric))


class Gain(NamedTuple):
    """Gain of an adaptation of a model, in shown units, with corrected p value and verdict."""

    model: str
    adaptation: str
    gain: float
    interval: Interval
    p: float
    verdict: str


def gains(results: TaskResults) -> list[Gain]:
    """Return the gains of all models on a task. p values are corrected for the page (Holm).

    The verdict is better or worse if p is below the level of significance. Otherwise it is *no
    difference* if the interval is narrow (see `agreement.NARROW`), and *inconclusive* if it is wide
    or undefined.
    """
    rows = [
        (result, row)
        for task in results.same_page or (results,)
        for result in task.results
        for row in result.tables[GAINS].rows
    ]
    values = [np.nan if row["p"] is None else row["p"] for _, row in rows]
    perfect = perfect_value(results.metric)
    described = []
    for (result, row), p in zip(rows, holm(values), strict=True):
        if result not in results.results:
            continue
        low, high = (np.nan if row[key] is None else row[key] for key in ("low", "high"))
        verdict = "inconclusive"
        if p < SIGNIFICANCE_LEVEL:
            verdict = "better" if row["gain"] > 0 else "worse"
        elif high - low < NARROW * abs(perfect - row["chance"]):
            verdict = "no difference"
        described.append(
            Gain(
                result.label,
                row["adaptation"],
                results.scale * row["gain"],
                Interval(low, high).scaled(results.scale),
                p,
                verdict,
            )
        )
    return described


def summary(results: TaskResults) -> str:
    """Return each model's score on left-out groups with its verdict, and the gains."""
    noun = group_noun(results.settings.leave_out)
    unit = results.shown_unit
    texts = []
    for result in results.results:
        table = result.tables[MEANS]
        row = with_all_groups(table).where(adaptation="unchanged").rows[0]
        value = shown(row["value"], results, 3)
        chance = shown(row["chance"], results, 3)
        texts.append(
            f"{result.label} on a left-out {noun}: {results.metric_title} {value}, chance level "
            f"{chance}: {row['verdict']}."
        )
        if result.about["placebo_problem"]:
            texts.append(f"No placebo: {result.about['placebo_problem']}.")
    described = gains(results)
    for gain in described:
        value = with_unit(number(gain.gain), unit)
        low, high = (number(end) for end in gain.interval)
        texts.append(
            f"{gain.model}, {gain.adaptation}: gain {value} ({low} to {high}), "
            f"p = {number(gain.p, 2)}: {gain.verdict}."
        )
    if described:
        texts.append(
            "Gains are paired by left-out group, and p is corrected for all gains on this page "
            "(Holm)."
        )
    return " ".join(texts)


def finding(results: TaskResults) -> str:
    """Return what the paper's model, or the first one, reaches on a new group.

    The score with the last adaptation has the verdict on its gain. The chance level is given if
    this score is not better.
    """
    result = results.first_result
    table = result.tables[MEANS]
    rows = with_all_groups(table).rows

    last = rows[-1]
    noun = group_noun(results.settings.leave_out)
    text = f"{result.label}, new {noun}: {shown(rows[0]['value'], results)}"
    for gain in gains(results):
        if (gain.model, gain.adaptation) == (result.label, last["adaptation"]):
            text += f", {gain.adaptation} {shown(last['value'], results)} ({gain.verdict})"
    if last["verdict"] != "better than chance":
        text += f"; chance {shown(last['chance'], results)}"
    return sentence(text)


def with_all_groups(table: Table) -> Table:
    """Return the rows of the largest number of training groups."""
    return table.where(training_groups=max(table.column("training_groups")))


def shown(value: float, results: TaskResults, digits: int = 2) -> str:
    """Return a score with significant digits, in the shown unit."""
    return with_unit(number(results.scale * value, digits), results.shown_unit)


MEANS_PLOT = Plot(
    "lines",
    MEANS,
    "scores on each left-out group in turn, against the number of training groups; intervals for "
    "further groups and grasps",
    x="training_groups",
    series=("adaptation",),
    panel="model",
    over="",
    interval=("low", "high"),
    cells={"adaptation": "label"},
    metric="metric",
    chance="chance",
    title=finding,
    listed=True,
)


#: The same scores without an axis, for one number of training groups.
ROWS_PLOT = replace(
    MEANS_PLOT,
    mark="rows",
    about="scores on each left-out group in turn, trained on all other groups; intervals for "
    "further groups and grasps",
    x="adaptation",
    series=(MODEL_COLUMN.key,),
    panel="",
)


def group_table(results: TaskResults) -> Table:
    """Return the scores of each left-out group, with all other groups in the training part."""
    rows = [
        {"model": result.label, **row}
        for result in results.results
        for row in with_all_groups(result.tables[GROUPS]).rows
    ]
    return table_of(GROUPS, "Left-out groups", rows, model="Model", **GROUP_COLUMNS)


def group_finding(results: TaskResults) -> str:
    """Return the lowest and the highest score of a group, with the last adaptation."""
    result = results.first_result
    adaptation = result.tables[MEANS].rows[-1]["adaptation"]
    rows = group_table(results).where(model=result.label, adaptation=adaptation).rows
    ordered = sorted(rows, key=lambda row: float(row["value"]))
    ends = [
        f"{shown(row['value'], results)} on {row['left_out']}" for row in (ordered[0], ordered[-1])
    ]
    return sentence(f"{result.label}, {adaptation}: {' to '.join(ends)}")


GROUPS_PLOT = Plot(
    "rows",
    group_table,
    "score on each left-out group, trained on all other groups",
    x="left_out",
    series=("adaptation",),
    panel="model",
    over="",
    cells={"model": "label", "adaptation": "label", "left_out": "label"},
    metric="metric",
    title=group_finding,
    name="groups",
)


def plots(results: TaskResults) -> list[Plot]:
    """Return the scores over training groups (rows, if there is one number), and by group."""
    tables = [result.tables[MEANS] for result in results.results]
    numbers = {n for table in tables for n in table.column("training_groups")}
    if len(numbers) > 1:
        return [MEANS_PLOT, GROUPS_PLOT]
    return [ROWS_PLOT, GROUPS_PLOT]


EXPERIMENT = Experiment(BUILT_IN["transfer"], measure=measure, plots=plots, summary=summary)
