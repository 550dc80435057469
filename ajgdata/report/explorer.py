"""All projections of a space in one HTML file: hover tells the recording, a click plays it.

The file needs no network. Its script is named by hash in the content policy: nothing that a data
set says can run.
"""

from __future__ import annotations

import base64
import hashlib
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from ajgdata.paths import Paths
from ajgdata.report.format import Source, value, words
from ajgdata.report.navigation import Group
from ajgdata.report.projections import (
    METHODS,
    MISSING,
    NUMBERS,
    SPACES,
    Projection,
    Projections,
    shown_columns,
    text_colours,
)
from ajgdata.report.render import environment, render

SCRIPT = "explorer.js"
#: Drawing area in units of the picture, and the room left around the points.
WIDTH, HEIGHT, MARGIN = 1000, 700, 30
#: Shades of a number.
STEPS = 32


class Explored(NamedTuple):
    """One embedding of a data set: what the page says of it, and `shown` or why there is nothing.

    `more` is a link to the report's section on it.
    """

    title: str
    source: Source
    supervision: str
    more: str
    shown: Projections | None
    skipped: str = ""


def render_explorer(
    one: Explored,
    clips: Mapping[str, bytes],
    sound: str,
    *,
    here: str = "",
    nav: Sequence[Group] = (),
    project: Paths | None = None,
) -> str:
    """Return the page as HTML text: the same content gives the same text.

    `clips` are MP3s by recording, perhaps not of all; `sound` says what was done to them. Of an
    embedding without projections it says why there are none. `here` is its place relative to the
    report's folder, `nav` the navigation of the report.
    """
    pages = environment(project)
    source = pages.loader.get_source(pages, SCRIPT)[0] if pages.loader else ""
    # Jinja's include would strip the last line's end: the hash is of what stands in the page.
    script = source.strip()
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return render(
        "explorer.html.j2",
        {},
        here=here,
        project=project,
        nav=nav,
        one=one,
        content=content(one.shown, clips) if one.shown else None,
        script=Markup(script),  # ours, and free of "</"
        script_hash=f"sha256-{digest}",
        sound=sound,
        heard=len(clips),
        width=WIDTH,
        height=HEIGHT,
    )


def content(shown: Projections, clips: Mapping[str, bytes]) -> dict[str, Any]:
    """Return what the script is given, as JSON has it: lists are in the order of the recordings."""
    names = shown.recording.tolist()
    return {
        "recordings": names,
        "training": shown.training.astype(int).tolist(),
        "facts": [
            {"label": words(name), "values": [_fact(v) for v in values.tolist()]}
            for name, values in shown.columns.items()
        ],
        "colours": [
            {"label": words(name), **_colours(shown.columns[name])} for name in shown_columns(shown)
        ],
        "spaces": [
            {"label": space_label(one), "points": placed(one.points)} for one in shown.projections
        ],
        "clips": [base64.b64encode(clips.get(name, b"")).decode() for name in names],
    }


def space_label(one: Projection) -> str:
    """Return `latent · UMAP`; a space that has two dimensions is shown as it is."""
    name = SPACES.get(one.space, one.space)
    return f"{name} · {METHODS[one.method]}" if one.method in METHODS else f"{name} · 2-D"


def placed(points: NDArray[np.floating]) -> list[list[float]]:
    """Return points (n, 2) on the drawing area, up being up, one scale for both axes.

    Identical points stand in the middle.
    """
    given = np.asarray(points, float)
    low, high = given.min(axis=0, initial=np.inf), given.max(axis=0, initial=-np.inf)
    if not len(given):
        return []
    room = np.array([WIDTH, HEIGHT]) - 2 * MARGIN
    size = high / 2 - low / 2  # halves: the whole may overflow
    with np.errstate(divide="ignore", over="ignore"):
        scale = float(np.min(room / 2 / np.where(size > 0, size, 0)))
    if not math.isfinite(scale):
        scale = 0.0
    moved = (given - (low / 2 + high / 2)) * scale
    return np.round(np.array([WIDTH / 2, HEIGHT / 2]) + moved * [1, -1], 1).tolist()


def _fact(given: Any) -> str:
    if isinstance(given, float) and not math.isfinite(given):
        return value(None)
    return value(given) if given != "" else value(None)


def _colours(values: NDArray) -> dict[str, Any]:
    """Return `palette`, the entry of it (n,) of each recording, and the legend."""
    if values.dtype.kind == "U":
        named = text_colours(values)
        place = {name: i for i, name in enumerate(named)}
        return {
            "palette": [*named.values(), MISSING],
            "entries": [place.get(name, len(named)) for name in values.tolist()],
            "legend": [words(name) for name in named],
        }
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    known = np.isfinite(values)
    low, high = float(values[known].min()), float(values[known].max())
    share = (np.where(known, values, low) - low) / (high - low)
    entries = np.where(known, np.round(share * (STEPS - 1)), STEPS).astype(int)
    shades = [to_hex(c) for c in colormaps[NUMBERS](np.linspace(0, 1, STEPS))]
    return {
        "palette": [*shades, MISSING],
        "entries": entries.tolist(),
        "range": [value(low), value(high)],
    }
