"""Models on other grippers -> figure and words."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, new_figure, styled
from ajgdata.report.experiments import METRIC_NAMES
from ajgdata.report.format import Caption, Score, mean_sd
from ajgdata.report.further import Row, TransferLine, Transfers


def _told(transfers: Transfers, mean: float, sd: float) -> str:
    return mean_sd(Score(mean, sd), transfers.unit)


def transfer_rows(transfers: Transfers) -> list[Row]:
    """Rows of the table of results: every model on every gripper, with few and many grasps."""
    name = METRIC_NAMES[transfers.metric]
    rows = []
    for line in transfers.lines:
        for at in sorted({0, len(line.grasps) - 1}):
            metric = f"{name} on {line.title}, {line.grasps[at]} calibration grasps"
            rows.append(Row(line.model_label, metric, _told(transfers, line.mean[at], line.sd[at])))
    return rows


@styled
def transfer_figure(transfers: Transfers) -> Figure:
    """Metric against calibration grasps, a panel for each other gripper; dashed: at home."""
    titles = {line.dataset: line.title for line in transfers.lines}
    figure = new_figure(
        (WIDTH_IN, 3.6),
        f"{transfers.about.title} · on another gripper",
        f"{METRIC_NAMES[transfers.metric]}, mean ± sd over {transfers.folds} folds; dashed: on "
        "the gripper that was trained on",
        [transfers.about.source],
    )
    panels = figure.subplots(1, len(titles), sharey=True, squeeze=False)[0]
    for axes, (dataset, title) in zip(panels, titles.items(), strict=True):
        lines = [line for line in transfers.lines if line.dataset == dataset]
        for i, line in enumerate(lines):
            style: dict[str, Any] = {"color": COLOURS[i], "marker": "os^DvPX"[i], "capsize": 2.5}
            axes.errorbar(line.grasps, line.mean, line.sd, label=line.model_label, **style)
            if np.isfinite(line.home[0]):
                axes.axhline(line.home[0], color=COLOURS[i], ls=(0, (5, 3)), lw=0.9)
        axes.axhline(lines[0].chance, color=GREY, ls=":", lw=1.1, label="chance")
        axes.set_title(title)
        axes.set_xlabel("calibration grasps of each class")
        axes.set_xticks(lines[0].grasps)
    panels[0].set_ylim(bottom=0)  # of all panels, once all is drawn
    panels[0].set_ylabel(f"{METRIC_NAMES[transfers.metric]} ({transfers.unit})")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower left", ncols=4)
    return figure


def transfer_caption(transfers: Transfers) -> Caption:
    """Caption of `transfer_figure`."""
    listed = "; ".join(_line(transfers, line) for line in transfers.lines)
    paper = f" The paper: {transfers.paper.text}." if transfers.paper else ""
    return Caption(
        f"Models of {transfers.about.title}, {transfers.about.source}, on recordings of another "
        f"gripper, and with a few of its grasps added to the training. What is tested is trained "
        f"on in neither gripper.{paper}",
        f"{METRIC_NAMES[transfers.metric]} against calibration grasps. {listed}.",
    )


def _line(transfers: Transfers, line: TransferLine) -> str:
    reached = ", ".join(
        f"{_told(transfers, mean, sd)} with {count}"
        for count, mean, sd in zip(line.grasps, line.mean, line.sd, strict=True)
    )
    home = f"; at home {_told(transfers, *line.home)}" if np.isfinite(line.home[0]) else ""
    return f"{line.model_label} on {line.title}: {reached}{home}"
