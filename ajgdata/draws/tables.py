"""Tables of a sweep beside the paper: where its figures lie, what moves them, who comes near."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.draws.nearness import (
    SURE,
    Judged,
    agreement_table,
    figure_of,
    judged,
    nearest_table,
    posterior_table,
)
from ajgdata.draws.posterior import together
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
#: Parameters that are named of each row.
NAMED = 5
#: Least share of a row's variance that is worth a name.
WORTH = 0.05


class Moved(NamedTuple):
    """What moves a row: an emulator, indices on it if it knows more than the mean, and p (d,) of
    the parameters without it."""

    emulator: Emulator
    indices: Indices | None
    p: Real


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
    all_missed = together([one.missed for one in rows], [figure_of(one.row) for one in rows])
    return [
        _rows_table(rows, moved, parameters),
        agreement_table(sweep, rows, all_missed),
        nearest_table(sweep, rows, all_missed),
        _sensitivity(rows, moved, parameters),
        posterior_table(places, all_missed, parameters),
    ]


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
