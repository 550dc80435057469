"""`ajgdata sense` and `sort`: a trained model at work; `dashboard`: a finished run."""

from __future__ import annotations

import json
import secrets
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from ajgdata.cli.console import err, out, say, warn
from ajgdata.types import DataError

if TYPE_CHECKING:
    from ajgdata.live.control import Control
    from ajgdata.live.events import EventLog


_CARD = "sound card"
_VIRTUAL = "virtual gripper"
_DASHBOARD = "dashboard"
#: Exit code of a run that ended because an object was in doubt, as in the paper.
DOUBT = 3


def sense(
    dataset: Annotated[str, typer.Argument(help="data set of the model")],
    task: Annotated[str, typer.Argument(help="its task")],
    model: Annotated[str, typer.Argument(help="cnn, linear, ...")] = "cnn",
    source: Annotated[
        str, typer.Option(help="soundcard; virtual: the virtual gripper, needs no hardware")
    ] = "soundcard",
    watch: Annotated[bool, typer.Option("--watch", help="repeat until Ctrl-C")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="one JSON object per recording")] = False,
    threshold: Annotated[
        float, typer.Option(min=0, max=1, help="threshold that is drawn (paper: 0.6)")
    ] = 0.6,
    device: Annotated[
        str,
        typer.Option(help="exact name, as `ajgdata device list` has it", rich_help_panel=_CARD),
    ] = "",
    input_channel: Annotated[int, typer.Option(min=1, rich_help_panel=_CARD)] = 1,
    output_channel: Annotated[int, typer.Option(min=1, rich_help_panel=_CARD)] = 1,
    loopback_channel: Annotated[int | None, typer.Option(min=1, rich_help_panel=_CARD)] = None,
    object_: Annotated[
        list[str] | None,
        typer.Option(
            "--object",
            help="what it holds, or `empty`; several: one of them; default: all of the recipe",
            rich_help_panel=_VIRTUAL,
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(min=0, help="of poses; default: another each time", rich_help_panel=_VIRTUAL),
    ] = None,
) -> None:
    """Classify the object in the gripper."""
    from ajgdata.acquire.signals import ended_by_signals
    from ajgdata.paths import find_project
    from ajgdata.pipeline.sense import open_sensing

    if source not in ("soundcard", "virtual"):
        raise DataError("--source", f"there is no {source!r}", "soundcard or virtual")
    if source == "soundcard" and not device:
        fix = 'add --device "…" (see `ajgdata device list`), or --source virtual'
        raise DataError("ajgdata sense", "needs a device", fix)
    card = {
        "device": device, "input_channel": input_channel, "output_channel": output_channel,
        "loopback_channel": loopback_channel,
    }  # fmt: skip
    with (
        _stopped_by_hand(),
        ended_by_signals(),
        open_sensing(
            find_project(), dataset, task, model, source=source, card=card,
            objects=tuple(object_ or ()),
            seed=secrets.randbelow(2**31) if seed is None else seed,
        ) as sensing,
    ):  # fmt: skip
        for sensed in sensing:
            _show(sensed, threshold, as_json)
            if not watch:
                break


def _show(sensed: Any, threshold: float, as_json: bool) -> None:
    """Print one take."""
    from ajgdata.acquire.operator import meter
    from ajgdata.cli.live_lines import table_of

    if as_json:
        sys.stdout.write(json.dumps(sensed.plain(), allow_nan=False) + "\n")
        sys.stdout.flush()
        return
    simulated = f", holds {sensed.object} (simulated)" if sensed.object else ""
    peak = f"{meter(sensed.peak_dbfs)} {sensed.peak_dbfs:.1f} dBFS"
    head = f"[b]{sensed.number}[/b]  {peak}  {sensed.seconds:.2f} s{escape(simulated)}"
    for line in (head, *table_of(sensed.prediction, out.width, threshold)):
        say(line)


def sort(
    plan: Annotated[Path | None, typer.Argument(help="what to sort, how, into which bins")] = None,
    learn: Annotated[
        str,
        typer.Option(
            metavar="RUN",
            help="sort nothing: label the recordings of the run DATASET/SESSION by its corrections",
        ),
    ] = "",
    as_json: Annotated[bool, typer.Option("--json", help="events as JSON, one per line")] = False,
    dashboard: Annotated[
        bool,
        typer.Option(
            "--dashboard", help="also show the run in a browser", rich_help_panel=_DASHBOARD
        ),
    ] = False,
    port: Annotated[
        int,
        typer.Option(
            min=0, max=65_535, help="port of the page; 0: any free port", rich_help_panel=_DASHBOARD
        ),
    ] = 0,
) -> None:
    """Sort objects by their sound: grasp, hear, decide, place. Stops when in doubt.

    Exit code 0: sorted as planned; 3: stopped since an object was in doubt; 130: stopped by hand;
    else an error. Whatever ends it early, the robot halts and says what it holds.
    """
    if bool(plan) == bool(learn):
        fix = "ajgdata sort PLAN.yaml, or ajgdata sort --learn RUN"
        raise DataError("ajgdata sort", "needs a plan, or --learn", fix)
    if plan is None:
        _learn(learn)
        return
    raise typer.Exit(_sort(plan, as_json, port if dashboard else None))


