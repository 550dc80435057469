"""Which of the drawn grippers come near the paper, and what those have in common, as tables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ajgdata.draws.posterior import misses, shift_of, tolerance_of
from ajgdata.draws.rows import Row
from ajgdata.draws.sweep import Sweep
from ajgdata.gripper.parameters import Parameter
from ajgdata.types.table import Column, Table, Value

Real = NDArray[np.float64]
#: Draws that are named, and parameters of the posterior.
NEAREST, SHIFTED = 5, 15
#: Share of the draws that are looked at for what they have in common where too few are accepted.
NEAR_SHARE, FEWEST = 0.1, 5
FACTORS = (1, 2, 3)
#: Below this p a parameter differs, or moves a row, by more than chance.
SURE = 0.05


@dataclass(frozen=True)
class Judged:
    """A row of the paper, with the values of the draws (n,) and by how much each misses it."""

    row: Row
    target: float
    values: Real
    tolerance: float
    missed: Real
    default: float | None
    chance: float


def judged(sweep: Sweep, targets: Mapping[str, float | None]) -> list[Judged]:
    """Return the rows that have values; `targets` are the paper's, by the ids of its figures.

    A row without a tolerance, or without a target, is left out.
    """
    found = []
    for row in sweep.rows():
        target = row.target if row.target is not None else targets.get(row.paper)
        if target is None:
            continue
        chances = sweep.read(row, "chance")
        chance = float(np.nanmedian(chances)) if np.isfinite(chances).any() else float("nan")
        # Where the paper's figure is chance itself, nothing lies between.
        to_chance = abs(chance - target) if row.target is None else float("nan")
        tolerance = tolerance_of(sweep.read(row, "sd"), sweep.read(row, "step"), to_chance)
        if not np.isfinite(tolerance):
            continue
        values = sweep.read(row)
        missed = misses(values, target, tolerance, row.sense)
        default = sweep.of_default(row)
        found.append(Judged(row, target, values, tolerance, missed, default, chance))
    return found


def figure_of(row: Row) -> str:
    """Return the figure that a row is of; each of media its own: the paper says both at once."""
    return row.name if row.dataset == "media" else row.paper


def verdict(sweep: Sweep, rows: list[Judged], all_missed: Real) -> str:
    """Return the sentence on whether any draw is like the paper in all its rows at once."""
    figures = len({figure_of(one.row) for one in rows})
    accepted = int(np.sum(all_missed <= 1))
    best = int(np.argmin(all_missed))
    if accepted:
        return (
            f"{accepted} of {len(sweep)} drawn grippers are within tolerance of all {figures}"
            " figures of the paper at once: within this simulation they could have given its table."
        )
    if not np.isfinite(all_missed[best]):
        return (
            f"None of {len(sweep)} drawn grippers can hold every object of the paper's {figures}"
            " figures: the ranges of its sizes are too wide, or its objects lie differently."
        )
    nearest: dict[str, Judged] = {}
    for one in rows:
        other = nearest.setdefault(figure_of(one.row), one)
        if one.missed[best] < other.missed[best]:
            nearest[figure_of(one.row)] = one
    wrong = [one.row.title for one in nearest.values() if one.missed[best] > 1]
    return (
        f"None of {len(sweep)} drawn grippers is within tolerance of all {figures} figures of the"
        f" paper at once; the nearest, {sweep.names[best]}, misses by up to"
        f" {all_missed[best]:.1f} tolerances ({', '.join(wrong)}): some of that is that the rows"
        " are reduced, as the default gripper shows, which has its full rows on the other pages;"
        " else something is missing that no parameter stands for, or the ranges are too narrow."
    )


def agreement_table(sweep: Sweep, rows: list[Judged], all_missed: Real) -> Table:
    """Return how many draws are within one, two and three tolerances of all figures."""
    found: list[dict[str, Value]] = []
    for factor in FACTORS:
        inside = all_missed <= factor
        found.append(
            {
                "factor": factor, "accepted": int(inside.sum()),
                "share": 100 * float(inside.mean()),
                "names": ", ".join(np.array(sweep.names)[inside][:NEAREST].tolist()),
            }
        )  # fmt: skip
    note = verdict(sweep, rows, all_missed) + (
        " Of known sizes and angles the reading (by grasp or by recording) that is nearer counts."
        " A draw that cannot hold an object is never accepted."
    )
    heads = (
        Column("factor", "Tolerance, times"), Column("accepted", "Accepted draws"),
        Column("share", "Accepted", "%"), Column("names", "Such as"),
    )  # fmt: skip
    title = "Is any draw like the paper in all rows, inferred, simulated"
    return Table("draws_agreement", title, note, heads, tuple(found))


def nearest_table(sweep: Sweep, rows: list[Judged], all_missed: Real) -> Table:
    """Return the rows of the draws that come nearest."""
    order = [place for place in np.argsort(all_missed)[:NEAREST] if np.isfinite(all_missed[place])]
    found: list[dict[str, Value]] = []
    for one in rows:
        cells = {f"draw_{n}": float(one.values[place]) for n, place in enumerate(order)}
        found.append({"row": one.row.title, "paper": one.target, **cells})
    heads = (
        Column("row", "Row"), Column("paper", "Paper"),
        *(Column(f"draw_{n}", sweep.names[place]) for n, place in enumerate(order)),
    )  # fmt: skip
    note = "The draws whose greatest miss, in tolerances, is least; in the unit of each row."
    title = "The draws nearest to the paper, simulated"
    return Table("draws_nearest", title, note, heads, tuple(found))


def posterior_table(places: Real, all_missed: Real, parameters: tuple[Parameter, ...]) -> Table:
    """Return how the accepted draws, or the nearest where those are few, differ from all."""
    kept = all_missed <= 1
    of = f"the {int(kept.sum())} accepted draws"
    if kept.sum() < FEWEST:
        order = np.argsort(all_missed, kind="stable")
        kept = np.zeros(len(all_missed), bool)
        kept[order[: max(FEWEST, round(NEAR_SHARE * len(all_missed)))]] = True
        kept &= np.isfinite(all_missed)
        of = f"the {int(kept.sum())} nearest draws, as too few are accepted"
    ends = all_missed[kept]
    if len(ends):
        of += f" (each misses some figure, by {ends.min():.1f} to {ends.max():.1f} tolerances),"
    found: list[dict[str, Value]] = []
    told = []
    if kept.sum() > 1:
        shift = shift_of(places, kept)
        for place in np.lexsort((-np.abs(shift.mean), shift.p))[:SHIFTED]:
            one = parameters[place]
            told += [one.setting] if shift.p[place] < SURE else []
            found.append(
                {
                    "setting": one.setting, "shift": float(shift.mean[place]),
                    "spread": float(shift.spread[place]), "p": float(shift.p[place]),
                    "evidence": one.evidence,
                }
            )  # fmt: skip
    said = f"They differ from all in {', '.join(told)}." if told else (
        "In no parameter do they differ from all by more than chance."
    )  # fmt: skip
    note = (
        f"What {of} have in common. Shift: of the mean, in standard deviations of the range;"
        " spread: standard deviation over that of the range; p: Kolmogorov-Smirnov against the"
        f" range, times the number of parameters. {said}"
    )
    heads = (
        Column("setting", "Parameter"), Column("shift", "Shift"), Column("spread", "Spread"),
        Column("p", "p"), Column("evidence", "Evidence for the range"),
    )  # fmt: skip
    title = "What the draws nearest to the paper have in common, inferred, simulated"
    return Table("draws_posterior", title, note, heads, tuple(found))
