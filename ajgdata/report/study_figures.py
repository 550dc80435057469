"""Figures of the studies, by study and table. A table without one is shown as it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from matplotlib.figure import Figure

from ajgdata.report.illustrations import Illustration
from ajgdata.report.wording import Caption
from ajgdata.studies.table import Table

Draw = Callable[[Table], Figure]
#: Caption and drawing by (study, table).
FIGURES: dict[tuple[str, str], tuple[Caption, Draw]] = {}


def study_figures(name: str, tables: Sequence[Table]) -> Mapping[str, Mapping[str, Illustration]]:
    """What to draw for each table of the study `name`; nothing is drawn yet."""
    found: dict[str, dict[str, Illustration]] = {}
    for table in tables:
        if (name, table.name) in FIGURES and table.rows:
            caption, draw = FIGURES[name, table.name]
            found[table.name] = {table.name: Illustration(caption, partial(draw, table))}
    return found
