"""What probes read from a space, retrieval of unseen things, transfer to grippers -> figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.report.canvas import GREY, WIDTH_IN, new_figure, styled
from ajgdata.report.embedded import SPACES, Moved, Probe, Retrieval, Transfer, ordered
from ajgdata.report.format import Caption, Source, mean_sd, number, words
from ajgdata.report.neighbours import LOOKS, OTHER

PROBES = {"linear": "linear", "knn": "k-NN"}
SPLITS = {"grouped": "new grasps of known things", "unseen": "unseen things"}
METRICS = {"accuracy": "accuracy", "r2": "R²", "rank_correlation": "rank correlation"}
#: An R² far below 0 says no more than one a little below.
LOWEST = -0.3


@styled
def probes_figure(probes: Sequence[Probe], title: str, source: Source) -> Figure:
    """A row for each target, a panel for each split; a marker for each space and probe."""
    splits = [split for split in SPLITS if any(p.split == split for p in probes)]
    rows = list(dict.fromkeys((p.target, p.metric) for p in probes))
    figure = new_figure(
        (WIDTH_IN, 1.7 + 0.42 * len(rows)),
        title,
        "what a probe tells from each space, mean ± sd over runs",
        [source],
    )
    panels = figure.subplots(1, len(splits), sharey=True, squeeze=False)[0]
    for axes, split in zip(panels, splits, strict=True):
        _probe_panel(axes, [p for p in probes if p.split == split], rows)
        axes.set_title(SPLITS[split])
        axes.set_xlabel("accuracy, R² or rank correlation")
    panels[0].set_yticks(range(len(rows)), [f"{words(t)} ({METRICS.get(m, m)})" for t, m in rows])
    panels[0].set_ylim(len(rows) - 0.5, -0.5)
    shown: dict[str, Any] = {}
    for axes in panels:
        handles, labels = axes.get_legend_handles_labels()
        shown |= dict(zip(labels, handles, strict=True))
    figure.legend(shown.values(), shown.keys(), loc="outside lower center", ncols=3)
    return figure


def _probe_panel(axes: Axes, probes: Sequence[Probe], rows: Sequence[tuple[str, str]]) -> None:
    kinds = [
        (space, probe)
        for space in ordered([p.space for p in probes])
        for probe in PROBES
        if any((p.space, p.probe) == (space, probe) for p in probes)
    ]
    for i, (space, probe) in enumerate(kinds):
        colour, marker = LOOKS.get(space, OTHER)
        own = [p for p in probes if (p.space, p.probe) == (space, probe)]
        offset = 0.6 * ((i + 0.5) / len(kinds) - 0.5)
        axes.errorbar(
            [max(p.score.mean, LOWEST) for p in own],
            [rows.index((p.target, p.metric)) + offset for p in own],
            xerr=[np.nan_to_num(p.score.sd) for p in own],
            ls="", marker=marker, ms=4.5, color=colour, elinewidth=0.9,
            mfc=colour if probe == "linear" else "white",
            label=f"{SPACES.get(space, space)}, {PROBES[probe]}",
        )  # fmt: skip
    for p in {(p.target, p.metric, p.chance): p for p in probes}.values():
        if math.isfinite(p.chance):
            axes.plot(
                [p.chance] * 2,
                rows.index((p.target, p.metric)) + np.array([-0.38, 0.38]),
                color=GREY, lw=1.1, ls=":", label="chance",
            )  # fmt: skip
    axes.axvline(0, color=GREY, lw=0.6)
    axes.set_xlim(LOWEST - 0.05, 1.05)
    axes.tick_params(axis="y", length=0)


def probes_caption(probes: Sequence[Probe]) -> Caption:
    """Caption of `probes_figure`."""
    listed = "; ".join(
        f"{words(p.target)} from {SPACES.get(p.space, p.space)} by a {PROBES[p.probe]} probe, "
        f"{SPLITS[p.split]}: {METRICS.get(p.metric, p.metric)} {mean_sd(p.score)}"
        for p in probes
    )
    return Caption(
        f"Filled: linear probes; hollow: k-NN. Dotted: chance. A space that forgets "
        "the pose lets a probe read the thing and not the angle. An R² below "
        f"{number(LOWEST).replace('-', '−')} is drawn there.",
        f"Scores of probes. {listed}.",
    )


@styled
def retrieval_figure(rows: Sequence[Retrieval], title: str, source: Source) -> Figure:
    """Precision against k, a panel for each gallery."""
    galleries = list(dict.fromkeys(row.gallery for row in rows))
    figure = new_figure(
        (WIDTH_IN, 3.3),
        title,
        "share of the k nearest recordings that are of the same thing, mean ± sd over runs",
        [source],
    )
    panels = figure.subplots(1, len(galleries), sharey=True, squeeze=False)[0]
    for axes, gallery in zip(panels, galleries, strict=True):
        here = [row for row in rows if row.gallery == gallery]
        for space in ordered([row.space for row in here]):
            own = sorted((row for row in here if row.space == space), key=lambda row: row.k)
            colour, marker = LOOKS.get(space, OTHER)
            axes.errorbar(
                [row.k for row in own],
                [100 * row.score.mean for row in own],
                [100 * np.nan_to_num(row.score.sd) for row in own],
                color=colour, marker=marker, ms=4.5, capsize=2.5,
                label=SPACES.get(space, space),
            )  # fmt: skip
        chance = sorted({(row.k, 100 * row.chance) for row in here if math.isfinite(row.chance)})
        axes.plot(*np.reshape(chance, (-1, 2)).T, color=GREY, ls=":", lw=1.1, label="chance")
        axes.set(title=f"gallery: {gallery} things", xlabel="k", ylim=(0, None))
        axes.set_xticks(sorted({row.k for row in here}))
    panels[0].set_ylabel("precision at k (%)")
    panels[-1].legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure


def retrieval_caption(rows: Sequence[Retrieval]) -> Caption:
    """Caption of `retrieval_figure`."""
    listed = "; ".join(
        f"{SPACES.get(row.space, row.space)}, k = {row.k}, gallery {row.gallery}: "
        f"{mean_sd(row.score, '%', 100)}"
        for row in rows
    )
    return Caption(
        "Queries are recordings of things that the encoder was never trained on; the "
        "recordings of the query's own grasp are left out of the gallery.",
        f"Precision at k. {listed}.",
    )


@styled
def transfer_figure(transfer: Transfer, title: str, source: Source) -> Figure:
    """Accuracy against calibration grasps, a panel for each unseen gripper."""
    grippers = transfer.held_out_grippers
    rows = math.ceil(len(grippers) / 2)
    figure = new_figure(
        (WIDTH_IN, 1.3 + 2.6 * rows),
        title,
        "k-NN trained on the default gripper and some calibration grasps, mean ± sd over runs",
        [source],
    )
    grid = figure.subplots(rows, min(len(grippers), 2), sharex=True, sharey=True, squeeze=False)
    panels = grid.ravel().tolist()
    for axes, gripper in zip(panels, grippers, strict=False):
        _transfer_panel(axes, transfer, gripper)
        axes.set_title(words(gripper))
    for axes in panels[len(grippers) :]:
        axes.set_visible(False)
    for axes in grid[-1]:
        axes.set_xlabel("calibration grasps of each thing")
    for axes in grid[:, 0]:
        axes.set_ylabel("accuracy (%)")
    panels[0].set_ylim(0, None)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


def _transfer_panel(axes: Axes, transfer: Transfer, gripper: str) -> None:
    rows = [row for row in transfer.rows if row.gripper == gripper]
    spaces = ordered([row.space for row in rows])
    grasps = sorted({row.calibration for row in rows if row.calibration is not None})
    for i, space in enumerate(spaces):
        own = {row.calibration: row.score for row in rows if row.space == space}
        colour, marker = LOOKS.get(space, OTHER)
        shift = 0.12 * (i - (len(spaces) - 1) / 2)  # error bars side by side
        axes.errorbar(
            [n + shift for n in grasps],
            [100 * own[n].mean for n in grasps],
            [100 * np.nan_to_num(own[n].sd) for n in grasps],
            color=colour, marker=marker, ms=4.5, capsize=2, label=SPACES.get(space, space),
        )  # fmt: skip
    for row in transfer.within:
        if row.gripper == gripper:
            colour, marker = LOOKS.get(row.space, OTHER)
            place = (max(grasps, default=0) + 0.9, 100 * row.score.mean)
            axes.plot(*place, marker=marker, mfc="white", ms=5, color=colour)
    axes.axhline(100 * transfer.chance, color=GREY, ls=":", lw=1.1, label="chance")
    axes.set_xticks(grasps)


def transfer_caption(transfer: Transfer) -> Caption:
    """Caption of `transfer_figure`."""

    def line(row: Moved) -> str:
        return (
            f"{SPACES.get(row.space, row.space)} on {words(row.gripper)}, {row.calibration} "
            f"grasps: {mean_sd(row.score, '%', 100)}"
        )

    return Caption(
        "A classifier of things, trained on the default gripper, is asked on grippers "
        "that no encoder was trained on, after none to some calibration grasps of each thing. "
        "Hollow, at the right: trained on 4 grasps of each thing on that gripper and nothing else. "
        "What is standardised per gripper knows all recordings of the new one, those asked about "
        "included, but no labels; what is referenced knows its recordings of nothing. "
        "Dotted: chance.",
        f"Accuracy against calibration grasps. {'; '.join(map(line, transfer.rows))}.",
    )
