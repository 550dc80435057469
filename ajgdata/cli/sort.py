"""`ajgdata sort`: a trained model sorts objects."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from ajgdata.cli.console import ATTENTION, out, say, warn
from ajgdata.cli.sense import stopped_by_hand

if TYPE_CHECKING:
    from ajgdata.live.events import EventLog
    from ajgdata.live.steps import Control


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
    raise typer.Exit(_sort(plan, dashboard))


def _sort(file: Path, is_shown: bool) -> int:
    """Run a plan, with a dashboard if it `is_shown`; return the exit code."""
    from ajgdata.acquire.signals import ended_by_signals
    from ajgdata.live.steps import Control
    from ajgdata.live.terminal import SortTerminal
    from ajgdata.paths import find_project
    from ajgdata.pipeline.sort import open_run
    from ajgdata.store.files import read_model
    from ajgdata.types.protocol import SortPlan

    control, plan = Control(), read_model(file, SortPlan)
    terminal = SortTerminal(out, control)
    with (
        stopped_by_hand(),
        ended_by_signals(("SIGINT", "SIGTERM", "SIGHUP")),
        open_run(
            find_project(), plan, confirm=terminal.confirm, control=control, listen=terminal.tell
        ) as sorter,
        _dashboard(sorter.log, control) if is_shown else nullcontext(),
    ):  # fmt: skip
        try:
            state = sorter.run()
        finally:
            session = f"{plan.dataset}/{sorter.session.folder.name}"
            result = f"recordings: {session}" if sorter.recordings else "nothing was recorded"
            with suppress(OSError):  # a terminal that is gone
                warn(escape(f"{result}, log: {sorter.log.path}"))
    wrong = f", {state.mistakes} of them wrong" if state.mistakes else ""
    bins = ", ".join(f"{name} {count}" for name, count in sorted(state.bins.items()))
    counts = f"{state.rows[1]} in a row at most{wrong}; {escape(bins)}"
    say(f"[b]{len(state.placed)} sorted[/b], {counts}")
    return 0 if state.stopped and state.stopped["finished"] else ATTENTION


@contextmanager
def _dashboard(log: EventLog, control: Control) -> Iterator[None]:
    """Serve the dashboard of a run during the block."""
    from ajgdata.live.dashboard import dashboard

    with dashboard(control) as served:
        log.listen(served.feed.tell)
        warn(f"dashboard: {escape(served.address)}")
        yield
