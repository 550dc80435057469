"""One row beside the paper: a result, its cost, and whether they agree.

Agreement is computed, never typed: a number agrees that lies within two standard deviations (over
folds, or over draws) of the paper's, which gives no spread of its own.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import NamedTuple

from ajgdata.report.further import Source
from ajgdata.report.paper import PaperFigure
from ajgdata.report.reasons import Reason
from ajgdata.report.results import Cost, Score

YES, LOWER, HIGHER, UNTOLD = "yes", "no: lower", "no: higher", "no number to compare"
#: Of statements: it holds for some of what it is said of; it cannot be told from the spread.
PARTLY, UNCLEAR = "partly", "cannot be told: within the spread"
#: Standard deviations within which two numbers agree.
REACH = 2.0


class Spent(NamedTuple):
    """What something other than an evaluated model cost."""

    train_s: float
    inference_ms_per_recording: float


@dataclass(frozen=True)
class Beside:
    """A figure of the paper and the result beside it; `dataset` is where the page tells more."""

    paper: PaperFigure
    dataset: str
    source: Source
    result: str
    model: str
    cost: Cost | Spent | None
    agrees: str
    reasons: tuple[Reason, ...] = ()

    @property
    def why(self) -> list[Reason]:
        """Reasons that are supported and move the result towards the paper's."""
        return [reason for reason in self.reasons if reason.explains(self.agrees == LOWER)]

    @property
    def differs(self) -> bool:
        """Whether a reason is asked for."""
        return "no:" in self.agrees


def agreement(score: Score, paper: float, at_least: bool = False) -> str:
    """Whether a score is the paper's number (or, `at_least`, not below it) within REACH sd.

    It cannot be told if that is as wide as the number itself, which then agrees with anything.
    """
    reach = REACH * score.sd if math.isfinite(score.sd) else 0.0
    if score.mean < paper - reach:
        return LOWER
    if score.mean > paper + reach and not at_least:
        return HIGHER
    return YES if reach < abs(paper) else UNCLEAR


def holds(gap: Score, otherwise: str) -> str:
    """Whether a difference is above 0 by REACH sd: yes, `otherwise`, or that it cannot be told."""
    reach = REACH * gap.sd if math.isfinite(gap.sd) else 0.0
    if gap.mean > reach:
        return YES
    return otherwise if gap.mean < -reach else UNCLEAR


def together(verdicts: Collection[str]) -> str:
    """One verdict on a statement on several things: partly, if it holds for some of them alone."""
    distinct = sorted(set(verdicts))
    return PARTLY if YES in distinct and len(distinct) > 1 else "; ".join(distinct)
