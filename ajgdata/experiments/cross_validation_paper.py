"""Cross-validation compared with the paper: verdicts on known, withheld and other values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ajgdata.evaluate.agreement import PaperVerdict, joint_verdict
from ajgdata.evaluate.parts import GROUPED, RANDOM
from ajgdata.experiments.base import Lookup, TaskResults
from ajgdata.experiments.cross_validation_results import (
    ModelResult,
    best_of,
    controls,
    marks_of,
    models_of,
)
from ajgdata.experiments.silence_tests import silence_tests
from ajgdata.report.comparison import (
    NEAR_CHANCE,
    PaperComparison,
    PaperFigure,
    holds,
    judged,
    mark_of,
)
from ajgdata.report.format import Score, number, with_unit
from ajgdata.types.registry import BASELINE, PAPER_MODEL

#: Row of the paper on a task of many models: its number is that of the baseline.
BASELINES = "baselines"
#: Metrics of published statements without a number: a model fails on data of another kind.
FAILS = ("limit", "lesson")
#: Tested grasps of each split in everyday words, for the name of a row.
TESTED_GRASPS = {"grouped split": "new grasps", "random split": "grasps also in training"}
#: Row of the paper that also counts the classes with at least this accuracy.
COUNTED = "ycb"
MIN_ACCURACY = 0.9


def paper_comparison(results: TaskResults, lookup: Lookup) -> Iterator[PaperComparison]:
    """Yield known, unknown and overall values, and other data sets, by the paper's model."""
    models = models_of(results)
    by_name = {model.result.model: model for model in models}
    for part, paper in models[0].parts:
        if paper is None:
            continue
        name = BASELINE if paper.id == BASELINES else PAPER_MODEL
        model = by_name.get(name, by_name.get(PAPER_MODEL, models[0]))
        if paper.metric in FAILS:
            yield _failing(paper, model, part, lookup)
        else:
            yield _compared(paper, model, models, part)


def _compared(
    paper: PaperFigure, model: ModelResult, models: Sequence[ModelResult], part: str
) -> PaperComparison:
    """Return a model on a part and the paper's number, with the interval that decides."""
    text = model.shown(model.with_interval(part), part)
    if paper.id == BASELINES:
        best = best_of(models)
        text += f"; lowest error of {len(models)}: {best.label}, {best.shown(best.score())}"
    if paper.id == COUNTED:
        true, predicted = model.predictions()
        shares = [np.mean(predicted[true == name] == name) for name in np.unique(true)]
        count = sum(share >= MIN_ACCURACY for share in shares)
        text += f"; {count} of {len(shares)} classes at 90 % or more"
    mirror = model.mirror_errors(part)
    if mirror is not None:
        nearer = with_unit(number(mirror.nearer_error), paper.unit)
        text += (
            f"; {nearer} to the nearer of angle and mirror image"
            f" ({number(100 * mirror.share)} % are nearer to the image)"
        )
    published = paper.value
    chance = model.chance(part)
    if paper.text == NEAR_CHANCE:
        published = model.task.scale * chance
    verdict: PaperVerdict = "inconclusive"
    remark = ""
    if published is not None:
        scale = model.task.scale
        verdict, remark = judged(paper, model.estimate(part), published / scale, scale=scale)
    split = split_name(model, part)
    label = ", ".join(filter(None, (paper.row, TESTED_GRASPS[split]))) if split else ""
    return model.task.compared(
        paper,
        text,
        model.label,
        verdict,
        remark=remark,
        cost=model.cost,
        marks=marks_of(models, model, part),
        split=split,
        label=label,
        shown_unit=model.task.shown_unit,
        controls=controls(model, part),
    )


def split_name(model: ModelResult, part: str) -> str:
    """Return the split of known values if the paper is compared with both splits, else ""."""
    papers = dict(model.parts)
    if part not in (GROUPED, RANDOM) or not (papers.get(GROUPED) and papers.get(RANDOM)):
        return ""
    return "grouped split" if part == GROUPED else "random split"


def _failing(paper: PaperFigure, model: ModelResult, part: str, lookup: Lookup) -> PaperComparison:
    """Return the score of a model on its own data and on a part where it fails.

    The text also has whether the test on silence flags the model.
    """
    score = model.score(part)
    scale = model.task.scale
    verdicts = {holds(Score(model.error(part) - model.error(), model.score().sd))}
    text = f"{model.shown(model.score())} where it was trained, {model.shown(score)} elsewhere"
    flags = _flags(model, lookup)
    if flags:
        verdicts.add("agrees" if any(flags) else "disagrees")
        text += f"; from silence {'flagged' if any(flags) else 'not flagged'}"
    ours = mark_of("ours", model.with_interval(part), scale)
    marks = ours, mark_of("chance", Score(model.chance(), 0.0), scale)
    return model.task.compared(
        paper,
        text,
        model.label,
        joint_verdict(verdicts),
        cost=model.cost,
        marks=marks,
        shown_unit=model.task.shown_unit,
    )


def _flags(model: ModelResult, lookup: Lookup) -> list[bool]:
    """Return whether the test on silence flags the model, for each tested data set."""
    task = model.task.dataset, model.task.task
    results = lookup("shortcut", *task)
    if results is None or (results.dataset, results.task) != task:
        return []
    tests = silence_tests(results)
    return [row["flagged"] for result, row in tests if result.model == model.result.model]
