"""Files of studies and ablations, and scenes -> their pages beside the report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ajgdata.ablations import ABLATIONS, ablation
from ajgdata.ablations.base import with_verdicts
from ajgdata.paths import ABLATIONS_PAGE, Paths
from ajgdata.pipeline.exports import write_csv
from ajgdata.pipeline.studies import GALLERY
from ajgdata.report.navigation import Group
from ajgdata.store.files import write_bytes
from ajgdata.store.provenance import layer_hash, software
from ajgdata.store.tables import read_tables


def build_page(
    paths: Paths, name: str, files: Sequence[Path], nav: Sequence[Group], *, quick: bool = False
) -> None:
    """Draw the figures of the page `name` and write it, with the navigation of the report.

    `files` hold the tables that it shows; the gallery has none, and with `quick` fewer scenes.
    """
    html = _gallery(paths, nav, quick) if name == GALLERY else _tables(paths, name, files, nav)
    write_bytes(paths.page(name), html.encode())


def _tables(paths: Paths, name: str, files: Sequence[Path], nav: Sequence[Group]) -> str:
    from ajgdata.report.render import draw_figures
    from ajgdata.report.study_figures import FIGURES
    from ajgdata.report.study_page import placed_figures, render_study

    read = [read_tables(file) for file in files]
    tables = [table for _, some in read for table in some]
    if name == ABLATIONS_PAGE:
        tables = with_verdicts(tables)
        wanted = [figure for one in ABLATIONS for figure in ablation(one).figures]
    else:
        wanted = list(FIGURES.get(name, ()))
    placed = placed_figures(wanted, tables)
    listed = [one for some in placed.values() for one in some]
    figures = draw_figures(listed, paths.page_figures(name))
    for table in tables:
        write_csv(paths.page_figures(name) / f"{table.name}.csv", table)
    return render_study(name, read[0][0], tables, figures, placed, nav, paths)


def _gallery(paths: Paths, nav: Sequence[Group], quick: bool) -> str:
    from ajgdata.gripper import build_plan, simulate
    from ajgdata.pipeline.show import filmed
    from ajgdata.report.animation import animate
    from ajgdata.report.gallery import FILM, groups, illustrations, render_gallery
    from ajgdata.report.render import draw_figures

    shown = groups(quick)
    star = shown[0].exhibits[1]
    plan = build_plan(star.scene)
    drawings = illustrations(shown, star, lambda: simulate(plan))
    figures = draw_figures(drawings, paths.page_figures(GALLERY))
    gif = animate(star.scene, filmed(plan))
    write_bytes(paths.page_figure(GALLERY, FILM), gif)
    about = {**software(), "code": layer_hash("report")}
    return render_gallery(shown, figures, star, about, nav, paths)