def _sort(file: Path, as_json: bool, port: int | None) -> int:
    """Run a plan, with a dashboard if there is a `port`; return the exit code."""
    from ajgdata.acquire.signals import ended_by_signals
    from ajgdata.cli.live_lines import SortTerminal
    from ajgdata.live.control import Control
    from ajgdata.live.events import read_events
    from ajgdata.paths import find_project
    from ajgdata.pipeline.sort import open_run
    from ajgdata.store.files import read_model
    from ajgdata.types.plan import SortPlan

    control = Control()
    # Questions go where people read, events where programs do.
    terminal = SortTerminal(err if as_json else out, control)
    listener = _print_event if as_json else terminal.tell
    with (
        _stopped_by_hand(),
        ended_by_signals(("SIGINT", "SIGTERM", "SIGHUP")),
        open_run(
            find_project(), read_model(file, SortPlan), confirm=terminal.confirm,
            control=control, listen=listener,
        ) as run,
        _shown(run.log, control, port),
    ):  # fmt: skip
        try:
            done = run.run()
        finally:
            taken = any(one["event"] in ("take", "reference") for one in read_events(run.log_file))
            made = f"recordings: {escape(run.name)}" if taken else "nothing was recorded"
            where = f"{made}, log: {escape(str(run.log_file))}"
            with suppress(OSError):  # a terminal that is gone
                warn(where)
    if not as_json:
        wrong = f", {done.mistakes} of them wrong" if done.mistakes else ""
        counts = f"{done.longest_row} in a row at most{wrong}; {escape(terminal.summary())}"
        say(f"[b]{done.sorts} sorted[/b], {counts}")
    return 0 if done.finished else DOUBT


@contextmanager
def _shown(log: EventLog, control: Control, port: int | None) -> Iterator[None]:
    """Serve the dashboard during the block, if there is a `port`."""
    if port is None:
        yield
        return
    from ajgdata.live.dashboard import serve_dashboard

    with serve_dashboard(log, control, port=port) as served:
        warn(f"dashboard: {escape(served.address)}")
        yield


def _print_event(event: Any) -> None:
    sys.stdout.write(json.dumps(event) + "\n")
    sys.stdout.flush()


def _learn(run: str) -> None:
    """Label a run's recordings by its corrections."""
    from ajgdata.live.learning import learn_from
    from ajgdata.paths import find_project

    dataset, session, learnt = learn_from(find_project(), run)
    left = f", {learnt.unlabelled} without a label stay out (`reject`)" * bool(learnt.unlabelled)
    say(
        f"{escape(dataset)}/{escape(session)}: {learnt.labelled} recordings labelled{left}",
    )
    if learnt.labelled:
        say(f"train on them: ajgdata run {dataset}")
    elif learnt.unlabelled:
        say("correct objects on the dashboard, or fill in recordings.csv")


@contextmanager
def _stopped_by_hand() -> Iterator[None]:
    """Turn Ctrl-C, and the dashboard's stop, into exit code 130 without a trace."""
    try:
        yield
    except KeyboardInterrupt:
        raise typer.Exit(130) from None


def dashboard(
    log: Annotated[Path, typer.Argument(help="log of a run (events.jsonl)")],
    port: Annotated[
        int, typer.Option(min=0, max=65_535, help="port of the page; 0: any free port")
    ] = 0,
) -> None:
    """Show the end of a run in a browser, until Ctrl-C."""
    from ajgdata.live.control import Control
    from ajgdata.live.dashboard import dashboard as served
    from ajgdata.live.events import read_events

    events = read_events(log)
    control = Control()
    with served(control, port=port) as shown:
        for event in events:  # the page shows that this is a replay
            shown.feed.tell({**event, "replay": True} if event["event"] == "start" else event)
        control.end()
        say(f"{len(events)} events: {escape(shown.address)}")
        say("Ctrl-C ends it")
        try:
            Event().wait()
        except KeyboardInterrupt:
            return
