"""`ajgdata sort`: sort objects into bins with a trained model."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from ajgdata.acquire.signals import ended_by_signals
from ajgdata.cli.console import ATTENTION, out, say, warn
from ajgdata.cli.sense import stopped_by_hand
from ajgdata.live.events import EventLog
from ajgdata.live.steps import Control
from ajgdata.paths import find_project
from ajgdata.store.files import read_model
from ajgdata.types.extras import require_extra
from ajgdata.types.protocol import SortPlan


def sort(
    plan: Annotated[Path, typer.Argument(help="sorting plan, PLAN.yaml")],
    dashboard: Annotated[
        bool, typer.Option("--dashboard", help="also show the run in a browser")
    ] = False,
) -> None:
    """Sort objects into bins by their sound.

    Each object is grasped, recorded, classified and placed. If a run ends early, the robot halts,
    and the command names the held object. Exit code 3 if it stopped at an uncertain object.
    """
    raise typer.Exit(_sort(read_model(plan, SortPlan), has_dashboard=dashboard))


def _sort(plan: SortPlan, *, has_dashboard: bool) -> int:
    """Run a plan, and return the exit code."""
    if has_dashboard:
        require_extra("live", "--dashboard")
    from ajgdata.live.terminal import SortTerminal
    from ajgdata.pipeline.sort import open_run

    control = Control()
    terminal = SortTerminal(out, control)
    run = open_run(
        find_project(), plan, confirm=terminal.confirm, control=control, listen=terminal.tell
    )
    with (
        stopped_by_hand(),
        ended_by_signals(also_ctrl_c=True),
        run as sorter,
        _dashboard(sorter.log, control) if has_dashboard else nullcontext(),
    ):
        try:
            state = sorter.run()
        finally:
            result = "nothing was recorded"
            if sorter.recordings:
                result = f"recordings: {plan.dataset}/{sorter.session.folder.name}"
            with suppress(OSError):  # the terminal was closed
                warn(escape(f"{result}, log: {sorter.log.path}"))
    bins = ", ".join(f"{name} {count}" for name, count in sorted(state.bins.items()))
    counts = f"{state.rows[1]} in a row at most"
    if state.mistakes:
        counts += f", {state.mistakes} of them wrong"
    say(f"[b]{len(state.placed)} sorted[/b], {counts}; {escape(bins)}")
    has_finished = state.stopped is not None and state.stopped["finished"]
    return 0 if has_finished else ATTENTION


@contextmanager
def _dashboard(log: EventLog, control: Control) -> Iterator[None]:
    """Serve the dashboard of a run during the block."""
    from ajgdata.live.dashboard import dashboard

    with dashboard(control) as served:
        log.listen(served.feed.tell)
        warn(f"dashboard: {escape(served.address)}")
        yield
