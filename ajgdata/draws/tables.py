"""Tables of a sweep beside the paper: where its figures lie, what moves them, who comes near."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.draws.posterior import misses, shift_of, together, tolerance_of
from ajgdata.draws.rows import Row
from ajgdata.draws.sampling import drawn_parameters
from ajgdata.draws.sensitivity import (
    FOLDS,
    POINTS,
    Emulator,
    Indices,
    emulate,
    marginal,
    sobol,
)
from ajgdata.draws.sweep import Sweep
from ajgdata.gripper.parameters import Parameter
from ajgdata.types import NotPossibleError
from ajgdata.types.table import Column, Table, Value

Real = NDArray[np.float64]
DECILES = tuple(range(0, 101, 10))
#: Parameters that are named of each row, draws that are named, and parameters of the posterior.
NAMED, NEAREST, SHIFTED = 5, 5, 15
#: Least share of a row's variance that is worth a name.
WORTH = 0.05
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


class Moved(NamedTuple):
    """What moves a row: an emulator, indices on it if it knows more than the mean, and p (d,) of
    the parameters without it."""

    emulator: Emulator
    indices: Indices | None
    p: Real


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


def sweep_tables(
    sweep: Sweep, targets: Mapping[str, float | None], points: int = POINTS
) -> list[Table]:
    """Return all tables; `points` are those of `sensitivity.sobol`.

    Raises NotPossibleError for a sweep of too few draws, or of none.
    """
    if len(sweep) < FOLDS:
        raise NotPossibleError(f"{len(sweep)} draws are too few: at least {FOLDS}")
    rows, parameters = judged(sweep, targets), drawn_parameters()
    places = sweep.places(parameters)
    moved = {one.row.name: _moved(one, places, points) for one in rows}
    all_missed = together([one.missed for one in rows], [_figure(one.row) for one in rows])
    return [
        _rows_table(rows, moved, parameters),
        _agreement(sweep, rows, all_missed),
        _nearest(sweep, rows, all_missed),
        _sensitivity(rows, moved, parameters),
        _posterior(places, all_missed, parameters),
    ]


def _figure(row: Row) -> str:
    """Of two rows of media each has a figure of its own: the paper says both in one sentence."""
    return row.name if row.dataset == "media" else row.paper


def _moved(one: Judged, places: Real, points: int) -> Moved | None:
    """Return what moves a row; None of too few draws."""
    known = np.isfinite(one.values)
    if known.sum() < 2 * FOLDS or np.ptp(one.values[known]) == 0:
        return None
    emulator = emulate(places[known], one.values[known])
    p = marginal(places[known], one.values[known])
    if emulator.r2 <= 0:
        return Moved(emulator, None, p)
    return Moved(emulator, sobol(emulator.predict, places.shape[1], points=points), p)


def _main(moved: Moved | None) -> list[int]:
    """Return the parameters that move a row by more than chance, the strongest first: worth a share
    of its variance, not by sampling alone, and by their ranks without the emulator, too."""
    if moved is None or moved.indices is None:
        return []
    total, reach = moved.indices.total, moved.indices.reach
    share = total * moved.emulator.r2
    sure = (share > WORTH) & (total > 2 * reach) & (moved.p < SURE)
    return [int(place) for place in np.argsort(-total, kind="stable")[:NAMED] if sure[place]]


def _rows_table(
    rows: list[Judged],
    moved: Mapping[str, Moved | None],
    parameters: tuple[Parameter, ...],
) -> Table:
    found: list[dict[str, Value]] = []
    for one in rows:
        known = one.values[np.isfinite(one.values)]
        told = moved[one.row.name]
        named = [parameters[place].setting for place in _main(told)[:3]]
        ends = np.percentile(known, DECILES)
        found.append(
            {
                "row": one.row.title, "unit": one.row.unit, "sense": one.row.sense,
                "paper": one.target, "default": one.default,
                "chance": one.chance if np.isfinite(one.chance) else None,
                "tolerance": one.tolerance, "draws": len(known),
                "within": 100 * float(np.sum(one.missed <= 1)) / max(len(known), 1),
                **{f"q{level}": float(end) for level, end in zip(DECILES, ends, strict=True)},
                "below": 100 * float(np.mean(known < one.target)),
                "r2": told.emulator.r2 if told else None,
                "moved_by": ", ".join(named),
            }
        )  # fmt: skip
    share = [float(np.mean(one.missed <= 1)) for one in rows]
    worst = [one.row.title for one, met in zip(rows, share, strict=True) if met == min(share)]
    note = (
        "Deciles over the drawn grippers of each row of the paper, in its reduced version: fewer"
        " grasps than the paper's, so that what depends on their number errs more than it would:"
        " Default is the gripper of the other pages, read by these reduced rows."
        " Tolerance: twice the spread over folds or grasps, of the middle draw, and no more than"
        " half of what lies between the paper and chance. Shares are of the draws that can hold"
        " the row's objects. Moved by: more than chance, in the table of Sobol indices; R² is the"
        " emulator's own on draws that it was not fitted to."
    )
    if worst:
        note += f" Met least often: {', '.join(worst)}."
    heads = (
        Column("row", "Row"), Column("unit", "Unit"), Column("sense", "Shall be"),
        Column("paper", "Paper"), Column("default", "Default"), Column("chance", "Chance"),
        Column("tolerance", "Tolerance"), Column("draws", "Draws that can"),
        Column("within", "Draws within", "%"), Column("below", "Draws below the paper", "%"),
        *(Column(f"q{level}", f"{level} %") for level in DECILES),
        Column("r2", "Emulator R²"), Column("moved_by", "Moved by"),
    )  # fmt: skip
    title = "Where the paper's figures lie among the drawn grippers, inferred, simulated"
    return Table("draws_rows", title, note, heads, tuple(found))


def verdict(sweep: Sweep, rows: list[Judged], all_missed: Real) -> str:
    """Return the sentence on whether any draw is like the paper in all its rows at once."""
    figures = len({_figure(one.row) for one in rows})
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
        other = nearest.setdefault(_figure(one.row), one)
        if one.missed[best] < other.missed[best]:
            nearest[_figure(one.row)] = one
    wrong = [one.row.title for one in nearest.values() if one.missed[best] > 1]
    return (
        f"None of {len(sweep)} drawn grippers is within tolerance of all {figures} figures of the"
        f" paper at once; the nearest, {sweep.names[best]}, misses by up to"
        f" {all_missed[best]:.1f} tolerances ({', '.join(wrong)}): some of that is that the rows"
        " are reduced, as the default gripper shows, which has its full rows on the other pages;"
        " else something is missing that no parameter stands for, or the ranges are too narrow."
    )


def _agreement(sweep: Sweep, rows: list[Judged], all_missed: Real) -> Table:
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


def _nearest(sweep: Sweep, rows: list[Judged], all_missed: Real) -> Table:
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


def _sensitivity(
    rows: list[Judged],
    moved: Mapping[str, Moved | None],
    parameters: tuple[Parameter, ...],
) -> Table:
    found: list[dict[str, Value]] = []
    for one in rows:
        told = moved[one.row.name]
        if told is None or (indices := told.indices) is None:
            continue
        emulator, p = told.emulator, told.p
        for place in _main(told):
            total = float(indices.total[place])
            found.append(
                {
                    "row": one.row.title, "setting": parameters[place].setting,
                    "share": total * emulator.r2, "first": float(indices.first[place]),
                    "total": total, "reach": float(indices.reach[place]), "p": float(p[place]),
                    "emulator": emulator.name, "r2": emulator.r2,
                }
            )  # fmt: skip
    untold = [one.row.title for one in rows if not any(r["row"] == one.row.title for r in found)]
    note = (
        "Share of the emulated variance that a parameter moves, alone and together with others (±:"
        " half the 95 % interval of the sampling, not of the emulator), and of the row's own"
        " variance: R² times it. What the emulator does not know, 1 - R² of the variance, is"
        " chance of grasps and sessions, or too few draws. p: of the parameter's rank correlation"
        " with the row, without an emulator, times the number of parameters."
    )
    if untold:
        note += f" No parameter can be told for: {', '.join(untold)}."
    heads = (
        Column("row", "Row"), Column("setting", "Parameter"),
        Column("share", "Of the row's variance"), Column("first", "Of the emulator's, alone"),
        Column("total", "With others"), Column("reach", "±"), Column("p", "p"),
        Column("emulator", "Emulator"), Column("r2", "Emulator R²"),
    )  # fmt: skip
    title = "Which parameters move which row: Sobol indices, simulated"
    return Table("draws_sensitivity", title, note, heads, tuple(found))


def _posterior(places: Real, all_missed: Real, parameters: tuple[Parameter, ...]) -> Table:
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
