"""Files of the studies, and scenes -> the pages on the virtual gripper."""

from __future__ import annotations

from collections.abc import Sequence

from ajgdata.paths import Paths
from ajgdata.pipeline.studies import GALLERY_CODE, read_study
from ajgdata.store.files import write_bytes
from ajgdata.store.provenance import code_digest, software


def build_study_page(paths: Paths, name: str, pages: Sequence[str]) -> None:
    """Draw the figures of the study `name` and write its page, linked with those of `pages`."""
    from ajgdata.report.canvas import save_figure
    from ajgdata.report.study_figures import study_figures
    from ajgdata.report.study_page import page_links, render_study

    provenance, tables = read_study(paths.study(name))
    figures = study_figures(name, tables)
    svgs = {}
    for ones in figures.values():
        for figure, illustration in ones.items():
            svg, *_ = save_figure(illustration.draw(), paths.page_figure(name, figure))
            svgs[figure] = svg.read_bytes()
    html = render_study(name, provenance, tables, figures, svgs, page_links(pages))
    paths.page_figures(name).mkdir(parents=True, exist_ok=True)  # also if it holds none
    write_bytes(paths.page(name), html.encode())


def build_gallery(paths: Paths, pages: Sequence[str], *, quick: bool = False) -> None:
    """Draw the gallery's scenes, film one of them, and write the page."""
    from ajgdata.gripper import compile, simulate
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
    plan = compile(star.scene)
    figures[RESPONSE] = response_figure(simulate(plan), star.title, star.scene.numerics)
    svgs = {}
    for name, figure in figures.items():
        svg, *_ = save_figure(figure, paths.page_figure(PAGE, name))
        svgs[name] = svg.read_bytes()
    gif = animate(star.scene, filmed(plan))
    write_bytes(paths.page_figure(PAGE, FILM), gif)
    made = {**software(), "code": code_digest(*GALLERY_CODE)}
    html = render_gallery(shown, svgs, (star, gif), made, page_links(pages))
    write_bytes(paths.page(PAGE), html.encode())
