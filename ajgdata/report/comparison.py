"""One row beside the paper: a result, what it cost, and whether they agree.

Agreement is computed, never typed: a number agrees that lies within two standard deviations (over
folds, or over draws) of the paper's, which gives no spread of its own. Where these are as much as
the paper's number itself, none at all would agree as well: then it cannot be told.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from ajgdata.report.format import Score, Source, number
from ajgdata.report.paper import PaperFigure

YES, LOWER, HIGHER, UNTOLD = "yes", "no: lower", "no: higher", "no number to compare"
#: Of statements: it holds for some of what it is said of; it cannot be told from the spread.
PARTLY, UNCLEAR = "partly", "cannot be told: within the spread"
#: The same of numbers: ours is lower, or higher.
VAGUE = f"{UNCLEAR}, ours is lower", f"{UNCLEAR}, ours is higher"
#: What the paper says of a model that does no better than a guess.
NEAR_CHANCE = "near chance"
#: The verdict on a model that works where the paper's fails.
WORKS = "no: it works"
#: Standard deviations within which numbers agree.
REACH = 2.0


Role = Literal["ours", "baseline", "other", "paper", "chance"]


class Mark(NamedTuple):
    """A number as it is drawn beside the paper's, in the paper's unit, with its interval.

    `other` is what ours is held against where that is not a number of the paper; `part` names the
    row that it belongs to, where one result has several.
    """

    role: Role
    label: str
    value: float
    low: float
    high: float
    part: str = ""


def mark_of(role: Role, label: str, score: Score, scale: float = 1.0, part: str = "") -> Mark:
    """Return a mean with its interval, else its standard deviation on both sides; without one if it
    is unknown."""
    value, ((below,), (above,)) = scale * score.mean, score.bars(scale)
    return Mark(role, label, value, value - below, value + above, part)


def range_of(role: Role, label: str, values: Sequence[float], part: str = "") -> Mark:
    """Return the mean of several numbers, with the smallest and the largest as its interval."""
    return Mark(role, label, sum(values) / len(values), min(values), max(values), part)


class Cost(NamedTuple):
    """Cost of a result: training, and predicting one recording alone."""

    train_s: float
    inference_ms_per_recording: float


class Twin(NamedTuple):
    """The same result from a part of the band alone; whether it agrees, "" if nobody can say."""

    band: str
    result: str
    agrees: str


@dataclass(frozen=True)
class Change:
    """One change with one model: the metric before and after it."""

    change: str
    model: str
    before: float
    after: float
    supported: bool


@dataclass(frozen=True)
class Reason:
    """A hypothesis on figures `of` the paper, and its tests. `link` leads to their table."""

    of: tuple[str, ...]
    claim: str
    link: str
    tests: tuple[Change, ...]

    def explains(self, low: bool) -> bool:
        """Return whether a supported change moved the metric up (where ours is `low`), or down."""
        return any(one.supported and (one.after > one.before) is low for one in self.tests)


@dataclass(frozen=True)
class PaperComparison:
    """A figure of the paper and the result beside it; data set and task say where more is told.

    `model` is the model's name for people, "" where none was trained. Where `cost` is not given,
    the page gives that of training the paper's model on the task. `marks` are drawn, in `unit`
    (default: the paper's); of one part, the paper's number is drawn among them. `label` names the
    row among others of one figure, `page` is where all is told, `twins` stand beside it. Where the
    same values stand there by several splits, `split` says by which, and `note` what that makes.
    """

    paper: PaperFigure
    dataset: str
    task: str
    source: Source
    result: str
    model: str
    agrees: str
    cost: Cost | None = None
    reasons: tuple[Reason, ...] = ()
    marks: tuple[Mark, ...] = ()
    label: str = ""
    split: str = ""
    note: str = ""
    shown_unit: str | None = None
    page: str = ""
    twins: tuple[Twin, ...] = ()

    @property
    def unit(self) -> str:
        """Return the unit of the marks."""
        return self.paper.unit if self.shown_unit is None else self.shown_unit

    @property
    def why(self) -> list[Reason]:
        """Return the reasons that are supported and move the result towards the paper's."""
        low = self.agrees in (LOWER, VAGUE[False])
        return [reason for reason in self.reasons if reason.explains(low)]

    @property
    def differs(self) -> bool:
        """Return whether a reason is asked for."""
        return "no:" in self.agrees or self.agrees in VAGUE


def agreement(score: Score, paper: float, at_least: bool = False) -> str:
    """Return whether a score is the paper's number (or, `at_least`, not below it) within REACH sd.

    VAGUE where these reach from it to 0.
    """
    reach = REACH * score.sd if math.isfinite(score.sd) else 0.0
    if score.mean < paper - reach:
        return LOWER
    if score.mean > paper + reach and not at_least:
        return HIGHER
    told = at_least or reach < abs(paper)
    return YES if told else VAGUE[score.mean > paper]


def holds(gap: Score, otherwise: str) -> str:
    """Return whether a difference is above 0 by REACH sd: yes, `otherwise`, or not to be told."""
    reach = REACH * gap.sd if math.isfinite(gap.sd) else 0.0
    if gap.mean > reach:
        return YES
    return otherwise if gap.mean < -reach else UNCLEAR


def together(verdicts: Collection[str]) -> str:
    """Return one verdict on a statement on several things: partly, if it holds for some alone."""
    distinct = sorted(set(verdicts))
    return PARTLY if YES in distinct and len(distinct) > 1 else "; ".join(distinct)


def evidence(reason: Reason) -> str:
    """Return each change with what it did: `trained at all levels (CNN 5.4 → 0.74)`."""
    changes: dict[str, list[str]] = {}
    for one in reason.tests:
        said = f"{one.model} {number(one.before)} → {number(one.after)}"
        doubt = "" if one.supported else ", within the spread of folds"
        changes.setdefault(one.change, []).append(said + doubt)
    return "; ".join(f"{change} ({', '.join(said)})" for change, said in changes.items())


def in_papers_order(
    rows: Iterable[PaperComparison], paper: Iterable[PaperFigure]
) -> list[PaperComparison]:
    """Return the first row of each figure of the paper, data set and split, in the paper's
    order."""
    listed = list(rows)
    order = list(dict.fromkeys(one.id for one in (*paper, *(row.paper for row in listed))))
    first = {(row.paper.id, row.dataset, row.split): row for row in reversed(listed)}
    return sorted(reversed(first.values()), key=lambda row: order.index(row.paper.id))
