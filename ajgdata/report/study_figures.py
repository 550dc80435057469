"""Figures of the studies, by study and table. A table without one is shown as it is."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from ajgdata.gripper.scene import Numerics
from ajgdata.report.blocks import TableFigure
from ajgdata.report.format import Score, number, value, words
from ajgdata.report.marks import Picture, Point
from ajgdata.types.table import Table, Value, table_of

#: Changes of the feature below this (relative L2) are drawn at it.
LEAST_CHANGE = 1e-4
CHANGE = ("relative L2 change of the feature", "")
GRID = ("grid spacing", "mm")


def points_of(
    table: Table, value_key: str, series: str, x: str, panel: str = "", least: float = -math.inf
) -> Iterator[Point]:
    """Yield a point per row with a finite value: the columns of value, series, x and panel.

    Values below `least` are drawn at it.
    """
    for row, number_ in zip(table.rows, table.numbers(value_key), strict=True):
        if math.isfinite(number_):
            place = _text(row[x]) if isinstance(row[x], str) else float(row[x] or 0)
            name, where = (_text(row[key]) if key else "" for key in (series, panel))
            yield Point(where, name, place, Score(max(float(number_), least), math.nan))


def _table(rows: list[dict[str, Value]]) -> Table:
    return table_of("", "", rows, **dict.fromkeys(rows[0], ""))


def _text(cell: Value) -> str:
    return words(str(cell))


def picture_of(
    title: str, subtitle: str, points: Iterator[Point] | list[Point], axis: tuple[str, str],
    place: tuple[str, str] = ("", ""), limit: tuple[str, float] | None = None, log: bool = True,
) -> Picture:  # fmt: skip
    """Return a picture of simulated results with a logarithmic axis."""
    return Picture(
        title, subtitle, ("simulated",), tuple(points), axis, place, limit=limit, log=log
    )


def _tolerance(table: Table) -> tuple[str, float]:
    return "tolerance", float(table.numbers("tolerance")[0])


def convergence_finding(table: Table) -> str:
    """Return how many known answers refinement brings nearer, and at which orders."""
    orders = []
    for rows in table.parted("case").values():
        grid, error = rows.numbers("dx_mm"), rows.numbers("error")
        fine, coarse = int(np.argmin(grid)), int(np.argmax(grid))
        if grid[fine] < grid[coarse] and error[fine] > 0 and error[coarse] > 0:
            orders.append(np.log(error[coarse] / error[fine]) / np.log(grid[coarse] / grid[fine]))
    nearer = [order for order in orders if order > 0]
    if not nearer:
        return f"Refinement brings none of {len(orders)} known answers nearer"
    low, high = (number(f(nearer), 2) for f in (min, max))
    return (
        f"Refinement brings {len(nearer)} of {len(orders)} known answers nearer, at orders from "
        f"{low} to {high}"
    )


def convergence(table: Table) -> Picture:
    """Return relative error of each refined case against the grid spacing."""
    points = [p for p in points_of(table, "error", "case", "dx_mm") if p.score.mean > 0]
    about = f"{len(table.parted('case'))} known answers"
    return picture_of(convergence_finding(table), about, points, ("relative error", ""), GRID)


def stability_finding(table: Table) -> str:
    """Return how many of the marched cases can grow, or the most that a step can add to any."""
    marched = [row for row in table.rows if row["outcome"] != "refused"]
    grows = sum(row["outcome"] == "grows" for row in marched)
    if grows:
        return f"{grows} of {len(marched)} marched cases can gain energy"
    gain = value(max(row["gain"] for row in marched))
    return f"None of {len(marched)} marched cases gains energy: at most {gain} per step, any state"


def stability_text(table: Table) -> str:
    """Return the caption of the energies, with how far the energy of any state can grow."""
    growth = table.numbers("transient")
    worst = int(np.nanargmax(growth))
    usual = number(float(np.nanmedian(growth)), 2)
    return (
        "Energy at the end of each run over that after its strike; a case that blew up would lie "
        "above 1. The stored energy of some state can rise for a moment, at frequencies near the "
        f"limit of the grid: by a factor of {usual} in half of the cases and of "
        f"{number(growth[worst], 2)} in the worst, {table.rows[worst]['name']}."
    )


def stability(table: Table) -> Picture:
    """Return energy at the end over that after the strike, of each case that was marched."""
    points = []
    for name, key in (("float64", "growth"), ("float32", "growth_single")):
        found = points_of(table, key, "group", "group")
        points += [point._replace(series=name) for point in found if point.score.mean > 0]
    axis = ("energy, last over first", "")
    about = f"{int(np.sum(~np.isnan(table.numbers('growth'))))} cases that were marched"
    return picture_of(stability_finding(table), about, points, axis, limit=("no losses", 1.0))


def _default(table: Table) -> Table:
    """Return the rows of the default scheme and grid."""
    return table.where(scheme=Numerics().scheme, dx_mm=Numerics().dx_mm)


def accuracy_finding(table: Table) -> str:
    """Return error and cost of the default, on average over objects."""
    default = _default(table)
    if not default.rows:
        return "A finer grid has a smaller error and takes longer"
    error, ratio = (float(default.numbers(key).mean()) for key in ("error", "ratio"))
    return (
        f"The default, {Numerics().scheme} at {Numerics().dx_mm:g} mm, has an error of "
        f"{number(error, 2)} in {number(ratio, 2)} of the plain kernel's time"
    )


def accuracy(table: Table) -> Picture:
    """Return error of the feature against run time: a panel per object, a series per scheme."""
    points = [p for p in points_of(table, "error", "scheme", "ratio", "object") if p.score.mean > 0]
    axis = ("relative L2 error of the feature", "")
    place = ("run time over that of the plain kernel at 2.5 mm", "")
    about = "error against the finest grid; each point is a grid spacing"
    limit = ("target", 0.10)
    return picture_of(accuracy_finding(table), about, points, axis, place, limit)


def bands_finding(table: Table) -> str:
    """Return the level error of the default, or of the first row, in lowest and highest band."""
    bands = [column for column in table.columns if column.key.startswith("db_")]
    name, cases = next(iter(table.parted("object").items()))
    row = (_default(cases).rows or cases.rows)[0]
    levels = [
        f"{number(float(row[band.key] or 0), 2)} dB at {band.title.removeprefix('Level, ')}"
        for band in dict.fromkeys((bands[0], bands[-1]))
    ]
    grid = f"{row['dx_mm']:g} mm ({row['scheme']})"
    return f"Levels of a {name} at {grid} are off by {', '.join(levels)}"


def bands(table: Table) -> Picture:
    """Return level error against the grid spacing: a panel per band, a series per scheme."""
    _, cases = next(iter(table.parted("object").items()))
    points = [
        point._replace(panel=column.title.removeprefix("Level, "))
        for column in table.columns
        if column.key.startswith("db_")
        for point in points_of(cases, column.key, "scheme", "dx_mm")
        if point.score.mean > 0
    ]
    about = "level against the finest grid"
    return picture_of(bands_finding(table), about, points, ("level error", "dB rms"), GRID)


def omissions_finding(table: Table) -> str:
    """Return how many of the parts that are left out change more than is tolerated."""
    absent = table.where(kept=False)
    tolerance = _tolerance(table)[1]
    above = int(np.sum(absent.numbers("measured") > tolerance))
    count = f"{above or 'None'} of {len(absent.rows)}"
    verb = "change" if above > 1 else "changes"
    return f"{count} parts left out {verb} any third octave by more than {number(tolerance)}"


def omissions(table: Table) -> Picture:
    """Return the measured change if each part is left out: a row per part."""
    limit = _tolerance(table)
    least = limit[1] / 1e3
    points = [
        point._replace(series=name)
        for kept, name in ((True, "solved"), (False, "left out"), (None, "all that is left out"))
        for point in points_of(table.where(kept=kept), "measured", "part", "part", "", least)
    ]
    about = f"{len(table.parted('scene'))} scenes"
    return picture_of(omissions_finding(table), about, points, CHANGE, limit=limit)


def _materials(table: Table) -> list[str]:
    fixed = {"shape", "step", "scatter"}
    keys = [column.key for column in table.columns]
    return [key for key in keys if key not in fixed and not key.endswith("_low")]


def distances_finding(table: Table) -> str:
    """Return how many materials of all shapes lie further from steel than another grasp does."""
    far, count = [], 0
    for shape, rows in table.parted("shape").items():
        scatter = rows.numbers("scatter")
        known = scatter[~np.isnan(scatter)]
        for material in _materials(table) if len(known) else ():
            count += 1
            if rows.numbers(material)[-1] > known[-1]:
                far.append(f"{material} ({shape})")
    listed = f"{len(far)} of {count}: {', '.join(far)}" if far else f"none of {count}"
    return f"Materials that lie further from steel than another grasp of it: {listed}"


def distances(table: Table) -> Picture:
    """Return the distance of each material from steel as effects are added: a panel per shape."""
    names = {key: key for key in _materials(table)} | {"scatter": "another grasp"}
    points = [
        point._replace(series=name)
        for key, name in names.items()
        for point in points_of(table, key, "shape", "step", "shape")
    ]
    about = "effects are added from top to bottom"
    axis = ("relative L2 distance of the feature", "")
    return picture_of(distances_finding(table), about, points, axis)


def effects_finding(table: Table) -> str:
    """Return how many changes exceed the tolerance, and which is the largest."""
    change, tolerance = table.numbers("change"), _tolerance(table)[1]
    above = int(np.sum(change > tolerance))
    largest = table.rows[int(np.argmax(change))]
    return (
        f"{above} of {len(change)} changes of the contact move the feature by more than "
        f"{number(tolerance)}; most: {largest['effect']} ({largest['object']})"
    )


def effects(table: Table) -> Picture:
    """Return the change of the feature by each effect, and the distance of two grasps."""
    names = {"change": "whole band", "change_low": "below 1.2 kHz", "scatter": "two grasps"}
    rows = [row | {"place": f"{row['effect']}: {row['object']}"} for row in table.rows]
    named = _table(rows)
    points = [
        point._replace(series=name)
        for key, name in names.items()
        for point in points_of(named, key, "object", "place", "", LEAST_CHANGE)
    ]
    about = "one change of the scene"
    return picture_of(effects_finding(table), about, points, CHANGE, limit=_tolerance(table))


def _octaves(table: Table) -> Mapping[int, str]:
    """Return the columns of a decay table, by the middle of their octave."""
    keys = [column.key for column in table.columns if column.key.startswith("hz_")]
    return {int(key.removeprefix("hz_")): key for key in keys}


def decay_finding(table: Table) -> str:
    """Return how long the empty gripper takes for 60 dB, over octaves and the range of losses."""
    empty = table.where(medium="air")
    times = np.array([empty.numbers(key) for key in _octaves(table).values()])
    if not np.isfinite(times).any():
        return "The level in the gripper falls faster than its octaves can resolve"
    low, high = (number(1e3 * float(f(times)), 2) for f in (np.nanmin, np.nanmax))
    return f"The level in the empty gripper falls by 60 dB in {low} to {high} ms"


def decay(table: Table) -> Picture:
    """Return decay time against octave: a panel per medium, a series per amount of losses."""
    rows = [
        {"medium": row["medium"], "losses": f"{row['losses']}: {row['admittance']:g}", "hz": hz,
         "ms": None if row[key] is None else 1e3 * float(row[key] or 0)}
        for row in table.rows
        for hz, key in _octaves(table).items()
    ]  # fmt: skip
    points = points_of(_table(rows), "ms", "losses", "hz", "medium")
    about = "by losses at the walls; hung free"
    axis, place = ("time to fall by 60 dB", "ms"), ("octave", "Hz")
    return picture_of(decay_finding(table), about, points, axis, place)


def outside_finding(table: Table) -> str:
    """Return where the solved level differs most from the mass law, in the first scene."""
    rows = table.where(scene=table.column("scene")[0])
    row = rows.rows[int(np.argmax(np.abs(rows.numbers("difference"))))]
    more = "more" if row["difference"] > 0 else "less"
    return (
        f"Through membrane and cavity {number(abs(row['difference']), 2)} dB {more} comes in at "
        f"{row['band']} Hz than by the mass law"
    )


def outside(table: Table) -> Picture:
    """Return level at the microphone against that outside, by band: a series per scene."""
    first = table.where(scene=table.column("scene")[0])
    law = [p._replace(series="mass law") for p in points_of(first, "mass_law", "scene", "hz")]
    points = [*points_of(table, "solved", "scene", "hz"), *law]
    about = "level at the microphone against that in the room, sound from all directions"
    axis, place = ("level", "dB"), ("frequency", "Hz")
    return picture_of(outside_finding(table), about, points, axis, place, log=False)


def choices_finding(table: Table) -> str:
    """Return how many choices change the feature by less than the tolerance in all scenes."""
    tolerance = _tolerance(table)[1]
    largest = {name: rows.numbers("change").max() for name, rows in table.parted("choice").items()}
    small = [name for name, change in largest.items() if change < tolerance]
    most = max(largest, key=lambda name: largest[name])
    few = f"{len(small)} of {len(largest)} choices change" if small else "No choice changes"
    return f"{few} the feature by less than {number(tolerance)}; largest: {most}"


def choices(table: Table) -> Picture:
    """Return the change of the feature by each choice: a series per scene."""
    points = points_of(table, "change", "scene", "choice", "", LEAST_CHANGE)
    about = "against the default, whole band"
    return picture_of(choices_finding(table), about, points, CHANGE, limit=_tolerance(table))


#: Figures by study.
FIGURES: dict[str, tuple[TableFigure, ...]] = {
    "verification": (
        TableFigure(
            "convergence", "convergence", "lines", convergence,
            "Relative error of each case that is refined, against the spacing of its grid.",
        ),
    ),
    "stability": (TableFigure("stability", "energies", "rows", stability, stability_text),),
    "accuracy": (
        TableFigure(
            "accuracy", "pareto", "scatter", accuracy,
            "Error of the feature against the finest grid, and its cost. Dashed: an error of 0.10. "
            "Times belong to the machine that made this page, their ratios less so.",
        ),
        TableFigure(
            "accuracy", "bands", "lines", bands,
            "How far the level in each band lies from that of the finest grid.",
        ),
    ),
    "omissions": (
        TableFigure(
            "omissions", "changes", "rows", omissions,
            "The change if each part of each scene is left out. A part that is left out and lies "
            "to the right of the tolerance is an error of the plan.",
        ),
    ),
    "acoustics": (
        TableFigure(
            "decay", "decay", "lines", decay,
            "Decay time by octave, at the least, the default and the most losses at the walls (rho "
            "c over their impedance).",
        ),
        TableFigure(
            "from_outside", "outside", "lines", outside,
            "Sound from outside at the microphone, by band, through membrane, grains and cavity as "
            "they are solved, and through a limp wall of the membrane's mass.",
        ),
        TableFigure(
            "choices", "choices", "rows", choices,
            "How far each choice moves the feature from that of the default.",
        ),
    ),
    "materials": (
        TableFigure(
            "material_distances", "distances", "rows", distances,
            "Distance of each material from steel, same shape and grasp. A material that is nearer "
            "than another grasp of the steel object cannot be distinguished by this distance.",
        ),
    ),
    "effects": (
        TableFigure(
            "effects", "effects", "rows", effects,
            "The change of the feature by one change of the scene, and the distance of two grasps.",
        ),
    ),
}  # fmt: skip
