"""The tables of a study of the virtual gripper -> a page of the report."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from ajgdata.paths import Paths
from ajgdata.report.blocks import Illustration, TableFigure
from ajgdata.report.render import Link, Picture, render
from ajgdata.types.table import Table, Value


class Lead(NamedTuple):
    """Title of a page, the question that it answers, and the group of pages that it belongs to."""

    title: str
    text: str
    about: str = "The virtual gripper"


LEADS = {
    "ablations": Lead(
        "Why simulation and paper differ",
        "Each hypothesis is put to an experiment that could refute it: one thing is changed, all"
        " else stays, and errors are compared on the same grasps. What is supported is a reason"
        " within the simulation; that it holds for the real gripper, too, is a guess.",
        "Beside the paper",
    ),
    "gallery": Lead(
        "Gallery",
        "What the solver is given: the cavity of one grasp of each object and each gripper, cut "
        "through its axis, and the sound moving through one of them.",
    ),
    "verification": Lead(
        "Verification",
        "Does the solver solve the equations it claims to solve? Identities that hold at "
        "round-off, and known answers that it approaches at a known rate.",
    ),
    "stability": Lead(
        "Stability",
        "What becomes of stiff, light, heavy, tiny, huge, hot and impossible scenes: each stays "
        "bounded, or is refused with a reason before anything runs.",
    ),
    "accuracy": Lead(
        "Error against run time",
        "How far a response is from that of a much finer grid, and what it costs to come closer.",
    ),
    "omissions": Lead(
        "What is left out",
        "What a plan leaves out of a scene, what it expected that to change, and what it does "
        "change when it is put back in.",
    ),
    "materials": Lead(
        "Materials",
        "How far apart materials of the same shape sound, beside how far apart two grasps of one "
        "object do.",
    ),
}


def page_links(names: Sequence[str]) -> list[Link]:
    """Return links to the pages `names`, in the order of the report."""
    return [Link(f"{n}.html", lead.title, lead.about) for n, lead in LEADS.items() if n in names]


def placed_figures(
    figures: Iterable[TableFigure], tables: Sequence[Table]
) -> dict[str, list[Illustration]]:
    """Return the figures of each table that has rows, by table; nothing is drawn yet."""
    filled = {table.name: table for table in tables if table.rows}
    placed: dict[str, list[Illustration]] = {}
    for figure in figures:
        if figure.table in filled:
            placed.setdefault(figure.table, []).append(figure.of(filled[figure.table]))
    return placed


def render_study(
    name: str,
    provenance: Mapping[str, Any],
    tables: Sequence[Table],
    figures: Mapping[str, Picture],
    placed: Mapping[str, Sequence[Illustration]],
    pages: Sequence[Link] = (),
    project: Paths | None = None,
) -> str:
    """Return the page as HTML text. `figures` by name; `placed` has those of each table.

    Raises jinja2.UndefinedError for a figure that is not drawn.
    """
    return render(
        "study.html.j2",
        figures,
        project=project,
        title=LEADS[name].title,
        lead=LEADS[name].text,
        provenance=provenance,
        tables=tables,
        placed={table.name: placed.get(table.name, ()) for table in tables},
        numeric=numeric,
        passed=passed,
        holds=holds,
        pages=pages,
    )


def numeric(table: Table, key: str) -> bool:
    """Return whether a column holds numbers, finite or not, and perhaps gaps: set flush right."""
    found = [value for value in table.column(key) if value is not None]
    return bool(found) and all(
        value in ("inf", "-inf", "nan") if isinstance(value, str) else not isinstance(value, bool)
        for value in found
    )


def holds(row: Mapping[str, Value]) -> bool | None:
    """Return whether a row that says `passed`, or `expected` and `outcome`, says that all is well.

    None for a row that says neither.
    """
    if "passed" in row:
        return None if row["passed"] is None else bool(row["passed"])
    if {"expected", "outcome"} <= set(row):
        return row["expected"] == row["outcome"]
    return None


def passed(table: Table) -> str:
    """Return `12 of 13 hold.` for a table whose rows can hold or fail, else nothing."""
    said = [verdict for row in table.rows if (verdict := holds(row)) is not None]
    return f"{sum(said)} of {len(said)} hold." if said else ""
