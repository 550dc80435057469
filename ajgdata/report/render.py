"""Templates and drawn figures: a page is a template that places the values of a view.

A view is a record with the texts, links and figures of one page. Python computes it, so that a
template contains no decision except whether a value is present.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markdown_it import MarkdownIt
from markupsafe import Markup

from ajgdata.paths import FIGURE_FORMATS, Paths
from ajgdata.report.format import Caption
from ajgdata.report.navigation import Group, groups_on
from ajgdata.report.report_data import Illustration
from ajgdata.store.report_files import template_folders

#: Script of all pages: tables sort and filter.
SCRIPT = "report.js"


class FileLink(NamedTuple):
    """A file of a figure: the format as the title of the link, and the punctuation after it."""

    title: str
    link: str
    punctuation: str


class DrawnFigure(NamedTuple):
    """A figure whose files exist.

    `image` and the files by suffix, `links`, are relative to the folder of the report.
    """

    name: str
    caption: Caption
    image: str
    links: Mapping[str, str]

    @property
    def files(self) -> list[FileLink]:
        """Return the links to the files, separated by commas."""
        last = len(self.links) - 1
        return [
            FileLink(suffix.upper(), link, "," if number < last else ".")
            for number, (suffix, link) in enumerate(self.links.items())
        ]


def drawn_figure(illustration: Illustration, folder: str) -> DrawnFigure:
    """Return an illustration whose files are in `folder` of the report."""
    name = illustration.name
    links = {suffix: f"{folder}/{name}.{suffix}" for suffix in FIGURE_FORMATS}
    return DrawnFigure(name, illustration.caption, links["svg"], links)


def draw_figures(illustrations: Iterable[Illustration], folder: Path) -> dict[str, DrawnFigure]:
    """Draw figures, save them to `folder` of the report, and return them by name."""
    from ajgdata.report.canvas import draw, save_figure

    listed = list(illustrations)
    folder.mkdir(parents=True, exist_ok=True)  # also for a report without figures
    for illustration in listed:
        save_figure(draw(illustration), folder / illustration.name)
    return {illustration.name: drawn_figure(illustration, folder.name) for illustration in listed}


def render(
    template: str,
    *,
    here: str = "",
    nav: Sequence[Group] = (),
    project: Paths | None = None,
    **values: object,
) -> str:
    """Return a page as HTML text. Equal values give equal text.

    `here` is the file of the page, relative to the folder of the report; `root` leads from there to
    this folder. `nav` is the navigation. Raises jinja2.UndefinedError if the template names a value
    that does not exist.
    """
    templates = environment(project)
    shared = {
        "nav": groups_on(here, nav),
        "root": "../" * here.count("/"),
        "script": _script(templates),
    }
    return templates.get_template(template).render(**shared, **values)


class PageScript(NamedTuple):
    """The script of all pages, and its hash, without which a browser does not run it."""

    text: Markup
    hash: str


def _script(templates: Environment) -> PageScript:
    """Return the script of the project, or the packaged one."""
    text = templates.get_template(SCRIPT).render()
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
    return PageScript(Markup(text), f"sha256-{digest}")


def environment(project: Paths | None = None) -> Environment:
    """Return the environment of all templates: it escapes values, and a missing value is an error.

    Templates of `project` (default: the working folder) take the place of packaged templates.
    """
    return Environment(
        loader=FileSystemLoader(template_folders(project or Paths())),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


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
