"""Figures of the study of acoustics: decay times, sound from outside, and what each choice does."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ajgdata.report.blocks import TableFigure
from ajgdata.report.canvas import GREY, WIDTH_IN, line_style, new_figure, plain_ticks
from ajgdata.report.format import Caption, number
from ajgdata.report.labels import REFERENCES, label_end
from ajgdata.types.table import Table

#: Decay times (ms) and changes of the feature that are ticks.
TIMES_MS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1_000)
CHANGES = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1)
FREQUENCIES_HZ = (60, 125, 250, 500, 1_000, 2_000, 4_000, 8_000, 16_000)


def _octaves(table: Table) -> dict[int, str]:
    """Return the columns of a decay table, by the middle of their octave."""
    keys = [column.key for column in table.columns if column.key.startswith("hz_")]
    return {int(key.removeprefix("hz_")): key for key in keys}


def decay_finding(table: Table) -> str:
    """Return how long the empty gripper takes for 60 dB, over octaves and the range of losses."""
    empty = table.where(medium="air")
    found = [time for key in _octaves(table).values() for time in empty.numbers(key)]
    known = [1e3 * time for time in found if not np.isnan(time)]
    if not known:
        return "The gripper falls silent faster than its octaves can tell"
    low, high = (number(one, 2) for one in (min(known), max(known)))
    return (
        f"The empty gripper falls by 60 dB in {low} to {high} ms, as its walls and the octave are"
    )


def decay_figure(table: Table) -> Figure:
    """Return decay time against octave, a line for the least, the default and the most losses."""
    media, octaves = table.parted("medium"), _octaves(table)
    about = "time in which the level falls by 60 dB, by losses at the walls; hung free"
    figure = new_figure((WIDTH_IN, 4.2), decay_finding(table), about, ["simulated"])
    panels = figure.subplots(1, len(media), sharey=True, squeeze=False)[0]
    for axes, (medium, rows) in zip(panels, media.items(), strict=True):
        for index, row in enumerate(rows.rows):
            known = [(hz, 1e3 * row[key]) for hz, key in octaves.items() if row[key] is not None]
            if not known:
                continue
            style, name = line_style(index), f"{row['losses']}: {row['admittance']:g}"
            axes.plot(*np.array(known).T, label=name, clip_on=False, **style)
            if axes is panels[-1]:
                label_end(axes, *known[-1], name, str(style["color"]))
        axes.set(xscale="log", yscale="log", xlabel="octave (Hz)", title=str(medium))
        plain_ticks(axes.xaxis, list(octaves))
    panels[0].set_ylabel("decay time (ms)")
    plain_ticks(panels[0].yaxis, TIMES_MS)
    return figure


def decay_caption(table: Table) -> Caption:
    """Return the caption of `decay_figure`."""
    return Caption(
        "Decay time of the gripper by octave, empty and filled, at the least, the default and the "
        "most losses at its walls (rho c over their impedance). A laboratory that measures its own "
        "gripper's can tell which it has.",
        f"{decay_finding(table)}. Decay time against octave, logarithmic, one line an amount of "
        "losses.",
    )


def outside_finding(table: Table) -> str:
    """Return where what is solved differs most from the mass law, in the first scene."""
    rows = table.where(scene=table.column("scene")[0])
    row = rows.rows[int(np.argmax(np.abs(rows.numbers("difference"))))]
    more = "more" if row["difference"] > 0 else "less"
    return (
        f"Through membrane and cavity {number(abs(row['difference']), 2)} dB {more} comes in at "
        f"{row['band']} Hz than by the mass law"
    )


def outside_figure(table: Table) -> Figure:
    """Return level at the microphone against that outside, by band, a line a scene."""
    about = "level at the microphone against that in the room, sound from all directions"
    figure = new_figure((WIDTH_IN, 3.8), outside_finding(table), about, ["simulated"])
    axes = figure.subplots()
    scenes = table.parted("scene")
    for index, (scene, rows) in enumerate(scenes.items()):
        hz, level, style = rows.numbers("hz"), rows.numbers("solved"), line_style(index)
        axes.plot(hz, level, label=str(scene), **style)
        label_end(axes, hz[-1], level[-1], str(scene), str(style["color"]))
    rows = next(iter(scenes.values()))
    hz, level = rows.numbers("hz"), rows.numbers("mass_law")
    axes.plot(hz, level, color=GREY, lw=1, ls=":", label="mass law")
    label_end(axes, hz[-1], level[-1], "mass law", GREY)
    axes.set(xscale="log", xlabel="frequency (Hz)", ylabel="level (dB)")
    plain_ticks(axes.xaxis, FREQUENCIES_HZ)
    return figure


def outside_caption(table: Table) -> Caption:
    """Return the caption of `outside_figure`."""
    return Caption(
        "What of sound outside is heard at the microphone, by band. Dotted: through a limp wall "
        "of the membrane's mass, as was assumed before. Lines: through membrane, grains and cavity "
        "as they are solved.",
        f"{outside_finding(table)}. Level at the microphone against that outside, by frequency, one"
        " line a scene.",
    )


def choices_finding(table: Table) -> str:
    """Return how many choices change the feature by less than the tolerance, whatever is held."""
    tolerance = float(table.numbers("tolerance")[0])
    largest = {name: rows.numbers("change").max() for name, rows in table.parted("choice").items()}
    small = [name for name, change in largest.items() if change < tolerance]
    most = max(largest, key=lambda name: largest[name])
    few = f"{len(small)} of {len(largest)} choices change" if small else "No choice changes"
    return f"{few} the feature by less than {number(tolerance)}; most does {most}"


def choices_figure(table: Table) -> Figure:
    """Return the change of the feature by each choice, a marker a scene."""
    names = list(table.parted("choice"))
    about = "relative L2 against the default, whole band"
    size = (WIDTH_IN, 1.7 + 0.34 * len(names))
    figure = new_figure(size, choices_finding(table), about, ["simulated"])
    axes = figure.subplots()
    for index, (scene, rows) in enumerate(table.parted("scene").items()):
        place = [names.index(str(name)) for name in rows.column("choice")]
        style = {**line_style(index), "ls": "none", "ms": 6}
        axes.plot(rows.numbers("change"), place, label=str(scene), clip_on=False, **style)
    axes.axvline(float(table.numbers("tolerance")[0]), **REFERENCES["ideal"])
    axes.set_yticks(range(len(names)), names)
    axes.set(xscale="log", xlabel="change of the feature", ylim=(len(names) - 0.5, -0.5))
    plain_ticks(axes.xaxis, CHANGES)
    axes.legend(loc="upper right", bbox_to_anchor=(1, -0.16), ncols=3)
    return figure


def choices_caption(table: Table) -> Caption:
    """Return the caption of `choices_figure`."""
    return Caption(
        "How far each choice moves the feature from the default's. Dashed: the tolerance, below "
        "which parts of a scene are left out.",
        f"{choices_finding(table)}. Change of the feature by choice, logarithmic, one marker a "
        "scene.",
    )


ACOUSTICS = (
    TableFigure("decay", "decay", decay_caption, decay_figure),
    TableFigure("from_outside", "outside", outside_caption, outside_figure),
    TableFigure("choices", "choices", choices_caption, choices_figure),
)
