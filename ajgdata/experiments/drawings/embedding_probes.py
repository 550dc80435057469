"""Probes of embeddings, drawn: rows of spaces for each target."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.experiments.base import (
    TaskResults,
)
from ajgdata.experiments.embedding import (
    look,
    space_name,
)
from ajgdata.experiments.embedding_probes import METRICS, PROBES, SPLITS, Probe, probes_of
from ajgdata.report.canvas import WIDTH_IN, new_figure
from ajgdata.report.format import Caption, mean_sd, number, words
from ajgdata.report.labels import REFERENCES
from ajgdata.report.projections import ordered

#: An R² far below 0 says no more than one a little below.
ROW_IN = 0.19  #: height of a row of the figure
LOWEST = -0.3


def finding(results: TaskResults) -> str:
    """Return what a probe reads from the first space, of new grasps of known things."""
    probes = probes_of(results)
    first = ordered([p.space for p in probes])[0]
    own = [p for p in probes if p.space == first]
    split, probe = own[0].split, own[0].probe
    told = ", ".join(
        f"{words(p.target)} {number(p.score.mean, 2).replace('-', '−')}{_chance(p)}"
        for p in own
        if (p.split, p.probe) == (split, probe) and p.metric != "rank_correlation"
    )
    return f"A {PROBES[probe]} probe on {space_name(first)} reads {told}"


def _chance(one: Probe) -> str:
    return f" (chance {number(one.chance, 2)})" if math.isfinite(one.chance) else ""


def figure(results: TaskResults) -> Figure:
    """Return rows of spaces for each target, a panel for each split; a marker for each probe."""
    probes = probes_of(results)
    splits = [split for split in SPLITS if any(p.split == split for p in probes)]
    rows = _rows_of(probes)
    drawn = new_figure(
        (WIDTH_IN, 1.6 + ROW_IN * len(rows)),
        finding(results),
        f"{results.title}: accuracy, R² or rank correlation, mean ± sd over runs; filled: linear "
        "probe, hollow: k-NN",
        [results.source],
    )
    panels = drawn.subplots(1, len(splits), sharey=True, squeeze=False)[0]
    for axes, split in zip(panels, splits, strict=True):
        _panel(axes, [p for p in probes if p.split == split], rows)
        axes.set_title(SPLITS[split])
        axes.set_xlabel("accuracy, R² or rank correlation")
    heads = [f"{words(t)} ({METRICS.get(m, m)})" for t, m, space in rows if not space]
    names = [space_name(space) if space else heads.pop(0) for _, _, space in rows]
    panels[0].set_yticks(range(len(rows)), names)
    for (_, _, space), text in zip(rows, panels[0].get_yticklabels(), strict=True):
        text.set_fontweight("normal" if space else "bold")
    panels[0].set_ylim(len(rows) - 0.5, -0.5)
    return drawn


def _rows_of(probes: Sequence[Probe]) -> list[tuple[str, str, str]]:
    """Return target, metric and space of each row; a row without a space heads those below."""
    rows: list[tuple[str, str, str]] = []
    for target, metric in dict.fromkeys((p.target, p.metric) for p in probes):
        spaces = [p.space for p in probes if (p.target, p.metric) == (target, metric)]
        rows += [(target, metric, space) for space in ("", *ordered(spaces))]
    return rows


def _panel(axes: Axes, probes: Sequence[Probe], rows: Sequence[tuple[str, str, str]]) -> None:

    for space, probe in dict.fromkeys((p.space, p.probe) for p in probes):
        style = look(space)
        own = [p for p in probes if (p.space, p.probe) == (space, probe)]
        shift = -0.12 if probe == "linear" else 0.12
        axes.errorbar(
            [max(p.score.mean, LOWEST) for p in own],
            [rows.index((p.target, p.metric, p.space)) + shift for p in own],
            xerr=[np.nan_to_num(p.score.sd) for p in own],
            ls="", ms=4.5, elinewidth=0.9, mfc=style["color"] if probe == "linear" else "white",
            label=f"{space_name(space)}, {PROBES[probe]}", **style,
        )  # fmt: skip
    for target, metric, chance in {(p.target, p.metric, p.chance) for p in probes}:
        if math.isfinite(chance):
            own_rows = [i for i, row in enumerate(rows) if row[:2] == (target, metric) and row[2]]
            ends = own_rows[0] - 0.45, own_rows[-1] + 0.45
            axes.plot([chance] * 2, ends, label="chance", zorder=1.5, **REFERENCES["chance"])
    axes.axvline(0, color=REFERENCES["chance"]["color"], lw=0.6)
    axes.set_xlim(LOWEST - 0.05, 1.05)
    axes.tick_params(axis="y", length=0)
    axes.grid(False, axis="y")


def caption(results: TaskResults) -> Caption:
    """Return the caption of `figure`."""
    listed = "; ".join(
        f"{words(p.target)} from {space_name(p.space)} by a {PROBES[p.probe]} probe, "
        f"{SPLITS[p.split]}: {METRICS.get(p.metric, p.metric)} {mean_sd(p.score)}"
        for p in probes_of(results)
    )
    return Caption(
        "Filled: linear probes; hollow: k-NN. Dotted: chance. A space that forgets "
        "the pose lets a probe read the thing and not the angle. An R² below "
        f"{number(LOWEST).replace('-', '−')} is drawn there.",
        f"{finding(results)}. Scores of probes: {listed}.",
    )
