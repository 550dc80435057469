"""The gallery: the scenes that it shows, and its page."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

from ajgdata.gripper import ImpulseResponse
from ajgdata.gripper.grippers import GRIPPERS
from ajgdata.gripper.scene import Scene
from ajgdata.paths import Paths
from ajgdata.report.blocks import Illustration
from ajgdata.report.format import Caption, number
from ajgdata.report.navigation import LEADS
from ajgdata.report.navigation import Group as Pages
from ajgdata.report.render import Picture, render
from ajgdata.report.scenes import Section, exhibit_figure, response_figure, section

PAGE = "gallery"
#: What the grippers hold.
HELD = "cube_20p7"
SHOWN = (
    "cube_10p0",
    HELD,
    "cube_30p0",
    "sphere30_wood",
    "sphere80_styrofoam",
    "plate_metal",
    "bar",
    "tennis_ball",
    "banana",
    "screwdriver",
    "spoon",
    "padlock",
    "foam_brick",
    "spam_can",
)
FILM, RESPONSE = "pressure.gif", "response"
FILM_TEXT = (
    "A wavelet around 4 kHz leaves the speaker. Red: pressure above rest, blue: below; the colours "
    "follow the logarithm of strong pressures, so that echoes are seen. Brown line: free surface "
    "of the grains, in which sound is slower and is damped."
)
RESPONSE_TEXT = (
    "What the microphone hears of a pulse in the same scene. Top: the response, and the energy "
    "that is still to come. Bottom: its spectrum, and the band in which it is the gripper's and "
    "not the grid's."
)


class Exhibit(NamedTuple):
    """One picture of the gallery: its file name without suffix, its title and its scene."""

    name: str
    title: str
    scene: Scene


@dataclass(frozen=True)
class Group:
    """Exhibits that belong together."""

    id: str
    title: str
    text: str
    exhibits: tuple[Exhibit, ...]


def caption(exhibit: Exhibit) -> Caption:
    """Return the measures of the drawn geometry, in words."""
    cut: Section = section(exhibit.scene)
    cavity = cut.roof > cut.floor
    clearance = float((cut.roof - cut.surface)[cavity].max())
    sizes = " × ".join(map(number, shape.size_mm)) if (shape := exhibit.scene.object) else ""
    held = f", {shape.kind} of {sizes} mm" if shape else ""
    text = f"{exhibit.title}{held}. Air above the bed: up to {number(clearance, 2)} mm."
    if cut.table is not None:
        raised = float(cut.floor.min() + exhibit.scene.gripper.balloon_depth_mm)
        text += f" Lowest point of the membrane raised by {number(max(raised, 0), 2)} mm."
    return Caption(text, f"Cross-section of the cavity, cut at y = 0. {text}")


def illustrations(
    groups: Sequence[Group], star: Exhibit, response: Callable[[], ImpulseResponse]
) -> list[Illustration]:
    """Return a figure of each exhibit, and one, called RESPONSE, of what is heard in `star`."""
    words = Caption(RESPONSE_TEXT, f"Impulse response and spectrum with {star.title}.")
    listed = [Illustration(RESPONSE, words, lambda: response_figure(
        response(), star.title, star.scene.numerics
    ))]  # fmt: skip
    for one in (one for group in groups for one in group.exhibits):
        draw = partial(exhibit_figure, one.scene, one.title)
        listed.append(Illustration(one.name, caption(one), draw))
    return listed


def render_gallery(
    groups: Sequence[Group],
    figures: Mapping[str, Picture],
    star: Exhibit,
    provenance: Mapping[str, Any],
    nav: Sequence[Pages] = (),
    project: Paths | None = None,
) -> str:
    """Return the page as HTML text; `figures` are the `illustrations`, the film is of `star`."""
    film = {"title": star.title, "text": FILM_TEXT, "link": f"{PAGE}/{FILM}"}
    return render(
        "gallery.html.j2",
        figures,
        project=project,
        title=LEADS[PAGE].title,
        lead=LEADS[PAGE].text,
        provenance=provenance,
        nav=nav,
        here=f"{PAGE}.html",
        film=film,
        groups=groups,
    )


def groups(quick: bool = False) -> tuple[Group, ...]:
    """Return a dozen objects, and all grippers but the default on a cube; `quick`: two each."""
    grippers = [name for name in GRIPPERS if name != "default"]
    few = 2 if quick else None
    return (
        Group(
            "objects",
            "Objects",
            "One grasp of each in the default gripper. A sphere, a lying rod or an ellipsoid is "
            "drawn whole, the others as the membrane meets them: what hangs over is filled below.",
            tuple(_exhibit(name, object=name) for name in SHOWN[:few]),
        ),
        Group(
            "grippers",
            "Grippers",
            "Variants of the default gripper, each pressed on the same cube.",
            tuple(_exhibit(name, gripper=name, object=HELD) for name in grippers[:few]),
        ),
    )


def _exhibit(name: str, **spec: str) -> Exhibit:
    title = re.sub(r"(\d)p(\d)", r"\1.\2", name).replace("_", " ").replace("-", " ")
    return Exhibit(name, title, Scene.model_validate(spec))
