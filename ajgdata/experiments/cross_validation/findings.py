"""What cross-validation found, each in a sentence: titles of figures, and words for those who
cannot see them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from ajgdata.evaluate.sessions import ACROSS, AS_MANY, WITHIN
from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation.results import (
    GROUPED,
    RANDOM,
    ModelResult,
    best_of,
    models_of,
)
from ajgdata.report.format import number, with_unit, words
from ajgdata.types import Level


def model_finding(model: ModelResult) -> str:
    """Return how well a model does where the group is new, beside chance."""
    reached, guess = model.shown(), model.shown_chance
    new = f"where the {words(model.task.groups.removesuffix('_id'))} is new"
    said = {"regression": f"errs by {reached}", "classification": f"is right in {reached}"}
    told = said[model.task.kind]
    if model.beats_chance():
        return f"{model.label} {told} {new}; chance is {guess}"
    return (
        f"{model.label} is not better than chance: it {told} {new}, a guess {_guess(model)} {guess}"
    )


def _guess(model: ModelResult) -> str:
    return "by" if model.task.kind == "regression" else "in"


def confusion_finding(model: ModelResult) -> str:
    """Return how well a model tells classes, and which two it confuses most."""
    pair = most_confused(model)
    mistaken = f"; most often it takes {words(pair[0])} for {words(pair[1])}" if pair else ""
    return f"{model_finding(model)}{mistaken}"


def most_confused(model: ModelResult) -> tuple[str, str, int] | None:
    """Return the true class that is most often taken for another, this other, and how often.

    Of equals the first in the alphabet; None if there are no mistakes.
    """
    held_out = model.predictions()
    pairs = zip(map(str, held_out.y_true), map(str, held_out.y_pred), strict=True)
    confusions = Counter(sorted((true, taken) for true, taken in pairs if true != taken))
    if not confusions:
        return None
    ((true, taken), count) = confusions.most_common(1)[0]
    return true, taken, count


def level_finding(results: TaskResults) -> str:
    """Return from which level on no model beats chance, or what the best one does at both ends."""
    models = models_of(results)
    top, by_level = best_of(models), [model.levels() for model in models]
    levels = [level for level, _ in top.levels()]
    best = [
        min(model.normalise(of[i][1]).mean for model, of in zip(models, by_level, strict=True))
        for i in range(len(levels))
    ]
    lost = len(levels)
    while lost and best[lost - 1] >= 1:
        lost -= 1
    (first, at_first), (last, at_last) = top.levels()[0], top.levels()[-1]
    if 0 < lost < len(levels):
        start = f"{top.label}: {top.shown(at_first)} at {_at(first)}"
        return f"From {_at(levels[lost])} on no model beats chance ({start})"
    return (
        f"{top.label}: {top.shown(at_first)} at {_at(first)}, {top.shown(at_last)} at {_at(last)}; "
        f"chance is {top.shown_chance}"
    )


def _at(level: Level) -> str:
    return with_unit(number(level.value), level.unit)


def tradeoff_finding(results: TaskResults) -> str:
    """Return which model errs least, and the fastest that nothing beats."""
    models = models_of(results)
    top = best_of(models)
    quick = min(models, key=lambda model: model.cost.train_s)
    least = f"{top.label} errs least of {len(models)} models ({top.shown()})"
    if quick is top:
        return f"{least} and trains fastest"
    ratio = top.cost.train_s / quick.cost.train_s if quick.cost.train_s > 0 else np.inf
    faster = f"{number(ratio, 2)} times as fast" if np.isfinite(ratio) else "fastest"
    return f"{least}; {quick.label} trains {faster} ({quick.shown()})"


def split_finding(compared: Sequence[ModelResult]) -> str:
    """Return how much of the error a split hides that ignores the groups."""
    hidden = [share for _, share in lost_shares(compared, RANDOM, GROUPED)]
    if not hidden:
        return "Random and grouped splits beside each other"
    low, high = (f"{100 * share:.0f}" for share in (min(hidden), max(hidden)))
    if max(hidden) <= 0:
        return "A split that ignores the groups hides no error here"
    told = f"{high} %" if low == high else f"{low} to {high} %".replace("-", "−")
    return f"A split that ignores the groups hides {told} of the error"


def session_finding(compared: Sequence[ModelResult]) -> str:
    """Return where a new session is read worse, by as many grasps to learn from, than its own."""
    shares = [
        share
        for model in compared
        for _, share in lost_shares([model], WITHIN, AS_MANY if model.has(AS_MANY) else ACROSS)
    ]
    if not shares:
        return "Within and across sessions beside each other"
    if max(shares) <= 0:
        return "A new session is read no worse than a known one here"
    worse = sum(share > 0 for share in shares)
    return f"A new session is read worse in {worse} of {len(shares)} cases"


def lost_shares(
    compared: Sequence[ModelResult], first: str, last: str
) -> list[tuple[ModelResult, float]]:
    """Return models, each with the share of its error on the part `last` that `first` does not
    show."""
    shares = []
    for model in compared:
        shown, true = (model.normalise(model.score(part)).mean for part in (first, last))
        if true > 0:
            shares.append((model, 1 - shown / true))
    return shares


def cost_finding(tasks: Sequence[tuple[ModelResult, ...]], time: str, doing: str) -> str:
    """Return which model errs least on most tasks, and which is fastest at `doing`."""
    several = [models for models in tasks if len(models) > 1]
    if not several:
        only = ", ".join(dict.fromkeys(model.label for models in tasks for model in models))
        return f"Error against run time: {only}"
    best = Counter(best_of(models).result.model for models in several)
    fast = Counter(
        min(models, key=lambda model: getattr(model.cost, time)).result.model for models in several
    )
    (winner, won), (quick, count) = best.most_common(1)[0], fast.most_common(1)[0]
    if len(several) == 1:
        if winner == quick:
            return f"{_called(several, winner)} errs least and {doing} fastest"
        return f"{_called(several, winner)} errs least, {_called(several, quick)} {doing} fastest"
    return (
        f"{_called(several, winner)} errs least on {won} of {len(several)} tasks, "
        f"{_called(several, quick)} {doing} fastest on {count}"
    )


def _called(tasks: Sequence[tuple[ModelResult, ...]], name: str) -> str:
    """Return the names of a model for people: it may have one for each kind of task."""
    found = (model.label for models in tasks for model in models if model.result.model == name)
    return " / ".join(dict.fromkeys(found))
