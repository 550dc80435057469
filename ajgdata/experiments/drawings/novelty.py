"""Unlike anything seen, drawn: what is noticed against the stated rate, and by class."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.novelty import DISTANCE, judges_of, label_of, share_of, shown_rate
from ajgdata.report.canvas import WIDTH_IN, model_line, new_figure
from ajgdata.report.format import Caption, number
from ajgdata.report.labels import REFERENCES, label_end
from ajgdata.types.table import Table


def finding(results: TaskResults) -> str:
    """Return what is noticed of classes never met."""
    table, stated = results.results[0].tables["shares"], shown_rate(results)
    shares = [
        (number(share_of(table, judge, stated, "detected").mean), label_of(results, judge))
        for judge in judges_of(results)
    ]
    noticed = ", ".join(f"{share} % by {label}" for share, label in shares)
    return f"With {100 * stated:g} % of false alarms, an object never met is noticed in {noticed}"


def figure(results: TaskResults) -> Figure:
    """Return what is noticed against the stated rate, and by the class that was left out."""
    drawn = new_figure(
        (WIDTH_IN, 4.3),
        finding(results),
        f"{results.title}: one class left out at a time, mean over the classes",
        [results.source],
    )
    left, right = drawn.subplots(1, 2, width_ratios=(1.1, 1))
    rounds, shares = (results.results[0].tables[key] for key in ("rounds", "shares"))
    rates = sorted(results.settings.false_alarms)
    stated = 100 * np.array(rates)
    left.plot([0, stated[-1]], [0, stated[-1]], label="as stated", **REFERENCES["ideal"])
    label_end(left, stated[-1], stated[-1], "as stated", REFERENCES["ideal"]["color"])
    for i, judge in enumerate(judges_of(results)):
        style: dict[str, Any] = model_line(i)
        detected, alarmed = (
            [share_of(shares, judge, rate, key).mean for rate in rates]
            for key in ("detected", "false_alarm")
        )
        left.plot(stated, detected, label=label_of(results, judge), **style)
        left.plot(stated, alarmed, **{**style, "lw": 0.8, "ms": 3})
        label_end(left, stated[-1], detected[-1], label_of(results, judge), style["color"])
        _by_class(right, rounds.where(judge=judge, stated=shown_rate(results)), style, i)
    left.set(xlabel="stated false alarms (%)", ylabel="recordings that raise the alarm (%)")
    left.set(xlim=(0, None), ylim=(0, None))
    right.set(xlabel=f"noticed at {100 * shown_rate(results):g} % (%)", xlim=(-3, 103))
    right.invert_yaxis()
    return drawn


def _by_class(axes: Axes, rounds: Table, style: dict[str, Any], number_of: int) -> None:
    """Draw what was noticed of each class that was left out."""
    names = [str(name).replace("_", " ") for name in rounds.column("left_out")]
    places = np.arange(len(names)) + 0.2 * (number_of - 1)
    marker = {**style, "ls": "", "ms": 4}
    axes.plot(100 * rounds.numbers("detected"), places, **marker)
    axes.set_yticks(range(len(names)), names)


def caption(results: TaskResults) -> Caption:
    """Return the caption of `figure`."""
    shares = results.results[0].tables["shares"]
    listed = "; ".join(
        f"{label_of(results, judge)}: "
        + ", ".join(
            f"{number(share_of(shares, judge, rate, 'detected').mean)} % at {100 * rate:g} %"
            for rate in results.settings.false_alarms
        )
        for judge in judges_of(results)
    )
    alarmed = number(share_of(shares, DISTANCE, shown_rate(results), "false_alarm").mean)
    return Caption(
        f"{results.title}, {results.source}: is an object that was never met noticed? Thick lines: "
        "recordings of the class that was left out. Thin lines: held-out grasps of known classes, "
        "which should lie on or below the dashed one. Right: each class that was left out. "
        f"Noticed: {listed}.",
        f"{finding(results)}; {alarmed} % of known ones raise that of the distance. "
        f"Noticed against stated false alarms: {listed}.",
    )
