"""Projections of an embedding -> the page with their interactive scatter plot."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.report.navigation import Group, experiment_link
from ajgdata.store.files import write_bytes
from ajgdata.store.sessions import read_dataset
from ajgdata.store.tables import read_tables


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
    from ajgdata.experiments.embedding_projections import projections_of
    from ajgdata.report.explorer import Explored, render_explorer

    spec, (about, tables) = read_dataset(paths, dataset), read_tables(projections)
    shown = None
    if "skipped" not in about:
        shown = projections_of({table.name: table for table in tables})
    place = paths.explorer(dataset, embedding)
    here = place.relative_to(paths.report.parent).as_posix()
    one = Explored(
        title=f"{spec.title or spec.name} · {embedding.replace('_', ' ')}",
        source="simulated" if about["provenance"]["source"] == "simulated" else "recorded",
        supervision=spec.embeddings[embedding].supervision,
        more=f"../../{experiment_link(PROJECTIONS)}",
        shown=shown,
        available=about.get("available", len(shown.recording) if shown else 0),
        skipped=about.get("skipped", ""),
    )
    write_bytes(page, render_explorer(one, here=here, nav=nav, project=paths).encode())
