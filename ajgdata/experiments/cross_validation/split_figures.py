"""Figures of one model under several splits: random against grouped, within and across sessions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.evaluate.sessions import ACROSS, AS_MANY, WITHIN
from ajgdata.experiments.cross_validation.findings import (
    lost_shares,
    session_finding,
    split_finding,
)
from ajgdata.experiments.cross_validation.results import GROUPED, RANDOM, ModelResult
from ajgdata.report.blocks import Illustration
from ajgdata.report.canvas import GREY, WIDTH_IN, model_style, new_figure
from ajgdata.report.format import Caption
from ajgdata.report.labels import LABEL_PT, REFERENCES


class Compared(NamedTuple):
    """Splits that are drawn side by side: parts with their names, the first hollow, the next with
    the error that it is held against; what the figure finds, explains, and counts of each model."""

    name: str
    parts: dict[str, str]
    finding: Callable[[Sequence[ModelResult]], str]
    text: str
    counted: str


COMPARED = (
    Compared(
        "random-against-grouped",
        {RANDOM: "random", GROUPED: "grouped"},
        split_finding,
        "The same models and recordings under two splits. Grouped: no group on both sides (used "
        "everywhere else in this report). Random: groups ignored.",
        "Error that the random split hides",
    ),
    Compared(
        "within-against-across-sessions",
        {WITHIN: "within", AS_MANY: "as many", ACROSS: "across"},
        session_finding,
        "The same models and recordings, each grasp heard once. Within: folds inside each session. "
        "Across: each session by a model of all others; as many: of no more grasps of each class "
        "than within, where there are more than two sessions.",
        "Error across sessions (of as many grasps, if there are more than two) that folds within "
        "them hide",
    ),
)


def illustrations(models: Sequence[ModelResult]) -> Iterator[Illustration]:
    """Yield each comparison of splits that some models have."""
    for one in COMPARED:
        first, *_, last = one.parts
        if having := [model for model in models if model.has(first) and model.has(last)]:
            draw = partial(split_figure, having, one)
            yield Illustration(one.name, split_caption(having, one), draw)


def _parts(model: ModelResult, one: Compared) -> dict[str, str]:
    return {part: name for part, name in one.parts.items() if model.has(part)}


def split_figure(compared: Sequence[ModelResult], one: Compared) -> Figure:
    """Return the splits of each task and model: points with their spread, on one axis."""
    figure = new_figure(
        (WIDTH_IN, 1.5 + 0.4 * len(compared)),
        one.finding(compared),
        "error as a share of chance, mean ± sd over folds; at the right in units of the task",
        [m.task.source for m in compared],
    )
    axes = figure.subplots()
    axes.grid(False, axis="y")
    for row, model in enumerate(compared):
        _split_row(axes, row, model, one)
    if max(m.normalise(m.score(part)).mean for m in compared for part in _parts(m, one)) >= 0.5:
        axes.axvline(1, **REFERENCES["chance"])
        axes.annotate("chance", (1, -0.6), (3, 0), textcoords="offset points", va="center",
                      fontsize=LABEL_PT, color=GREY)  # fmt: skip
    labels = [f"{m.task.title}\n{m.label} ({m.task.source})" for m in compared]
    axes.set_yticks(range(len(compared)), labels)
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(len(compared) - 0.5, -0.9)
    axes.set_xlabel("error (0 perfect, 1 chance)")
    axes.margins(x=0.05)
    axes.set_xlim(left=0)
    return figure


def _split_row(axes: Axes, row: int, model: ModelResult, one: Compared) -> None:
    """Draw the error of each split, joined, and write them at the right; the first are named."""
    scores = {name: model.score(part) for part, name in _parts(model, one).items()}
    ends = [model.normalise(score) for score in scores.values()]
    axes.plot([end.mean for end in ends], [row] * len(ends), color=GREY, lw=1, zorder=1)
    low = min(range(len(ends)), key=lambda at: ends[at].mean)
    for i, (name, end) in enumerate(zip(scores, ends, strict=True)):
        style = {**model_style(len(ends) - 1 - i), "ls": "", "ms": 6, "capsize": 2.5}
        style["mfc"] = "white" if i == 0 else style["color"]
        axes.errorbar(end.mean, row, xerr=end.sd, label=name if row == 0 else None, **style)
        if row == 0:
            axes.annotate(name, (end.mean, row), (0, 8 + 9 * (0 < i < len(ends) - 1)),
                          textcoords="offset points", va="bottom",
                          ha="right" if i == low else "left", fontsize=LABEL_PT,
                          color=style["color"])  # fmt: skip
    told = " → ".join(model.shown(score) for score in scores.values())
    axes.annotate(told, (1, row), (6, 0), xycoords=("axes fraction", "data"), va="center",
                  textcoords="offset points", fontsize=LABEL_PT)  # fmt: skip


def split_caption(compared: Sequence[ModelResult], one: Compared) -> Caption:
    """Return the caption of `split_figure`."""
    listed = "; ".join(
        f"{m.task.title}, {m.label}: "
        + ", ".join(
            f"{m.shown(m.score(part))} {name}" for part, name in reversed(_parts(m, one).items())
        )
        for m in compared
    )
    gained = "; ".join(
        f"{m.task.title}, {m.label}: {share:.0%}".replace("-", "−")
        for model in compared
        for m, share in lost_shares([model], *list(_parts(model, one))[:2])
    )
    return Caption(
        f"{one.text} Error as a share of chance, mean ± one standard deviation over folds. "
        f"{one.counted}: {gained}.",
        f"{one.finding(compared)}. Normalised error of the splits. {listed}.",
    )
