"""Results of drift, read back: day 1 and every later session, as each model sees them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ajgdata.experiments.base import Result
from ajgdata.report.format import Score
from ajgdata.types.table import Table

#: No correction, and the correction that figures show: it uses all that references contain.
NONE, SHOWN = "none", "stretch and ratio"
MEASURES = ("accuracy", "confidence", "calibration_error", "wrong_share", "unlike_share")
#: A loss of accuracy (%) that an alarm should come before.
LOSS = 5.0
DAY_1 = "day 1"


class State(NamedTuple):
    """A session, or all of day 1 (`quantity` ""), as one model sees it: MEASURES over folds, in per
    cent, as it is and corrected; the median of its references' ratios; at how many of its
    `moments`, references with enough before them, the alarm rang."""

    session: str
    quantity: str
    value: float
    plain: dict[str, Score]
    best: dict[str, Score]
    ratio: float
    rung: int
    moments: int


class Means(NamedTuple):
    """Mean accuracy (%) over all later sessions against recordings that it takes in each."""

    label: str
    recordings: np.ndarray
    accuracy: np.ndarray


def states_of(result: Result) -> list[State]:
    """Return day 1 and every later session."""
    told, most = result.tables["said"], max(result.tables["said"].column("references"))
    references = result.tables["alarms"]
    states = []
    for (quantity, session), rows in _parted(told).items():
        mine = references.where(quantity=quantity, **({"session": session} if session else {}))
        late = mine.numbers("number") + 1 >= mine.numbers("in_a_row")
        states.append(
            State(
                session or DAY_1,
                quantity,
                rows.numbers("value")[0],
                _scores(rows.where(remedy=NONE)),
                _scores(rows.where(remedy=SHOWN, references=most)),
                float(np.median(mine.numbers("ratio"))),
                int((mine.numbers("observed")[late] > 1).sum()),
                int(late.sum()),
            )
        )
    return states


def _parted(told: Table) -> dict[tuple[str, str], Table]:
    """Return the rows of day 1, whose session is then "", and of every later session."""
    found = {("", ""): told.where(quantity="")}
    for quantity, rows in told.parted("quantity").items():
        if quantity:
            found |= {(quantity, name): one for name, one in rows.parted("session").items()}
    return found


def _scores(rows: Table) -> dict[str, Score]:
    values = {key: np.round(100 * rows.numbers(key), 3) for key in MEASURES}
    return {k: Score(v.mean(), v.std(ddof=1) if len(v) > 1 else np.nan) for k, v in values.items()}


def home_of(result: Result) -> State:
    """Return day 1."""
    return states_of(result)[0]


def later_of(result: Result) -> list[State]:
    """Return every later session."""
    return states_of(result)[1:]


def means_of(result: Result) -> list[Means]:
    """Return every correction by its references, then calibration grasps."""
    told = result.tables["said"]
    later = [row for row in told.rows if row["quantity"]]
    plain = float(np.mean([row["accuracy"] for row in later if row["remedy"] == NONE]))
    found = []
    for remedy in dict.fromkeys(row["remedy"] for row in later if row["remedy"] != NONE):
        mine = [row for row in later if row["remedy"] == remedy]
        found.append(_means(remedy, [(r["references"], r["accuracy"]) for r in mine], plain))
    grasps = [(row["recordings"], row["accuracy"]) for row in result.tables["mended"].rows]
    return [*found, _means("calibration grasps", grasps, plain)]


def _means(label: str, pairs: list[tuple[int, float]], plain: float) -> Means:
    counts = sorted({count for count, _ in pairs})
    means = [np.mean([value for count, value in pairs if count == one]) for one in counts]
    return Means(label, np.array([0, *counts]), 100 * np.array([plain, *means]))
