"""Cross-gripper: a task's models on other grippers, with a few of their grasps to calibrate."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ajgdata.evaluate.agreement import joint_verdict
from ajgdata.evaluate.few_grasps import cross_gripper
from ajgdata.evaluate.parts import GROUPED, elsewhere, part_columns
from ajgdata.experiments.base import Experiment, Inputs, Lookup, Outcome, TaskResults
from ajgdata.experiments.built_in import BUILT_IN
from ajgdata.experiments.plots import Plot, value_range
from ajgdata.experiments.scores import ScoreKey, ScoreRow, fold_statistic, score_table
from ajgdata.experiments.settings import CrossGripperSettings
from ajgdata.report.comparison import PaperComparison, holds, mark_of
from ajgdata.report.format import Score, mean_sd, number, with_unit
from ajgdata.types.table import table_of

#: Share of the skill on its own gripper above which a model counts as transferred.
TRANSFERRED_SKILL = 0.5
FOLD_COLUMNS = {
    "other": "Other gripper",
    "grasps": "Calibration grasps",
    "fold": "Fold",
    "metric": "Metric",
    "value": "Value",
    "chance": "Chance",
    "home": "At home",
    "recordings": "Recordings",
}


def measure(inputs: Inputs, settings: CrossGripperSettings, model: str) -> Outcome:
    """Return the errors of `model` on each other gripper for each number of calibration grasps."""
    grippers = {name: inputs.data(name) for name in settings.test_on}
    points = cross_gripper(
        inputs.data(),
        grippers,
        kind=inputs.task_settings.kind,
        model=model,
        sizes=settings.grasps,
        folds=inputs.task_settings.folds,
        seed=inputs.seed,
        period=inputs.task_settings.period_deg,
    )
    scores = []
    rows = []
    for name in settings.test_on:
        for point in points[name]:
            fold = fold_statistic(point.fold)
            for metric, value in point.scores.items():
                part = part_columns(elsewhere(name), inputs.dataset)
                key = ScoreKey(model, *part, grasps=point.grasps)
                scores.append(ScoreRow(metric, fold, value, key))
                rows.append(
                    {
                        "other": name,
                        "grasps": point.grasps,
                        "fold": point.fold,
                        "metric": metric,
                        "value": value,
                        "chance": point.chance[metric],
                        "home": point.own_scores.get(metric),
                        "recordings": point.recordings,
                    }
                )
            for metric, value in point.own_scores.items():
                part = part_columns(GROUPED, inputs.dataset)
                key = ScoreKey(model, *part, condition=f"grasps of {name}")
                scores.append(ScoreRow(metric, fold, value, key))
    title = "On another gripper"
    folds = table_of("folds", title, rows, **FOLD_COLUMNS)
    return Outcome((score_table(scores, title), folds))


GRIPPERS_PLOT = Plot(
    "lines",
    "folds",
    "models on another gripper, with a few of its grasps added to the training",
    x="grasps",
    panel="other",
    cells={"other": "data set"},
    metric="metric",
    chance="chance",
    listed=True,
)


def plots(results: TaskResults) -> list[Plot]:
    """Return the errors over calibration grasps, or per gripper if only one number was tried."""
    if len(results.settings.grasps) > 1:
        return [GRIPPERS_PLOT]
    (grasps,) = results.settings.grasps
    about = f"models on another gripper, with {grasps} of its grasps added to the training"
    if grasps == 0:
        about = "models on another gripper, without any of its grasps in the training"
    return [replace(GRIPPERS_PLOT, mark="rows", about=about, x="other", panel="", title=finding)]


def finding(results: TaskResults) -> str:
    """Return the error of the paper's model on its own gripper and on the others."""
    label = results.first_result.label
    home = next(iter(_home_scores(results, label).values()), Score(math.nan, math.nan))
    values = [point.score.mean for point in GRIPPERS_PLOT.bind(results).points_with(model=label)]
    own = with_unit(number(home.mean), results.shown_unit)
    range_text = value_range(values, results.shown_unit)
    return f"{label}: {results.metric_title} {own} on its gripper, {range_text} on others"


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield the paper's model at home, and on each other gripper without calibration."""
    if results.paper is None:
        return
    label = results.first_result.label
    grippers = GRIPPERS_PLOT.bind(results)
    points = grippers.points_with(model=label, grasps=min(results.settings.grasps))
    homes = _home_scores(results, label)
    sign = 1 if results.task_settings.kind == "classification" else -1
    gaps = [
        Score(sign * (homes[point.panel].mean - point.score.mean), homes[point.panel].sd)
        for point in points
        if point.panel in homes
    ]
    listed = [f"{mean_sd(point.score, results.shown_unit)} on {point.panel}" for point in points]
    home = homes.get(points[0].panel, Score(math.nan, math.nan))
    chance = float(np.mean(list(grippers.chance.values())))
    values = [point.score.mean for point in points]
    marks = (
        mark_of("ours", Score(sum(values) / len(values), math.nan)),
        mark_of("chance", Score(chance, 0.0)),
    )
    text = f"{mean_sd(home, results.shown_unit)} where it was trained, {', '.join(listed)}"
    yield results.compared(
        results.paper,
        text,
        label,
        joint_verdict({holds(gap) for gap in gaps}),
        marks=marks,
        label=results.dataset_title,
        shown_unit=results.shown_unit,
        remark=reason(results, label),
    )


def reason(results: TaskResults, label: str) -> str:
    """Return which other models keep more than half of their skill on a gripper; "" if none does.

    Skill is 0 at the chance level and 1 at the score on the model's own gripper. The verdict is
    only about the model `label`.
    """
    grippers = GRIPPERS_PLOT.bind(results)
    sign = 1 if results.task_settings.kind == "classification" else -1
    texts = []
    for result in results.results:
        if result.label == label:
            continue
        homes = _home_scores(results, result.label)
        points = grippers.points_with(model=result.label, grasps=min(results.settings.grasps))
        for point in points:
            home = homes.get(point.panel, Score(math.nan, math.nan)).mean
            chance = grippers.chance[point.panel]
            own_gain = sign * (home - chance)
            gain = sign * (point.score.mean - chance)
            if own_gain > 0 and gain > TRANSFERRED_SKILL * own_gain:
                value = mean_sd(point.score, results.shown_unit)
                own = with_unit(number(home), results.shown_unit)
                level = with_unit(number(chance), results.shown_unit)
                texts.append(
                    f"{result.label} has {value} on {point.panel} ({own} where it was trained,"
                    f" chance {level})"
                )
    if not texts:
        return ""
    return f"the verdict is about the paper's model, {label}; {'; '.join(texts)}"


def _home_scores(results: TaskResults, label: str) -> dict[str, Score]:
    """Return the metric of a model on its own gripper, as shown, by the other gripper."""
    scores = {}
    table = GRIPPERS_PLOT.bind(results).table.where(model=label)
    for name, rows in table.split_by("other").items():
        home = results.scale * rows.numbers("home")
        known = home[np.isfinite(home)]
        if len(known):
            sd = float(known.std(ddof=1)) if len(known) > 1 else math.nan
            scores[results.title_of(name)] = Score(float(known.mean()), sd)
    return scores


EXPERIMENT = Experiment(
    BUILT_IN["cross_gripper"],
    measure=measure,
    plots=plots,
    paper_comparison=paper_comparison,
)
