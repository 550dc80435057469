"""Interactive scatter plots of the projections of an embedding, in one file without network access.

The content policy names the scripts by hash, so text of a data set cannot run.
"""

from __future__ import annotations

import base64
import hashlib
import html
import re
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import pandas as pd
from markupsafe import Markup

from ajgdata.paths import Paths
from ajgdata.report.format import words
from ajgdata.report.navigation import Group
from ajgdata.report.render import render

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

SYMBOLS = {"training": "circle", "validation": "circle-open"}
#: Columns of the points that are no labels of the recordings.
PLACE = ["space", "x", "y", "recording", "part"]
#: Columns of more distinct texts are not drawn: no legend tells them apart.
MAX_TEXTS = 20


def render_explorer(
    points: pd.DataFrame | None,
    *,
    here: str = "",
    nav: Sequence[Group] = (),
    project: Paths | None = None,
    **about: object,
) -> str:
    """Return the page as HTML text: the same content gives the same text.

    `points` has a row per space and recording (`scatters`). `about` are the values of the template:
    `title`, `source`, `supervision`, `more` (a link to the report's section on the embedding),
    `available` (number of recordings) and `skipped` (why there are no points). `here` is the page's
    place relative to the report's folder, `nav` the navigation of the report.
    """
    plot = "".join(
        figure.to_html(
            full_html=False, include_plotlyjs=number == 0, div_id=f"plot-{number}", auto_play=False,
            config={"displayModeBar": False, "responsive": True},
        )
        for number, figure in enumerate(scatters(points) if points is not None else ())
    )  # fmt: skip
    scripts = re.findall(r"<script[^>]*>(.*?)</script>", plot, flags=re.DOTALL)
    digests = (hashlib.sha256(script.encode()).digest() for script in scripts)
    return render(
        "explorer.html.j2",
        {},
        here=here,
        project=project,
        nav=nav,
        count=0 if points is None else points["recording"].nunique(),
        plot=Markup(plot),  # plotly escapes "<" in what it is given
        policy=" ".join(f"'sha256-{base64.b64encode(one).decode()}'" for one in digests),
        **about,
    )


def scatters(points: pd.DataFrame) -> Iterator[Figure]:
    """Yield a scatter plot per column of labels, with a slider for the space.

    `points`: `space`, place (`x`, `y`), `recording` and `part` (training or validation), then the
    labels. Filled markers: the encoder was trained on the recording; open markers: it was not.
    """
    import plotly.express as px

    labels = [str(name) for name in points if name not in PLACE]
    texts = points.select_dtypes(exclude="number").columns
    points = points.assign(
        **{n: points[n].replace("", "not known").map(html.escape) for n in texts}
    )
    counts = points[labels].nunique()
    drawn = [n for n in labels if counts[n] > 1 and (n not in texts or counts[n] <= MAX_TEXTS)]
    for column in drawn or labels[:1]:
        figure = px.scatter(
            points, x="x", y="y", color=column, symbol="part", symbol_map=SYMBOLS,
            animation_frame="space", hover_name="recording", hover_data=labels,
            range_x=(-1.1, 1.1), range_y=(-1.1, 1.1), labels={n: words(n) for n in labels},
            color_discrete_sequence=px.colors.qualitative.Dark24, render_mode="svg", height=640,
            template="plotly_white", title=f"Colour: {words(column)}",
        )  # fmt: skip
        figure.layout.updatemenus = ()
        figure.update_layout(coloraxis_colorbar={"y": 0.3, "len": 0.6})
        figure.update_layout(sliders=[{"currentvalue": {"prefix": ""}}])
        figure.update_yaxes(scaleanchor="x")
        yield figure
