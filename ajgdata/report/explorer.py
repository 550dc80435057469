"""Interactive scatter plots of the projections of an embedding, in one file without network access.

The content policy names the scripts by hash, so text of a data set cannot run.
"""

from __future__ import annotations

import base64
import hashlib
import html
import re
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pandas as pd
from markupsafe import Markup

from ajgdata.paths import Paths
from ajgdata.report.format import Source, words
from ajgdata.report.navigation import Group
from ajgdata.report.projections import METHODS, SPACES, Projection, Projections, shown_columns
from ajgdata.report.render import render

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

#: Of more recordings, this many are shown, so that the page opens quickly.
MOST_SHOWN = 1000
SYMBOLS = {"training": "circle", "validation": "circle-open"}


class Explored(NamedTuple):
    """One embedding of a data set; `shown` is None if there are no projections, see `skipped`.

    `more` is a link to the report's section on the embedding, `available` counts its recordings.
    """

    title: str
    source: Source
    supervision: str
    more: str
    shown: Projections | None
    available: int = 0
    skipped: str = ""


def render_explorer(
    one: Explored, *, here: str = "", nav: Sequence[Group] = (), project: Paths | None = None
) -> str:
    """Return the page as HTML text: the same content gives the same text.

    `here` is its place relative to the report's folder, `nav` the navigation of the report.
    """
    frame = point_table(one.shown) if one.shown else pd.DataFrame()
    plot = "".join(
        figure.to_html(
            full_html=False, include_plotlyjs=number == 0, div_id=f"plot-{number}", auto_play=False,
            config={"displayModeBar": False, "responsive": True},
        )
        for number, figure in enumerate(scatters(one.shown, frame) if one.shown else ())
    )  # fmt: skip
    scripts = re.findall(r"<script[^>]*>(.*?)</script>", plot, flags=re.DOTALL)
    digests = (hashlib.sha256(script.encode()).digest() for script in scripts)
    count = 0 if frame.empty else frame["recording"].nunique()
    return render(
        "explorer.html.j2",
        {},
        here=here,
        project=project,
        nav=nav,
        one=one,
        count=count,
        plot=Markup(plot),  # plotly escapes "<" in what it is given
        policy=" ".join(f"'sha256-{base64.b64encode(one).decode()}'" for one in digests),
    )


def point_table(shown: Projections, most: int = MOST_SHOWN) -> pd.DataFrame:
    """Return a row per space and recording: place (x, y; each space from -1 to 1) and labels.

    At most `most` recordings, evenly drawn from their order. Text is escaped for plotly.
    """
    count = len(shown.recording)
    rows = np.linspace(0, count - 1, min(most, count)).round().astype(int)
    known = pd.DataFrame({"recording": shown.recording, **shown.columns}).iloc[rows]
    known["part"] = np.where(shown.training[rows], "training", "validation")
    for name in known.select_dtypes(exclude="number"):
        known[name] = known[name].replace("", "not known").map(html.escape)
    return pd.concat(
        [
            known.assign(space=space_label(one), x=x, y=y)
            for one in shown.projections
            for x, y in [_in_unit_square(one)[rows].T]
        ]
    )


def _in_unit_square(projection: Projection) -> np.ndarray:
    """Return the points (n, 2), moved and scaled: a projection has no unit."""
    points = np.asarray(projection.points, float)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    return (points - middle) / (np.abs(points - middle).max() or 1.0)


def scatters(shown: Projections, points: pd.DataFrame) -> Iterator[Figure]:
    """Yield a scatter plot per column of labels, with a slider for the space.

    Filled markers: the encoder was trained on the recording; open markers: it was not.
    """
    import plotly.express as px

    for column in shown_columns(shown) or list(shown.columns)[:1]:
        figure = px.scatter(
            points, x="x", y="y", color=column, symbol="part", symbol_map=SYMBOLS,
            animation_frame="space", hover_name="recording", hover_data=list(shown.columns),
            range_x=(-1.1, 1.1), range_y=(-1.1, 1.1), labels={n: words(n) for n in shown.columns},
            color_discrete_sequence=px.colors.qualitative.Dark24, render_mode="svg", height=640,
            template="plotly_white", title=f"Colour: {words(column)}",
        )  # fmt: skip
        figure.layout.updatemenus = ()
        figure.update_layout(coloraxis_colorbar={"y": 0.3, "len": 0.6})
        figure.update_layout(sliders=[{"currentvalue": {"prefix": ""}}])
        figure.update_yaxes(scaleanchor="x")
        yield figure


def space_label(one: Projection) -> str:
    """Return `latent · UMAP`; a space that has two dimensions is shown as it is."""
    name = SPACES.get(one.space, one.space)
    return f"{name} · {METHODS[one.method]}"
