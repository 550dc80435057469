"""Files of the studies, and scenes -> the pages on the virtual gripper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ajgdata.paths import ABLATIONS_PAGE, Paths
from ajgdata.pipeline.studies import GALLERY_CODE
from ajgdata.store.code_digest import code_digest
from ajgdata.store.files import write_bytes
from ajgdata.store.provenance import software
from ajgdata.store.tables import read_tables

if TYPE_CHECKING:
    from ajgdata.types.table import Table


def build_study_page(paths: Paths, name: str, pages: Sequence[str]) -> None:
    """Draw the figures of the study `name` and write its page, linked with those of `pages`."""
    _tables_page(paths, name, *read_tables(paths.study(name)), pages)


def build_ablations_page(paths: Paths, names: Sequence[str], pages: Sequence[str]) -> None:
    """One page on the ablations `names`, linked with those of `pages`."""
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
    from ajgdata.report.canvas import save_figure
    from ajgdata.report.study_figures import study_figures
    from ajgdata.report.study_page import page_links, render_study

    figures = study_figures(name, tables)
    svgs = {}
    for ones in figures.values():
        for figure, illustration in ones.items():
            svg, *_ = save_figure(illustration.draw(), paths.page_figure(name, figure))
            svgs[figure] = svg.read_bytes()
    html = render_study(name, provenance, tables, figures, svgs, page_links(pages), paths)
    paths.page_figures(name).mkdir(parents=True, exist_ok=True)  # also if it holds none
    write_bytes(paths.page(name), html.encode())


def build_gallery(paths: Paths, pages: Sequence[str], *, quick: bool = False) -> None:
    """Draw the gallery's scenes, film one of them, and write the page."""
    from ajgdata.gripper import build_plan, simulate
    from ajgdata.pipeline.show import filmed
    from ajgdata.report.animation import animate
    from ajgdata.report.canvas import save_figure
    from ajgdata.report.gallery import FILM, PAGE, RESPONSE, Exhibit, groups, render_gallery
    from ajgdata.report.scenes import exhibit_figure, response_figure
    from ajgdata.report.study_page import page_links

    shown = groups(quick)
    figures = {
        one.name: exhibit_figure(one.scene, one.title) for group in shown for one in group.exhibits
    }
    star: Exhibit = shown[0].exhibits[1]
    plan = build_plan(star.scene)
    figures[RESPONSE] = response_figure(simulate(plan), star.title, star.scene.numerics)
    svgs = {}
    for name, figure in figures.items():
        svg, *_ = save_figure(figure, paths.page_figure(PAGE, name))
        svgs[name] = svg.read_bytes()
    gif = animate(star.scene, filmed(plan))
    write_bytes(paths.page_figure(PAGE, FILM), gif)
    made = {**software(), "code": code_digest(GALLERY_CODE)}
    html = render_gallery(shown, svgs, (star, gif), made, page_links(pages), paths)
    write_bytes(paths.page(PAGE), html.encode())
