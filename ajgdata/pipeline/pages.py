"""Files of the studies, and scenes -> the pages on the virtual gripper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ajgdata.paths import ABLATIONS_PAGE, Paths
from ajgdata.pipeline.studies import GALLERY_CODE
from ajgdata.store.files import write_bytes
from ajgdata.store.provenance import code_digest, software
from ajgdata.store.tables import read_tables

if TYPE_CHECKING:
    from ajgdata.types.table import Table


def build_study_page(paths: Paths, name: str, pages: Sequence[str]) -> None:
    """Draw the figures of the study `name` and write its page, linked with those of `pages`."""
    _tables_page(paths, name, *read_tables(paths.study(name)), pages)


def build_ablations_page(paths: Paths, names: Sequence[str], pages: Sequence[str]) -> None:
    """Write one page on the ablations `names`, linked with those of `pages`."""
    read = [read_tables(paths.ablation(name)) for name in names]
    tables = [table for _, some in read for table in some]
    _tables_page(paths, ABLATIONS_PAGE, read[0][0], tables, pages)


def _tables_page(
    paths: Paths,
    name: str,
    provenance: Mapping[str, Any],
    tables: Sequence[Table],
    pages: Sequence[str],
) -> None:
    from ajgdata.report.render import draw_figures
    from ajgdata.report.study_figures import study_figures
    from ajgdata.report.study_page import page_links, render_study

    by_table = study_figures(name, tables)
    figures = draw_figures((one for some in by_table.values() for one in some),
                           paths.page_figures(name))  # fmt: skip
    placed = {table: [one.name for one in some] for table, some in by_table.items()}
    html = render_study(name, provenance, tables, figures, placed, page_links(pages), paths)
    write_bytes(paths.page(name), html.encode())


def build_gallery(paths: Paths, pages: Sequence[str], *, quick: bool = False) -> None:
    """Draw the gallery's scenes, film one of them, and write the page."""
    from ajgdata.gripper import build_plan, simulate
    from ajgdata.pipeline.show import filmed
    from ajgdata.report.animation import animate
    from ajgdata.report.gallery import FILM, PAGE, groups, illustrations, render_gallery
    from ajgdata.report.render import draw_figures
    from ajgdata.report.study_page import page_links

    shown = groups(quick)
    star = shown[0].exhibits[1]
    plan = build_plan(star.scene)
    drawings = illustrations(shown, star, lambda: simulate(plan))
    figures = draw_figures(drawings, paths.page_figures(PAGE))
    gif = animate(star.scene, filmed(plan))
    write_bytes(paths.page_figure(PAGE, FILM), gif)
    made = {**software(), "code": code_digest(*GALLERY_CODE)}
    html = render_gallery(shown, figures, star, gif, made, page_links(pages), paths)
    write_bytes(paths.page(PAGE), html.encode())
