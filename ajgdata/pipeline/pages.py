"""Pages that have jobs of their own: simulation studies, ablations, and scatter plots."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ajgdata.ablations import with_verdicts
from ajgdata.paths import ABLATIONS_PAGE, Paths
from ajgdata.pipeline.exports import write_csv
from ajgdata.report.navigation import Group, experiment_link
from ajgdata.store.files import write_bytes
from ajgdata.store.sessions import read_dataset
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


def build_explorer(
    projections: Path,
    *,
    dataset: str,
    embedding: str,
    paths: Paths,
    page: Path,
    nav: Sequence[Group] = (),
) -> None:
    """Write the page that shows the recordings of an embedding.

    `projections` are the tables of experiment `embedding_projections`.
    """
    from ajgdata.experiments.embedding_projections import NAME as PROJECTIONS
    from ajgdata.experiments.embedding_projections import point_table
    from ajgdata.report.explorer import render_explorer

    spec, (about, tables) = read_dataset(paths, dataset), read_tables(projections)
    points = None if "skipped" in about else point_table(tables)
    count = next((len(table.rows) for table in tables if table.name == "recordings"), 0)
    text = render_explorer(
        points,
        here=paths.explorer(dataset, embedding).relative_to(paths.report.parent).as_posix(),
        nav=nav,
        project=paths,
        title=f"{spec.title or spec.name} · {embedding.replace('_', ' ')}",
        source="simulated" if about["provenance"]["source"] == "simulated" else "recorded",
        supervision=spec.embeddings[embedding].supervision,
        more=f"../../{experiment_link(PROJECTIONS)}",
        available=about.get("available", count),
        skipped=about.get("skipped", ""),
    )
    write_bytes(page, text.encode())
