"""Pages of the report on simulation studies and ablations."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ajgdata.ablations import with_verdicts
from ajgdata.paths import Paths
from ajgdata.pipeline.exports import write_csv
from ajgdata.pipeline.studies import ABLATIONS_PAGE
from ajgdata.report.navigation import Group
from ajgdata.store.files import write_bytes
from ajgdata.store.tables import read_tables


def build_page(paths: Paths, name: str, files: Sequence[Path], nav: Sequence[Group]) -> None:
    """Draw the figures of the page `name` and write it, with the navigation of the report.

    `files` hold the tables that it shows.
    """
    from ajgdata.report.render import draw_figures
    from ajgdata.report.studies import figures_of, render_study

    read = [read_tables(file) for file in files]
    tables = [table for _, some in read for table in some]
    if name == ABLATIONS_PAGE:
        tables = with_verdicts(tables)
    figures = draw_figures(figures_of(name, tables), paths.page_figures(name))
    for table in tables:
        write_csv(paths.page_figures(name) / f"{table.name}.csv", table)
    html = render_study(name, read[0][0], tables, figures, nav, paths)
    write_bytes(paths.page(name), html.encode())
