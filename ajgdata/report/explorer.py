"""Interactive scatter plot of the projections of an embedding, in one file without network access.

The content policy names the scripts by hash, so text of a data set cannot run.
"""

from __future__ import annotations

import base64
import hashlib
import html
import re
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from ajgdata.paths import Paths
from ajgdata.report.format import Source, value, words
from ajgdata.report.navigation import Group
from ajgdata.report.projections import (
    METHODS,
    MISSING,
    SPACES,
    Projection,
    Projections,
    shown_columns,
    text_colours,
)
from ajgdata.report.render import render

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

HEIGHT_PX, MARKER_PX = 640, 7


class Explored(NamedTuple):
    """One embedding of a data set; `shown` is None if there are no projections, see `skipped`.

    `more` is a link to the report's section on the embedding, `note` says which recordings are
    shown.
    """

    title: str
    source: Source
    supervision: str
    more: str
    shown: Projections | None
    note: str = ""
    skipped: str = ""


def render_explorer(
    one: Explored, *, here: str = "", nav: Sequence[Group] = (), project: Paths | None = None
) -> str:
    """Return the page as HTML text: the same content gives the same text.

    `here` is its place relative to the report's folder, `nav` the navigation of the report.
    """
    plot = ""
    if one.shown is not None:
        plot = scatter(one.shown).to_html(
            full_html=False, include_plotlyjs=True, div_id="plot",
            config={"displayModeBar": False, "responsive": True},
        )  # fmt: skip
    scripts = re.findall(r"<script[^>]*>(.*?)</script>", plot, flags=re.DOTALL)
    digests = (hashlib.sha256(script.encode()).digest() for script in scripts)
    return render(
        "explorer.html.j2",
        {},
        here=here,
        project=project,
        nav=nav,
        one=one,
        plot=Markup(plot),  # plotly escapes "<" in what it is given
        policy=" ".join(f"'sha256-{base64.b64encode(one).decode()}'" for one in digests),
    )


def scatter(shown: Projections) -> Figure:
    """Return a scatter plot with menus for the space and for the column that gives the colours.

    Filled markers: the encoder was trained on the recording; open markers: it was not.
    """
    from plotly.graph_objects import Figure, Scatter

    texts = np.array(_texts(shown))
    symbols = np.where(shown.training, "circle", "circle-open")
    columns = shown_columns(shown) or list(shown.columns)[:1]
    traces, column_of, rows_of = [], list[str](), list[NDArray[np.intp]]()
    for column in columns:
        for rows, name, colour in _levels(words(column), shown.columns[column]):
            marker = {**colour, "symbol": symbols[rows].tolist(), "size": MARKER_PX}
            traces.append(
                Scatter(
                    mode="markers", name=html.escape(name), marker=marker, hoverinfo="text",
                    text=texts[rows].tolist(), visible=column == columns[0], showlegend=True,
                    **_places(shown.projections[0], rows),
                )
            )  # fmt: skip
            column_of.append(column)
            rows_of.append(rows)
    spaces = []
    for projection in shown.projections:
        places = [_places(projection, rows) for rows in rows_of]
        args = {axis: [place[axis] for place in places] for axis in ("x", "y")}
        spaces.append({"label": space_label(projection), "method": "restyle", "args": [args]})
    colours = []
    for column in columns:
        visible = {"visible": [other == column for other in column_of]}
        colours.append({"label": words(column), "method": "restyle", "args": [visible]})
    menu: dict[str, Any] = {"y": 1.02, "xanchor": "left", "yanchor": "bottom"}
    figure = Figure(traces)
    figure.update_layout(
        updatemenus=[{**menu, "x": 0, "buttons": spaces}, {**menu, "x": 0.4, "buttons": colours}],
        height=HEIGHT_PX, template="plotly_white", hovermode="closest", yaxis={"scaleanchor": "x"},
        margin={"l": 40, "r": 10, "t": 60, "b": 40},
    )  # fmt: skip
    return figure


def space_label(one: Projection) -> str:
    """Return `latent · UMAP`; a space that has two dimensions is shown as it is."""
    name = SPACES.get(one.space, one.space)
    return f"{name} · {METHODS[one.method]}"


def _places(projection: Projection, rows: NDArray[np.intp]) -> dict[str, list[float]]:
    """Return `x` and `y` of some recordings, to five digits."""
    across, up = np.asarray(projection.points, float)[rows].T
    return {
        axis: [float(f"{number:.5g}") for number in numbers]
        for axis, numbers in (("x", across), ("y", up))
    }


def _texts(shown: Projections) -> list[str]:
    """Return what is known of each recording, as text for plotly: lines with `<br>`."""
    labels = {words(name): values.tolist() for name, values in shown.columns.items()}
    listed = []
    for row, recording in enumerate(shown.recording.tolist()):
        facts = [f"{name}: {_shown(values[row])}" for name, values in labels.items()]
        listed.append("<br>".join(html.escape(line) for line in (recording, *facts)))
    return listed


def _shown(label: Any) -> str:
    missing = label == "" or (isinstance(label, float) and not np.isfinite(label))
    return value(None if missing else label)


def _levels(title: str, values: NDArray) -> Iterator[tuple[NDArray[np.intp], str, dict[str, Any]]]:
    """Yield row numbers, name and plotly's colour settings of each text, or of all numbers."""
    if values.dtype.kind == "U":
        for name, colour in text_colours(values).items():
            yield np.flatnonzero(values == name), words(name), {"color": colour}
        known = values != ""
    else:
        known = np.isfinite(values)
        colours = {"color": values[known].tolist(), "colorscale": "Viridis", "showscale": True}
        bar = {"title": {"text": html.escape(title)}, "x": 1, "y": 0, "yanchor": "bottom"}
        yield np.flatnonzero(known), title, {**colours, "colorbar": {**bar, "len": 0.8}}
    if not known.all():
        yield np.flatnonzero(~known), "not known", {"color": MISSING}
