"""What is shown of one embedding, question by question: figures and tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from ajgdata.report import distances, latents, neighbours, probes, projected
from ajgdata.report.blocks import Illustration
from ajgdata.report.embedded import SPACES, Embedded, Probe, ordered
from ajgdata.report.format import DASH, Caption, mean_sd, number, words


class Grid(NamedTuple):
    """A table: its head, and rows whose first cell names the row."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


class Block(NamedTuple):
    """One question: its id and title, figures by file name, and tables."""

    id: str
    title: str
    figures: Mapping[str, Illustration]
    grids: tuple[Grid, ...] = ()


def blocks(one: Embedded) -> list[Block]:
    """Everything that is shown of an embedding, in the order of the page; nothing is drawn yet."""
    makers = (_plane, _neighbours, _distances, _projections, _probes, _retrieval, _transfer)
    return [block for make in makers if (block := make(one)).figures]


def _drawing(
    one: Embedded, about: str, caption: Caption, draw: Callable[..., Figure], *shown: Any
) -> Illustration:
    """A figure of `shown` whose head and caption say whose it is."""
    told = Caption(f"{one.title}, {one.source}. {caption.text}", f"{one.title}. {caption.alt}")
    return Illustration(told, partial(draw, *shown, f"{one.title} · {about}", one.source))


def flat(one: Embedded) -> latents.Plane | None:
    """The two-dimensional latent of the pictured run, if there is one."""
    for picture in one.pictured.pictures if one.pictured else ():
        if one.pictured and (picture.space, picture.method) == ("latent", "plane"):
            thing, *others = one.pictured.columns.values()
            texts = [values for values in others if values.dtype.kind == "U"]
            category = texts[0] if texts else np.full(len(thing), "")
            training = one.pictured.training
            return latents.Plane(picture.points, thing.astype(str), category, training)
    return None


def _plane(one: Embedded) -> Block:
    plane, title = flat(one), "The latent in two dimensions"
    if plane is None:
        return Block("plane", title, {})
    caption = latents.plane_caption(plane)
    drawing = _drawing(one, "latent", caption, latents.plane_figure, plane)
    return Block("plane", title, {f"{one.id}--plane": drawing})


def _neighbours(one: Embedded) -> Block:
    title = "k-NN against the dimension and against run time"
    if not one.neighbours:
        return Block("neighbours", title, {})
    caption = neighbours.neighbours_caption(one)
    drawing = _drawing(one, "k-NN", caption, neighbours.neighbours_figure, one)
    spaces = ordered([row.space for row in one.neighbours])
    dimensions = sorted({row.dimension for row in one.neighbours if row.dimension})
    found = {(row.space, row.dimension): row for row in one.neighbours}

    def cell(space: str, dimension: int | None) -> str:
        row = found.get((space, dimension)) or found.get((space, None))
        return f"{mean_sd(row.score, '%', 100)}; {number(row.seconds, 2)} s" if row else DASH

    grid = Grid(
        ("dimension", *(SPACES.get(space, space) for space in spaces)),
        tuple((str(d), *(cell(space, d) for space in spaces)) for d in dimensions),
    )
    return Block("neighbours", title, {f"{one.id}--neighbours": drawing}, (grid,))


def _distances(one: Embedded) -> Block:
    drawn = {}
    if one.distances:
        caption = distances.category_caption(one.distances)
        drawn[f"{one.id}--categories"] = _drawing(
            one, "categories", caption, distances.category_figure, one.distances
        )
    for found in one.distances:
        drawn[f"{one.id}--objects-{found.space}"] = _drawing(
            one, "objects", distances.object_caption(found), distances.object_figure, found
        )
    return Block("distances", "Distances within and between categories", drawn)


def _projections(one: Embedded) -> Block:
    title, shown = "What each space encodes, seen", one.pictured
    if shown is None:
        return Block("projections", title, {})
    drawn = {}
    for column in projected.shown_columns(shown):
        caption = projected.projected_caption(shown, column)
        drawn[f"{one.id}--by-{column}"] = _drawing(
            one, words(column), caption, projected.projected_figure, shown, column
        )
    return Block("projections", title, drawn)


def _probes(one: Embedded) -> Block:
    title = "What each space encodes, measured"
    measured = one.probes or (one.transfer.probes if one.transfer else ())
    if not measured:
        return Block("probes", title, {})
    caption = probes.probes_caption(measured)
    drawing = _drawing(one, "probes", caption, probes.probes_figure, measured)
    grids = [probes_grid(measured)]
    if one.silhouettes:
        spaces = ordered([row.space for row in one.silhouettes])
        told = {(row.label, row.space): mean_sd(row.score) for row in one.silhouettes}
        labels = dict.fromkeys(row.label for row in one.silhouettes)
        rows = ((words(x), *(told.get((x, space), DASH) for space in spaces)) for x in labels)
        head = ("silhouette of", *(SPACES.get(space, space) for space in spaces))
        grids.append(Grid(head, tuple(rows)))
    return Block("probes", title, {f"{one.id}--probes": drawing}, tuple(grids))


def probes_grid(measured: Sequence[Probe]) -> Grid:
    """A row for each target, metric and split, a column for each space and probe."""
    spaces = ordered([p.space for p in measured])
    kinds = [(space, probe) for space in spaces for probe in probes.PROBES]
    rows: dict[tuple[str, str, str], dict[tuple[str, str], Probe]] = {}
    for p in measured:
        rows.setdefault((p.target, p.split, p.metric), {})[p.space, p.probe] = p
    head = ("target", "tested on", "metric", "chance")
    return Grid(
        (*head, *(f"{SPACES.get(space, space)}, {probes.PROBES[probe]}" for space, probe in kinds)),
        tuple(
            (
                words(target),
                probes.SPLITS[split],
                probes.METRICS.get(metric, metric),
                number(next(iter(cells.values())).chance),
                *(mean_sd(cells[kind].score) if kind in cells else DASH for kind in kinds),
            )
            for (target, split, metric), cells in rows.items()
        ),
    )


def _retrieval(one: Embedded) -> Block:
    drawn = {}
    if one.retrieval:
        caption = probes.retrieval_caption(one.retrieval)
        drawn[f"{one.id}--retrieval"] = _drawing(
            one, "retrieval", caption, probes.retrieval_figure, one.retrieval
        )
    return Block("retrieval", "Finding things that were never trained on", drawn)


def _transfer(one: Embedded) -> Block:
    drawn = {}
    if one.transfer is not None:
        caption = probes.transfer_caption(one.transfer)
        drawn[f"{one.id}--transfer"] = _drawing(
            one, "transfer", caption, probes.transfer_figure, one.transfer
        )
    return Block("transfer", "Grippers that were never trained on", drawn)
