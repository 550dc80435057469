"""Embeddings -> the page on them, and what stands beside the paper."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ajgdata.paths import FIGURE_FORMATS, Paths
from ajgdata.report.blocks import Illustration
from ajgdata.report.distances import apart_text
from ajgdata.report.embedded import SPACES, Embedded, ordered
from ajgdata.report.embedding_blocks import blocks, flat
from ajgdata.report.format import number
from ajgdata.report.latents import clusters_text
from ajgdata.report.neighbours import gain_text
from ajgdata.report.paper import PaperFigure
from ajgdata.report.render import Link, data_uri, environment
from ajgdata.report.study_page import LEADS

PAGE = "embedding"


class Claim(NamedTuple):
    """A statement of the paper, and what was found here."""

    claim: str
    about: Embedded
    found: str
    paper: PaperFigure | None


def render_embeddings(
    shown: Sequence[Embedded],
    svgs: Mapping[str, bytes],
    paper: Mapping[str, PaperFigure],
    provenance: Mapping[str, Any],
    explorers: Mapping[str, str],
    pages: Sequence[Link] = (),
    project: Paths | None = None,
) -> str:
    """The page as HTML text. `svgs` by name of figure, `explorers` links by id of an embedding.

    Raises ValueError if a figure is missing.
    """
    parts = {one.id: blocks(one) for one in shown}
    drawn = [name for part in parts.values() for block in part for name in block.figures]
    if missing := sorted(set(drawn) - set(svgs)):
        raise ValueError(f"figures not drawn: {', '.join(missing)}")
    return (
        environment(project)
        .get_template("embedding.html.j2")
        .render(
            title=LEADS[PAGE].title,
            lead=LEADS[PAGE].text,
            provenance=provenance,
            pages=pages,
            shown=shown,
            parts=parts,
            claims=claims(shown, paper),
            explorers=explorers,
            image={name: data_uri(svgs[name]) for name in drawn},
            links=lambda name: {suffix: f"{PAGE}/{name}.{suffix}" for suffix in FIGURE_FORMATS},
        )
    )


def figures(shown: Sequence[Embedded]) -> dict[str, Illustration]:
    """Every figure of the page by file name; nothing is drawn yet.

    Raises ValueError if names of data sets and embeddings run together to one file name.
    """
    parts = [block.figures for one in shown for block in blocks(one)]
    named = {name: illustration for part in parts for name, illustration in part.items()}
    if len(named) != sum(map(len, parts)):
        raise ValueError("two figures would share a file name: rename an embedding")
    return named


def claims(shown: Sequence[Embedded], paper: Mapping[str, PaperFigure]) -> list[Claim]:
    """The paper's statements on embeddings; its own recordings are only simulated here."""
    listed = []
    for key, (claim, finding) in CLAIMS.items():
        for one in shown:
            beside = paper.get(key) if one.source == "simulated" else None
            if found := finding(one):
                listed.append(Claim(claim, one, found, beside))
    return listed


def _apart(one: Embedded) -> str:
    return next((apart_text(d) for d in one.distances if d.space == "latent"), "")


def _clusters(one: Embedded) -> str:
    plane = flat(one)
    told = clusters_text(plane) if plane else ""
    return f"in two dimensions, of the validation points {told}" if told else ""


def _transferred(one: Embedded) -> str:
    """Mean over the unseen grippers, without and with the most calibration, of each space."""
    if one.transfer is None:
        return ""
    rows = one.transfer.rows
    grasps = sorted({row.calibration for row in rows if row.calibration is not None})
    told = []
    for space in ordered([row.space for row in rows]):
        means = [
            np.mean([r.score.mean for r in rows if (r.space, r.calibration) == (space, n)])
            for n in (grasps[0], grasps[-1])
        ]
        first, last = (number(100 * float(mean)) for mean in means)
        told.append(f"{SPACES.get(space, space)} {first} → {last} %")
    chance = number(100 * one.transfer.chance)
    return (
        f"accuracy on unseen grippers with {grasps[0]} → {grasps[-1]} calibration grasps of each "
        f"thing: {', '.join(told)} (chance {chance} %)"
    )


#: What the paper says and how it is answered here, by the paper's entry.
CLAIMS: dict[str, tuple[str, Callable[[Embedded], str]]] = {
    "latent-knn": ("k-NN gains by the latent", gain_text),
    "distances": ("categories lie apart", _apart),
    "embedding": ("objects form clusters", _clusters),
    "transfer": ("a model does not transfer to another gripper", _transferred),
}
