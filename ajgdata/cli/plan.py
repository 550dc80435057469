"""`ajgdata plan`: the numbers of sessions, placements and grasps for an interval of a given width.

The command prints the variance components of a pilot, and designs of further recordings.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from ajgdata.cli.completion import dataset_names
from ajgdata.cli.console import ATTENTION, say, warn
from ajgdata.evaluate.parts import GROUPED
from ajgdata.paths import find_project
from ajgdata.types import DataError

if TYPE_CHECKING:
    from ajgdata.evaluate.planning import Component, DesignTimes, RecordingPlan
    from ajgdata.pipeline.pilot import Pilot

#: With fewer sessions, a line states that the variance between sessions is uncertain. A standard
#: deviation of 6 normal values has a 95 % interval from 0.6 to 2.5 times its estimate.
FEW_SESSIONS = 6
MINUTES_PER_HOUR = 60

TaskOption = Annotated[str, typer.Option(help="task whose score is planned")]
HalfWidth = Annotated[
    float, typer.Option(min=0, help="half of the 95 % interval (percent points, target unit)")
]
ModelOption = Annotated[str, typer.Option(help="model whose predictions are used")]
Split = Annotated[
    str,
    typer.Option(help="split of the predictions; default: session, else grouped"),
]
NewObjects = Annotated[
    bool, typer.Option("--new-objects", help="plan for new objects of the same kind")
]
SessionMinutes = Annotated[float, typer.Option(min=0, help="time to set up a session")]
PlacementMinutes = Annotated[float, typer.Option(min=0, help="time to place an object")]
GraspMinutes = Annotated[float, typer.Option(min=0, help="time of a grasp with its recordings")]


def plan(
    dataset: Annotated[
        str,
        typer.Argument(metavar="NAME", help="data set of the pilot", autocompletion=dataset_names),
    ],
    task: TaskOption,
    half_width: HalfWidth,
    model: ModelOption = "cnn",
    split: Split = "",
    new_objects: NewObjects = False,
    session_minutes: SessionMinutes = 30,
    placement_minutes: PlacementMinutes = 1,
    grasp_minutes: GraspMinutes = 0.5,
) -> None:
    """Plan the numbers of sessions, placements and grasps.

    Uses held-out predictions to estimate how their score varies between sessions, objects,
    placements and grasps. They are those of the run of all data sets, or else of the only run with
    this data set. Prints the fastest recording with an interval of this width. The default times
    are assumptions. Exit code 3 if the data give no plan.
    """
    from ajgdata.evaluate.planning import (
        DesignTimes,
        pilot_design,
        pilot_half_width,
        variance_components,
    )
    from ajgdata.pipeline.pilot import read_pilot

    pilot = read_pilot(find_project(), dataset, task, model, split or None)
    if new_objects and pilot.has_one_object_per_class:
        problem = f"each class of {task} has one object"
        raise DataError("--new-objects", problem, "record several objects per class first")
    components = variance_components(pilot.score, pilot.units)
    present = pilot_design(pilot.units)
    _print_pilot(pilot, components, new_objects=new_objects)
    if pilot_half_width(components, present, new_objects=new_objects) == 0:
        warn("all scores of an object are equal, so there is no variance; try a harder task")
        raise typer.Exit(ATTENTION)
    if present.sessions < 2:
        warn(
            "one session: the variance between sessions cannot be estimated, so there is no plan; "
            "record every object in at least two more sessions"
        )
        raise typer.Exit(ATTENTION)
    times = DesignTimes(session_minutes, placement_minutes, grasp_minutes)
    is_reached = _print_designs(
        pilot, components, present, times, goal=half_width, new_objects=new_objects
    )
    raise typer.Exit(0 if is_reached else ATTENTION)


def _print_pilot(pilot: Pilot, components: Sequence[Component], *, new_objects: bool) -> None:
    """Print the score of the pilot, its components, and levels that cannot be separated."""
    count = len(pilot.score)
    say(escape(f"{pilot.summary} ({pilot.source}; {count} held-out recordings, {pilot.file})"))
    split = pilot.split
    if split == GROUPED:
        split = f"{split} by {pilot.groups}"
    say(escape(f"split: {split}"))
    say("")
    header = ("level", "units", heading("sd", pilot.unit), "")
    rows = [
        (
            component.name,
            f"{component.units}",
            f"{component.variance**0.5:.3g}",
            _remark(component, new_objects),
        )
        for component in components
    ]
    for line in aligned([header, *rows]):
        say(escape(line))
    if not pilot.has_placements:
        say("Without placement_id, the grasps of an object in a session count as one placement.")
    if any(component.is_joined for component in components):
        say("The data cannot separate levels that are joined by =.")
    say("")


def _remark(component: Component, new_objects: bool) -> str:
    """Return a remark on a component for its row; "" for none."""
    if component.is_of_objects and not new_objects:
        return "not in the interval"
    if component.estimate < 0:
        return "negative estimate, set to 0"
    return ""


def _print_designs(
    pilot: Pilot,
    components: Sequence[Component],
    present: RecordingPlan,
    times: DesignTimes,
    *,
    goal: float,
    new_objects: bool,
) -> bool:
    """Print the present design, the fastest design that reaches `goal`, and two other designs.

    The other designs have as many grasps as the present design. Returns whether a design reaches
    the goal.
    """
    from ajgdata.evaluate.planning import (
        cheapest_design,
        half_width,
        pilot_half_width,
        spread_designs,
    )

    def row(name: str, design: RecordingPlan, low: float, high: float) -> list[str]:
        """Return the cells of a design whose half width is between `low` and `high`."""
        counts = [str(count) for count in design]
        hours = f"{times.total(design) / MINUTES_PER_HOUR:.1f}"
        width = f"±{low:.3g}"
        if width != f"±{high:.3g}":
            width = f"{width} to ±{high:.3g}"
        return [name, *counts, hours, width]

    present_width = pilot_half_width(components, present, new_objects=new_objects)
    fastest = cheapest_design(components, goal, present, times, new_objects=new_objects)
    spread_over_placements, spread_over_sessions = spread_designs(present)
    designs = {
        f"fastest for ±{goal:g}": fastest,
        "one grasp per placement": spread_over_placements,
        "one grasp per session": spread_over_sessions,
    }
    header = ["design", *present._fields, "hours", heading("half width", pilot.unit)]
    rows = [header, row("present", present, present_width, present_width)]
    for name, design in designs.items():
        if design is not None:
            high = half_width(components, design, new_objects=new_objects)
            low = half_width(components, design, new_objects=new_objects, at_best=True)
            rows.append(row(name, design, low, high))
    for line in aligned(rows):
        say(escape(line))
    lines = _explanations(components, present, times, split=pilot.split, new_objects=new_objects)
    for line in lines:
        say(escape(line))
    if fastest is None:
        warn(f"no design of the search reaches ±{goal:g}; choose a larger --half-width")
    return fastest is not None


def _explanations(
    components: Sequence[Component],
    present: RecordingPlan,
    times: DesignTimes,
    *,
    split: str,
    new_objects: bool,
) -> Iterator[str]:
    """Yield lines on the meaning of the designs and on their assumptions."""
    yield "Placements are per object and session, grasps per placement, recordings per grasp."
    yield (
        f"Assumed times: {times.session:g} min per session, {times.placement:g} min per "
        f"placement, {times.grasp:g} min per grasp."
    )
    objects = "new objects of the same kind" if new_objects else f"these {present.objects} objects"
    yield f"The interval is for a new recording by this protocol with {objects}."
    if split == GROUPED:
        yield (
            "Models are trained in the sessions that they are tested in; --split session plans for"
            " the accuracy in a new session."
        )
    if any(component.is_joined for component in components):
        yield (
            "The ends of a range assume that all variance of joined levels is in the last, or in "
            "the first level."
        )
    if present.sessions < FEW_SESSIONS:
        yield (
            f"{present.sessions} sessions determine the variance between sessions poorly. "
            "Plan again after the next session."
        )


def heading(name: str, unit: str) -> str:
    """Return the title of a column with its unit ("": no unit)."""
    return f"{name} [{unit}]" if unit else name


def aligned(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yield the rows of a table as lines of text.

    The first and the last column are aligned to the left, all others to the right.
    """
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    for first, *middle, last in rows:
        numbers = [cell.rjust(width) for cell, width in zip(middle, widths[1:-1], strict=True)]
        yield "  ".join([first.ljust(widths[0]), *numbers, last]).rstrip()
