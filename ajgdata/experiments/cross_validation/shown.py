"""Cross-validation in words: rows of the table of results, and what the paper says."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ajgdata.evaluate.agreement import NO_BETTER, Verdict, together
from ajgdata.experiments.base import Lookup, TaskResults
from ajgdata.experiments.cross_validation.results import (
    BASELINES,
    GROUPED,
    PAPER_MODEL,
    RANDOM,
    WITHHELD,
    ModelResult,
    best_of,
    close_to_best,
    models_of,
    part_label,
)
from ajgdata.report.blocks import ResultRow
from ajgdata.report.comparison import NEAR_CHANCE, Cost, Mark, PaperComparison, holds, mark_of
from ajgdata.report.format import Score, number, words
from ajgdata.report.paper import PaperFigure

#: The model whose figure the paper gives among its baselines.
BASELINE = "knn_plain"
#: Figures without a number: what a model that works at home fails at.
FAILS = ("limit", "lesson")
#: Where the paper also counts the classes that are told this well.
COUNTED, WELL = "ycb", 0.9


def rows(results: TaskResults) -> Iterator[ResultRow]:
    """Yield a row for each model on the grouped split, then on each further part."""
    models = models_of(results)
    close = close_to_best(models) if models else []
    for model in models:
        train_s, inference_ms, memory_mb = map(number, model.cost)
        answer = _with_chance_note(model, GROUPED, model.with_interval())
        yield ResultRow(
            model.label, results.metric_title, _with_chance_note(model, GROUPED, model.score()),
            model.shown_chance, train_s, inference_ms, memory_mb, best=model in close,
            paper=results.papers.get("known"), answer=answer if model is best_of(models) else "",
        )  # fmt: skip
    for part in dict.fromkeys(part for model in models for part, _ in model.parts[1:]):
        name = {WITHHELD: "unknown", RANDOM: "known by recording"}.get(part, part)
        name = name.removeprefix("on:")
        for model in (one for one in models if one.has(part)):
            yield ResultRow(
                model.label,
                f"{results.metric_title}, {words(name)}",
                _with_chance_note(model, part, model.score(part)),
                model.shown(Score(model.chance(part), 0.0)),
                part=part_label(results, part),
                paper=dict(model.parts)[part],
            )


def _with_chance_note(model: ModelResult, part: str, score: Score) -> str:
    """Return the score of a part; of a score that is not better than chance, with these words."""
    text = model.shown(score)
    return text if model.beats_chance(part) else f"{text}, {NO_BETTER}"


def summary(results: TaskResults) -> str:
    """Return what was evaluated, and which model is best, in two sentences."""
    models = models_of(results)
    if not models:
        return ""
    first, top = models[0], best_of(models)
    unit = f" in {results.unit}" if results.unit else ""
    counts = f"{first.count('recordings'):,} recordings in {first.count('groups'):,} groups"
    near = ", ".join(m.label for m in close_to_best(models) if m is not top)
    near = f"; within its standard deviation: {near}" if near else ""
    thinned = "; ".join(f"{m.label} on {m.thinned}" for m in models if m.thinned)
    thinned = f" Recordings of a fold that were trained on: {thinned}." if thinned else ""
    return (
        f"{results.kind.capitalize()} of {results.target}{unit} from {counts} "
        f"({results.groups}), {first.count('folds')} folds. "
        f"Lowest error: {top.label}, {results.metric_title} {top.shown()}{near}.{thinned}"
    )


def paper_comparison(results: TaskResults, lookup: Lookup) -> Iterator[PaperComparison]:
    """Yield known, unknown and overall values, and other data sets, by the paper's model."""
    models = models_of(results)
    by_name = {one.result.model: one for one in models}
    for part, paper in models[0].parts if models else ():
        if paper is None:
            continue
        named = BASELINE if paper.id == BASELINES else PAPER_MODEL
        model = by_name.get(named, by_name.get(PAPER_MODEL, models[0]))
        if paper.metric in FAILS:
            yield _failing(paper, model, part, lookup)
        else:
            yield _compared(paper, model, models, part)


