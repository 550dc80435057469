"""Energies by class -> figure and words."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ajgdata.report.canvas import COLOURS, WIDTH_IN, new_figure, styled
from ajgdata.report.format import Caption, Score, mean_sd, number, words
from ajgdata.report.further import Energies, EnergyPart, Row


def energy_rows(energies: Energies) -> list[Row]:
    """Rows of the table of results: every class but the reference."""
    metric = f"energy, {energies.reference} = 100 %, over grasps"
    return [Row(words(p.label), metric, _percent(p)) for p in _compared(energies)]


def _compared(energies: Energies) -> list[EnergyPart]:
    """All but the reference, the loudest first."""
    others = [part for part in energies.parts if part.label != energies.reference]
    return sorted(others, key=lambda part: -part.mean)


def _percent(part: EnergyPart) -> str:
    return mean_sd(Score(part.mean, part.sd), "%", 100)


@styled
def energy_figure(energies: Energies) -> Figure:
    """A bar for each class with its spread over grasps, and a mark for each object."""
    parts = [*(p for p in energies.parts if p.label == energies.reference), *_compared(energies)]
    low, high = energies.band_hz
    figure = new_figure(
        (WIDTH_IN, 3.4),
        f"{energies.about.title}",
        f"energy from {number(low)} to {number(high, 6)} Hz against {words(energies.reference)}, "
        f"mean ± sd over {max(part.groups for part in parts)} grasps",
        [energies.about.source],
    )
    axes = figure.subplots()
    place = np.arange(len(parts))
    mean, sd = (100 * np.array([getattr(p, key) for p in parts]) for key in ("mean", "sd"))
    whiskers = {"lw": 1, "capsize": 3, "ecolor": "#333333"}
    axes.bar(place, mean, 0.55, yerr=sd, color=COLOURS[0], alpha=0.75, error_kw=whiskers)
    for i, name in enumerate(sorted({name for part in parts for name in part.by_object})):
        here = [x for x, part in zip(place, parts, strict=True) if name in part.by_object]
        level = [100 * part.by_object[name] for part in parts if name in part.by_object]
        axes.plot(here, level, "os^Dv"[i % 5], color=COLOURS[1 + i % 5], ms=5, label=words(name))
    for x, part, top in zip(place, parts, mean + np.nan_to_num(sd), strict=True):
        text = f"{_percent(part)}\n{_decibel(part)} dB"
        axes.annotate(text, (x, top), (0, 4), textcoords="offset points", ha="center", fontsize=8)
    axes.set_xticks(place, [words(part.label) for part in parts])
    axes.grid(False, axis="x")
    axes.set_ylabel("energy (%)")
    axes.margins(y=0.2)
    axes.set_ylim(bottom=0)
    axes.legend(loc="upper right", title="mean of each object")
    return figure


def _decibel(part: EnergyPart) -> str:
    return f"{10 * np.log10(part.mean):.1f}".replace("-0.0", "0.0").replace("-", "−")


def energy_caption(energies: Energies) -> Caption:
    """Caption of `energy_figure`."""
    compared = _compared(energies)
    listed = "; ".join(f"{words(part.label)}: {_percent(part)}" for part in compared)
    lost = "; ".join(f"{words(p.label)} {number(100 * (1 - p.mean))} %" for p in compared)
    paper = f" The paper, on its real gripper: {energies.paper.text}." if energies.paper else ""
    return Caption(
        f"{energies.about.title}, {energies.about.source}: energy of the recordings, their power "
        f"spectrum summed over time and band, against the mean for {words(energies.reference)} on "
        f"the same object; same sweep, level and gain. It includes what goes straight from speaker "
        f"to microphone. Energy lost: {lost}.{paper}",
        f"Bars of energy relative to {words(energies.reference)}. {listed}.",
    )
