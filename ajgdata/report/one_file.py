"""One HTML file that contains a report: its pages, figures and sounds, without any other file."""

from __future__ import annotations

import posixpath
from collections.abc import Callable, Mapping
from typing import NamedTuple
from urllib.parse import urldefrag, urlsplit

from bs4 import BeautifulSoup
from bs4.element import Tag

from ajgdata.paths import INDEX

#: Attributes with the anchor of another element.
REFERENCES = ("for", "aria-labelledby", "data-pair")
#: The page of an address is shown, else the first page. Without support of `:has`, all are shown.
STYLE = """
@supports selector(:has(a)) {
  @media screen {
    .page { display: none; }
    .page:target, .page:has(:target) { display: block; }
    #body:not(:has(:target)) > .page:first-of-type { display: block; }
  }
}
"""
NOT_CONTAINED = "sound not contained"
SAME_SOUND = "to the player of this sound"


class OneFile(NamedTuple):
    """A report in one file: HTML text, and the numbers of contained and omitted sounds."""

    html: str
    n_sounds: int
    n_omitted: int


def one_file(
    pages: Mapping[str, str],
    image: Callable[[str], str],
    sound: Callable[[str], str | None],
) -> OneFile:
    """Join the pages of a report to one HTML file.

    Args:
        pages: HTML text of each page by its file, relative to the folder of the report. The first
            page is `index.html`.
        image: Returns the data URI of an image, by its path in the folder of the report.
        sound: Returns the data URI of a sound by its link from the folder of the report, or None
            if the file should not contain it.

    Links between pages become links inside the file. Links to other files become text, because
    the person who receives the file does not have them.
    """
    document = BeautifulSoup(pages[INDEX], "html.parser")
    body = _one(document, "#body")
    body.clear()
    head = _one(document, "head style")
    head.append(STYLE)
    players = _Players(document, sound)
    for name, text in pages.items():
        page = _one(BeautifulSoup(text, "html.parser"), "#body")
        for element in page.select(".phone"):
            element.decompose()  # repeats the first image on small screens
        _move_anchors(page, name)
        _contain_images(page, name, image)
        _link_inside(page, name, pages)
        players.contain(page, name)
        section = document.new_tag("section", attrs={"class": "page", "id": _slug(name)})
        section.extend(list(page.contents))
        body.append(section)
    _link_inside(_one(document, "nav.site"), INDEX, pages, frozenset({"#body"}))
    return OneFile(str(document), len(players.anchors), len(players.omitted))


def _one(document: Tag, selector: str) -> Tag:
    """Return the first element of a selector. Raises ValueError without one."""
    element = document.select_one(selector)
    if element is None:
        raise ValueError(f"the page has no {selector}")
    return element


def _slug(name: str) -> str:
    """Return the anchor of a page."""
    return "page-" + name.removesuffix(".html").replace("/", "-")


def _move_anchors(page: Tag, name: str) -> None:
    """Put the name of the page before each anchor, because pages can have equal anchors."""
    for element in page.select("[id]"):
        element["id"] = f"{_slug(name)}--{element['id']}"
    for attribute in REFERENCES:
        for element in page.select(f"[{attribute}]"):
            element[attribute] = f"{_slug(name)}--{element[attribute]}"


def _contain_images(page: Tag, name: str, image: Callable[[str], str]) -> None:
    """Replace the address of each image by its content."""
    for element in page.select("img[src]"):
        element["src"] = image(_from_folder(name, str(element["src"])))
        del element["loading"]


class _Players:
    """The players of a file: each sound is contained once, and later players lead to the first."""

    def __init__(self, document: BeautifulSoup, sound: Callable[[str], str | None]) -> None:
        self.document = document
        self.sound = sound
        self.anchors: dict[str, str] = {}
        self.omitted: set[str] = set()

    def contain(self, page: Tag, name: str) -> None:
        """Replace the addresses of the sounds of a page by their content."""
        for element in page.select("audio[src]"):
            address = _from_folder(name, str(element["src"]))
            if address in self.anchors:
                link = self.document.new_tag("a", href=f"#{self.anchors[address]}")
                link.string = SAME_SOUND
                element.replace_with(link)
                continue
            content = None if address in self.omitted else self.sound(address)
            if content is None:
                self.omitted.add(address)
                element.replace_with(NOT_CONTAINED)
            else:
                self.anchors[address] = f"sound-{len(self.anchors) + 1}"
                element["id"] = self.anchors[address]
                element["src"] = content


def _link_inside(
    page: Tag, name: str, pages: Mapping[str, str], own: frozenset[str] = frozenset()
) -> None:
    """Lead links to pages inside the file, and replace links to other files by their text.

    `own` are links that stay as they are.
    """
    for files in page.select(".files"):
        files.decompose()
    for element in page.select("a[href]"):
        link = str(element["href"])
        if link in own or urlsplit(link).scheme in ("http", "https", "mailto"):
            continue
        target, anchor = urldefrag(link)
        file = _from_folder(name, target) if target else name
        if file not in pages:
            element.unwrap()
        elif anchor:
            element["href"] = f"#{_slug(file)}--{anchor}"
        else:
            element["href"] = f"#{_slug(file)}"


def _from_folder(name: str, link: str) -> str:
    """Return a link of a page relative to the folder of the report."""
    return posixpath.normpath(posixpath.join(posixpath.dirname(name), link))