def _compared(
    paper: PaperFigure, model: ModelResult, models: tuple[ModelResult, ...], part: str
) -> PaperComparison:
    """Return a model on a part beside the paper's, with the interval that decides."""
    text = _with_chance_note(model, part, model.with_interval(part))
    if paper.id == BASELINES:
        best = best_of(models)
        text = f"{text}; lowest error of {len(models)}: {best.label}, {best.shown()}"
    if paper.id == COUNTED:
        text = f"{text}; {_well_told(model)}"
    published = paper.value
    if paper.text == NEAR_CHANCE:
        published = model.task.scale * model.chance(part)
    split, note = _of_two_splits(model, part)
    return model.task.compared(
        paper, text, model.label,
        "inconclusive" if published is None else model.verdict(part, published),
        cost=Cost(*model.cost[:2]), marks=marks_of(models, model, part), split=split, note=note,
        label=f"known, {split}" if split else "", shown_unit=model.task.shown_unit,
    )  # fmt: skip


def _of_two_splits(model: ModelResult, part: str) -> tuple[str, str]:
    """Return how known values were split and what that makes of them, where two splits of them
    stand beside the paper: "" else."""
    papers = dict(model.parts)
    if part not in (GROUPED, RANDOM) or not (papers.get(GROUPED) and papers.get(RANDOM)):
        return "", ""
    group = words(model.task.groups.removesuffix("_id"))
    if part == GROUPED:
        return f"by {group}", f"No {group} is on both sides of the split."
    copies = model.count("recordings") / model.count("groups")
    lost = model.error.mean - model.normalise(model.score(RANDOM)).mean
    share = lost / model.error.mean if model.error.mean > 0 else 0.0
    hides = "hides no error here" if share <= 0 else f"hides {100 * share:.0f} % of the error"
    return (
        "by recording",
        f"There are {number(copies, 2)} recordings of a {group}, and others of the one that is "
        f"tested may be trained on: that {hides} ({model.shown(model.score(RANDOM))} against "
        f"{model.shown(model.score(GROUPED))} by {group}).",
    )


def marks_of(
    models: tuple[ModelResult, ...], first: ModelResult, part: str = GROUPED
) -> tuple[Mark, ...]:
    """Return a model, the best of the others and chance on a part of a task, as they are drawn."""
    scale = first.task.scale
    marks = [mark_of("ours", first.with_interval(part), scale)]
    if others := tuple(m for m in models if m.result.model != first.result.model and m.has(part)):
        best = min(others, key=lambda m: m.normalise(m.score(part)).mean)
        marks.append(mark_of("baseline", best.with_interval(part), scale))
    if math.isfinite(chance := first.chance(part)):
        marks.append(mark_of("chance", Score(chance, 0.0), scale))
    return tuple(marks)


def _well_told(model: ModelResult) -> str:
    """Return `7 of 16 classes at 90 % or more`, of the recordings held out in all folds."""
    held_out = model.predictions(GROUPED)
    true, predicted = held_out.y_true, held_out.y_pred
    shares = [np.mean(predicted[true == one] == one) for one in np.unique(true)]
    return f"{sum(share >= WELL for share in shares)} of {len(shares)} classes at 90 % or more"


def _failing(paper: PaperFigure, model: ModelResult, part: str, lookup: Lookup) -> PaperComparison:
    """Return a model where it was trained and where it fails, and what silence says of it."""
    there, scale = model.score(part), model.task.scale
    worse = model.normalise(there).mean - model.error.mean
    verdicts: set[Verdict] = {holds(Score(worse, model.error.sd))}
    text = f"{model.shown()} where it was trained, {model.shown(there)} elsewhere"
    flags = _flags(model, lookup)
    if flags:
        verdicts.add("agrees" if any(flags) else "disagrees")
        text += f"; from silence {'flagged' if any(flags) else 'not flagged'}"
    chance = Score(model.chance(), 0.0)
    marks = mark_of("ours", there, scale), mark_of("chance", chance, scale)
    more = {"cost": Cost(*model.cost[:2]), "marks": marks, "shown_unit": model.task.shown_unit}
    return model.task.compared(paper, text, model.label, together(verdicts), **more)


def _flags(model: ModelResult, lookup: Lookup) -> list[bool]:
    """Return whether the test on silence flags the model, for each data set that it is asked."""
    where = model.task.dataset, model.task.task
    test = lookup("shortcut", *where)
    from ajgdata.evaluate.shortcut_test import LEVEL

    if test is None or (test.dataset, test.task) != where:
        return []
    tests = [
        (result.model, p)
        for result in test.results
        for p in result.tables["silence"].numbers("p").tolist()
    ]
    corrected = test.corrected([p for _, p in tests])
    own = (name == model.result.model for name, _ in tests)
    return [p < LEVEL for p, is_own in zip(corrected, own, strict=True) if is_own]
