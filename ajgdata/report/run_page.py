"""What changed between two runs -> one HTML file that needs no other: figures, then tables."""

from __future__ import annotations

import base64
from typing import NamedTuple

from ajgdata.paths import Paths
from ajgdata.report.format import Caption
from ajgdata.report.render import environment
from ajgdata.report.run_figures import illustrations
from ajgdata.report.run_tables import (
    IN_SD,
    TOP,
    RunComparison,
    changes_table,
    costs_table,
    flips_table,
    only_table,
    settings_table,
    summary,
    verdicts_table,
)


class Drawn(NamedTuple):
    """A figure within the page: `image` is its address, which holds it."""

    name: str
    caption: Caption
    image: str


def render_comparison(found: RunComparison, project: Paths | None = None) -> str:
    """Return the page as HTML text: the same comparison gives the same text."""
    from ajgdata.report.canvas import draw, encode

    figures = []
    for one in illustrations(found):
        svg = base64.b64encode(encode(draw(one), "svg")).decode("ascii")
        figures.append(Drawn(one.name, one.caption, f"data:image/svg+xml;base64,{svg}"))
    leading = found.leading()
    top = leading[:TOP]
    changed = found.numbers.changed
    only = {"A": found.numbers.only_a, "B": found.numbers.only_b}
    sections = (
        (
            "changed",
            "What changed most",
            changes_table(top, f"{len(top)} of {len(leading)}. {IN_SD}"),
        ),
        ("predictions", "Predictions that flipped", flips_table(found.flips)),
        ("paper", "Agreement with the paper", verdicts_table(found.verdicts)),
        ("why", "What differs in how they were made", settings_table(found.settings)),
        ("costs", "Time and memory", costs_table(found.numbers.costs)),
        ("only", "Only in one of them", only_table(only)),
    )
    return (
        environment(project)
        .get_template("compare.html.j2")
        .render(
            nav=(),
            here="",
            root="",
            found=found,
            summary=summary(found),
            figures=figures,
            sections=[one for one in sections if one[2].rows],
            every=changes_table(changed, "All, beyond their spread first."),
        )
    )
