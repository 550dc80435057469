"""A template, figures and values -> one HTML page that needs no network.

Every page of a report is made here: figures are drawn in the one style and saved in the report's
folder, where the pages find them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markdown_it import MarkdownIt
from markupsafe import Markup

from ajgdata.paths import FIGURE_FORMATS, Paths
from ajgdata.report.format import DASH, Caption, number, sentence, value, words
from ajgdata.report.report_data import Illustration
from ajgdata.store.report_files import template_folders


class DrawnFigure(NamedTuple):
    """A figure that is drawn: `image` is its address relative to the report's folder, as are
    `links`, its files by suffix.
    """

    name: str
    caption: Caption
    image: str
    links: Mapping[str, str]


def drawn_figure(illustration: Illustration, folder: str) -> DrawnFigure:
    """Return an illustration whose files lie in `folder` of the report."""
    name = illustration.name
    links = {suffix: f"{folder}/{name}.{suffix}" for suffix in FIGURE_FORMATS}
    return DrawnFigure(name, illustration.caption, links["svg"], links)


def draw_figures(illustrations: Iterable[Illustration], folder: Path) -> dict[str, DrawnFigure]:
    """Draw figures, save them to `folder`, one of the report's, and return them by name."""
    from ajgdata.report.canvas import draw, save_figure

    listed = list(illustrations)
    folder.mkdir(parents=True, exist_ok=True)  # also if it holds none
    for illustration in listed:
        save_figure(draw(illustration), folder / illustration.name)
    return {illustration.name: drawn_figure(illustration, folder.name) for illustration in listed}


def render(
    template: str,
    figures: Mapping[str, DrawnFigure],
    *,
    here: str = "",
    project: Paths | None = None,
    **values: object,
) -> str:
    """Return a page as HTML text: the same figures and values give the same text.

    `here` is its place relative to the report's folder, from which it finds other files. The
    template gets `figures` by name, and `values`; `nav` is what stands at the side of every page.
    Raises jinja2.UndefinedError for a figure or value that it asks for and is not there.
    """
    own = {"nav": (), "here": here, "root": "../" * here.count("/")}
    return environment(project).get_template(template).render(figures=figures, **(own | values))


def environment(project: Paths | None = None) -> Environment:
    """Return templates whose values are all escaped and none of which may be missing.

    Those of `project` (default: the working folder) come before the packaged ones.
    """
    templates = Environment(
        loader=FileSystemLoader(template_folders(project or Paths())),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters.update(
        number=number,
        words=words,
        markdown=render_markdown,
        sentence=sentence,
        setting=setting,
        value=value,
    )
    return templates


def render_markdown(text: str, top: int = 1) -> Markup:
    """Return Markdown (CommonMark) as HTML; its `#` becomes a heading of level `top`.

    HTML in the text is escaped, and a link that could run a script stays text.
    """
    parser = MarkdownIt("commonmark", {"html": False})
    tokens = parser.parse(text)
    for token in tokens:
        if token.type in ("heading_open", "heading_close"):
            token.tag = f"h{min(int(token.tag[1:]) + top - 1, 6)}"
    return Markup(parser.renderer.render(tokens, parser.options, {}))


def web_link(url: str) -> str:
    """Return `url` if it is a web address that a reader may follow, else nothing."""
    return url if url.startswith(("https://", "http://")) else ""


def setting(value: object) -> str:
    """Return a feature setting as people write it: text, a number, or a band `100 to 6,000`."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return number(value, 6)
    if isinstance(value, tuple | list):
        return " to ".join(map(setting, value))
    return str(value or DASH)
