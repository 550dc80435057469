"""Comparison with the paper: published values, our results with their cost, and the verdicts.

`evaluate.agreement` computes the verdicts; no verdict is typed.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field, field_validator

from ajgdata.evaluate.agreement import (
    PAPER_VERDICTS,
    Estimate,
    Interval,
    PaperVerdict,
    judge_published,
    statement_verdict,
    wilson_interval,
)
from ajgdata.report.format import Score, Source, enumerated, number, with_unit
from ajgdata.types import Name, Strict, checked

#: The paper's words for a model that does no better than a guess.
NEAR_CHANCE = "near chance"
#: Sign of each verdict, because colour alone is not enough.
SIGNS: dict[PaperVerdict, str] = {
    "agrees": "✓",
    "partly agrees": "◐",
    "better": "▲",
    "worse": "▼",
    "inconclusive": "?",
    "disagrees": "≠",
}
#: Remark on a result whose verdict another computer could change.
UNSTABLE = "the verdict changes within the difference between machines"
#: Numbers of tested grasps for which a verdict is computed, if the paper does not state its number.
ASSUMED_N = (40, 80, 160)
#: Standard deviations beyond which a difference is not noise.
NOISE_DEVIATIONS = 2.0


class PaperFigure(Strict):
    """One number that the paper reports for the real gripper and real recordings."""

    id: Name
    metric: str
    value: float | None = Field(description="null if the result is not one number")
    unit: str
    text: Annotated[str, Field(min_length=1, description="the result in a few words")]
    where: str = Field(description="the experiment of the paper that it belongs to")
    n: int | None = Field(
        None, ge=1, description="number of tested grasps of an accuracy, if the paper states it"
    )
    order: tuple[str, ...] = Field(
        (), description="classes of a statement on their order, the class with most energy first"
    )
    reached: float | None = Field(
        None, description="accuracy to reach, if `value` is the number of grasps that this takes"
    )
    correct: int | None = Field(
        None, ge=0, description="successes, if the value is a share of counted trials"
    )
    trials: int | None = Field(None, ge=1, description="trials, if the value is a share of them")
    panel: str = Field("", description="title on the first page; several results can share it")
    row: str = Field("", description="name of the result among those with the same `panel`")
    short: str = Field("", description="the result in up to 30 letters, if it is not one number")
    source: str = Field("", description="citation; default: that at the head of the file")
    url: str = Field("", description="web address of the paper; from the head of the file")
    spread: float = Field(0.0, ge=0, description="difference of our value between machines")

    @property
    def name(self) -> str:
        """Return the name of the result, for example `Cube size, withheld`."""
        return ", ".join(filter(None, (self.panel or self.where, self.row)))

    @property
    def intervals(self) -> dict[int, Interval]:
        """Return the interval of a published accuracy, in its unit, by number of tested grasps.

        Empty for other values.
        """
        if self.metric != "accuracy" or self.value is None:
            return {}
        numbers = (self.n,) if self.n else ASSUMED_N
        whole = 100.0 if self.unit == "%" else 1.0
        return {n: wilson_interval(self.value / whole, n).scaled(whole) for n in numbers}

    @property
    def published(self) -> str:
        """Return the published value with its unit, or the result in a few words."""
        if self.short or self.value is None:
            return self.short or self.text
        return with_unit(number(self.value), self.unit)


class _PaperFile(Strict):
    source: Annotated[str, Field(min_length=1)]
    title: str
    authors: str
    url: str
    figures: tuple[PaperFigure, ...] = Field(min_length=1)

    @field_validator("figures")
    @classmethod
    def _distinct(cls, figures: tuple[PaperFigure, ...]) -> tuple[PaperFigure, ...]:
        ids = [figure.id for figure in figures]
        twice = sorted({name for name in ids if ids.count(name) > 1})
        if twice:
            raise ValueError(f"listed twice: {', '.join(twice)}")
        return figures


def parse_paper(
    mapping: Mapping[str, Any], spread: Mapping[str, float] = MappingProxyType({})
) -> dict[str, PaperFigure]:
    """Return the published values of `paper.yaml` by id, with citation, address and `spread`.

    `mapping` is the content of the file; `spread` has differences between machines by id. Raises
    DataError, which names the key, if a value is missing or wrong.
    """
    paper = checked(_PaperFile, "paper.yaml", mapping)
    figures = {}
    for row in paper.figures:
        shared = {
            "source": row.source or paper.source,
            "spread": spread.get(row.id, 0.0),
            "url": paper.url,
        }
        figures[row.id] = row.model_copy(update=shared)
    return figures


Role = Literal["ours", "sessions", "placebo", "baseline", "chance", "paper"]


class Mark(NamedTuple):
    """A number with its interval on the skill axis; `role` is its meaning."""

    role: Role
    value: float
    low: float
    high: float


def mark_of(role: Role, score: Score, scale: float = 1.0) -> Mark:
    """Return the mark of a score: its mean with its interval, else plus and minus one deviation.

    If the deviation is unknown, the interval is the mean.
    """
    value = scale * score.mean
    (below,), (above,) = score.bars(scale)
    return Mark(role, value, value - below, value + above)


class ResultCost(NamedTuple):
    """Cost of a result: CPU time of training, and wall time of predicting one recording alone."""

    train_cpu_s: float
    prediction_ms: float


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
    """A hypothesis on differences from published values, and its tests.

    `of` are the ids of the published values, and `link` leads to the table of the tests. With a
    `split`, the hypothesis is only about the results of this split.
    """

    of: tuple[str, ...]
    claim: str
    link: str
    tests: tuple[Change, ...]
    split: str = ""

    def is_about(self, row: PaperComparison) -> bool:
        """Return whether the hypothesis is about a result."""
        return row.paper.id in self.of and self.split in ("", row.split)

    def explains(self, low: bool) -> bool:
        """Return whether a supported change moved the metric up, or down if ours is not `low`."""
        return any(test.supported and (test.after > test.before) is low for test in self.tests)


@dataclass(frozen=True)
class PaperComparison:
    """A published value, our result, and the verdict `agrees`.

    - `model`: name of the model for people; "" if no model was trained
    - `cost`: default: the cost of training the paper's model on the task
    - `marks`: drawn if the chance level is among them, in `unit` (default: that of the paper)
    - `label`: name of the row if a published value has several rows
    - `split`: split of the result, if the task has results of several splits
    - `page`: link to the page with the details
    - `controls`: result with held-out sessions, and the placebo, in words
    - `remark`: a condition of the verdict, or a limit of what it shows
    """

    paper: PaperFigure
    dataset: str
    task: str
    source: Source
    result: str
    model: str
    agrees: PaperVerdict
    cost: ResultCost | None = None
    reasons: tuple[Reason, ...] = ()
    marks: tuple[Mark, ...] = ()
    label: str = ""
    split: str = ""
    shown_unit: str | None = None
    page: str = ""
    experiment: str = ""
    controls: str = ""
    remark: str = ""

    @property
    def unit(self) -> str:
        """Return the unit of the marks."""
        return self.paper.unit if self.shown_unit is None else self.shown_unit

    @property
    def name(self) -> str:
        """Return the name of the result."""
        label = self.label or self.paper.row
        return ", ".join(filter(None, (self.paper.panel or self.paper.where, label)))

    @property
    def short_result(self) -> str:
        """Return our value with its interval, or the first clause of the result."""
        ours = next((mark for mark in self.marks if mark.role == "ours"), None)
        if ours is None or not any(mark.role == "chance" for mark in self.marks):
            return self.result.partition(";")[0]
        text = with_unit(number(ours.value), self.unit)
        if ours.low < ours.high:
            return f"{text} ({number(ours.low)} to {number(ours.high)})"
        return text

    @property
    def why(self) -> list[Reason]:
        """Return the supported reasons that move our result towards the published value."""
        ours = next((mark.value for mark in self.marks if mark.role == "ours"), math.nan)
        is_low = self.paper.value is not None and ours < self.paper.value
        return [reason for reason in self.reasons if reason.explains(is_low)]

    @property
    def differs(self) -> bool:
        """Return whether a reason is required; for an inconclusive row only if one was tested."""
        if self.agrees == "inconclusive":
            return bool(self.reasons)
        return self.agrees != "agrees"


class Judgement(NamedTuple):
    """The verdict on our value next to a published value, and a condition of it in words."""

    verdict: PaperVerdict
    remark: str


def judged(
    paper: PaperFigure, score: Estimate, published: float, *, scale: float = 1.0
) -> Judgement:
    """Return the verdict on our score by `agreement.judge_published`.

    A published accuracy has a binomial uncertainty. If the paper does not state its number of
    tested grasps, the verdict is computed for `ASSUMED_N`. The remark states this number, and
    whether a verdict changes if our value moves by the difference between machines. `scale` times
    a score is in the unit of the paper; `published` is in the unit of the score.
    """
    intervals = {n: ends.scaled(1 / scale) for n, ends in paper.intervals.items()}
    judgement = judge_published(score, published, intervals=intervals, spread=paper.spread / scale)
    remarks = []
    if judgement.by_trials:
        remarks.append(by_n_text(paper, judgement.by_trials))
    if not judgement.is_stable:
        remarks.append(UNSTABLE)
    return Judgement(judgement.verdict, "; ".join(remarks))


def by_n_text(paper: PaperFigure, by_n: Mapping[int, PaperVerdict]) -> str:
    """Return the verdicts by number of grasps: `inconclusive at 40 and 80, worse at 160`."""
    if paper.n:
        return f"n of the paper: {paper.n}"
    numbers: dict[PaperVerdict, list[str]] = {}
    for n, verdict in by_n.items():
        numbers.setdefault(verdict, []).append(str(n))
    listed = ", ".join(f"{verdict} at {enumerated(ns)}" for verdict, ns in numbers.items())
    return f"n of the paper is not stated: {listed}"


def holds(gap: Score) -> PaperVerdict:
    """Return the verdict on the statement that a difference is above 0.

    The interval of the difference is plus and minus `NOISE_DEVIATIONS` standard deviations.
    """
    reach = NOISE_DEVIATIONS * gap.sd
    return statement_verdict(Interval(gap.mean - reach, gap.mean + reach))


def tally(rows: Iterable[PaperComparison]) -> dict[str, int]:
    """Return the number of rows with each verdict, in the order of `PAPER_VERDICTS`.

    The console, the report and the documentation print this count.
    """
    counts = Counter(row.agrees for row in rows)
    return {verdict: counts[verdict] for verdict in PAPER_VERDICTS if counts[verdict]}


def tally_text(counts: Mapping[str, int]) -> str:
    """Return the count of each verdict in words.

    >>> tally_text({"agrees": 3, "better": 2})
    '3 agree, 2 better'
    """
    texts = []
    for verdict, count in counts.items():
        words = verdict if count == 1 else verdict.replace("agrees", "agree")
        texts.append(f"{count} {words}")
    return ", ".join(texts)


def evidence(reason: Reason) -> str:
    """Return each change with its effects, for example `trained at all levels (CNN 5.4 → 0.74)`."""
    changes: dict[str, list[str]] = {}
    for test in reason.tests:
        effect = f"{test.model} {number(test.before)} → {number(test.after)}"
        if not test.supported:
            effect += " not supported"
        changes.setdefault(test.change, []).append(effect)
    return "; ".join(f"{change} ({', '.join(effects)})" for change, effects in changes.items())


def in_papers_order(
    rows: Iterable[PaperComparison], paper: Iterable[PaperFigure]
) -> list[PaperComparison]:
    """Return the first row per published value, data set and split, in the order of the paper."""
    listed = list(rows)
    order = list(dict.fromkeys(figure.id for figure in (*paper, *(row.paper for row in listed))))
    first = {(row.paper.id, row.dataset, row.split): row for row in reversed(listed)}
    return sorted(reversed(first.values()), key=lambda row: order.index(row.paper.id))
