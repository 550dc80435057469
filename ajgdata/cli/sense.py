"""`ajgdata sense`: a trained model classifies what the gripper holds; nothing is kept."""

from __future__ import annotations

import secrets
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.bar import Bar
from rich.markup import escape
from rich.table import Table

from ajgdata.cli.console import out, say
from ajgdata.types import DataError

if TYPE_CHECKING:
    from ajgdata.acquire.robot import Robot
    from ajgdata.acquire.virtual import Card
    from ajgdata.live.predictor import Prediction, Predictor
    from ajgdata.types import DatasetSpec

_CARD = "sound card"
_VIRTUAL = "virtual gripper"
#: Least probability that sorting needs (paper).
THRESHOLD = 0.6
#: Width of a bar in characters.
_BAR_WIDTH = 40
#: Colour and text by verdict (`live.predictor.Verdict`).
_VERDICTS = {
    "known": ("green", "known"),
    "nothing": ("yellow", "nothing held"),
    "unknown": ("red", "unlike anything known"),
    "not checked": ("yellow", "novelty not checked"),
}
Channel = Annotated[int, typer.Option(min=1, rich_help_panel=_CARD)]


@dataclass(frozen=True)
class SenseResult:
    """One recording: its prediction, its peak, the number of samples at full scale, and the time
    from the first sample played to the prediction. `object` is the simulated object, "" if it is
    unknown."""

    number: int
    prediction: Prediction
    peak_dbfs: float
    clipped: int
    seconds: float
    object: str


def sense(
    dataset: Annotated[str, typer.Argument(help="data set of the model")],
    task: Annotated[str, typer.Argument(help="its task")],
    model: Annotated[str, typer.Argument(help="cnn, linear, ...")] = "cnn",
    source: Annotated[str, typer.Option(help="soundcard, or virtual (no hardware)")] = "soundcard",
    watch: Annotated[bool, typer.Option("--watch", help="repeat until Ctrl-C")] = False,
    device: Annotated[
        str, typer.Option(help="exact name in `ajgdata device list`", rich_help_panel=_CARD)
    ] = "",
    input_channel: Channel = 1,
    output_channel: Channel = 1,
    objects: Annotated[
        list[str] | None,
        typer.Option(
            "--object", help="held object, or `empty`; repeatable", rich_help_panel=_VIRTUAL
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="of objects and poses", rich_help_panel=_VIRTUAL)
    ] = None,
) -> None:
    """Classify the object in the gripper."""
    if source not in ("soundcard", "virtual"):
        raise DataError("--source", f"there is no {source!r}", "soundcard or virtual")
    if source == "soundcard" and not device:
        fix = 'add --device "…" (see `ajgdata device list`), or --source virtual'
        raise DataError("ajgdata sense", "needs a device", fix)
    card = {"device": device, "input_channel": input_channel, "output_channel": output_channel}
    seed = secrets.randbelow(2**31) if seed is None else seed
    with stopped_by_hand(), _sensing((dataset, task, model), source, card, objects, seed) as takes:
        for take in takes:
            _show(take)
            if not watch:
                break


@contextmanager
def stopped_by_hand() -> Iterator[None]:
    """Turn Ctrl-C, and the dashboard's stop, into exit code 130 without a trace."""
    try:
        yield
    except KeyboardInterrupt:
        raise typer.Exit(130) from None


@contextmanager
def _sensing(
    names: tuple[str, str, str],
    source: str,
    card: Mapping[str, Any],
    objects: list[str] | None,
    seed: int,
) -> Iterator[Iterator[SenseResult]]:
    """Open a model (data set, task, model) and a sound card; yield an iterator over grasps.

    `source` and `card`: see `open_hands`; `objects`: what the virtual gripper holds, in a random
    order (default: all of the recipe). Raises CardError and DataError.
    """
    from ajgdata.acquire.signals import ended_by_signals
    from ajgdata.loading import load_predictor
    from ajgdata.paths import find_project
    from ajgdata.pipeline.acquire_live import VIRTUAL, open_hands
    from ajgdata.store.sessions import read_dataset

    paths = find_project()
    spec = read_dataset(paths, names[0])
    if names[1] not in spec.tasks:
        known = ", ".join(spec.tasks) or "none"
        raise DataError(paths.dataset(spec.name), f"no task {names[1]!r}", f"declared are: {known}")
    predictor = load_predictor(*names, paths.root)
    if source == VIRTUAL and spec.recipe and not objects:
        objects = [item.name for item in spec.recipe.objects]
    if source != VIRTUAL and objects:
        raise DataError("--object", "is for the virtual gripper", "leave it out")
    with (
        ended_by_signals(),
        open_hands(
            paths, spec, source=source, card=card, robot=None, seed=seed,
            confirm=lambda text: None, rate_hz=predictor.sample_rate_hz,
        ) as (robot, opened, _),
    ):  # fmt: skip
        yield _takes(spec, predictor, robot, opened, objects or [], seed)


def _takes(
    spec: DatasetSpec,
    predictor: Predictor,
    robot: Robot,
    card: Card,
    objects: list[str],
    seed: int,
) -> Iterator[SenseResult]:
    """Grasp, play, record and predict, without end."""
    import numpy as np

    from ajgdata.acquire.live_session import excitation_of
    from ajgdata.acquire.robot import Placement

    played = excitation_of(spec).astype(np.float32)
    random = np.random.default_rng(seed)
    for number in count(1):
        name = objects[random.integers(len(objects))] if objects else ""
        if name:
            held = "" if name == "empty" else name
            robot.move("approach", **vars(Placement(f"sense_{number}", held, number, 8.0)))
        begin = time.perf_counter()
        capture = card.take(played)
        prediction = predictor.predict(capture.samples, card.settings.sample_rate_hz)
        seconds = time.perf_counter() - begin
        yield SenseResult(number, prediction, capture.peak_dbfs, capture.clipped, seconds, name)


def _show(take: SenseResult) -> None:
    """Print one recording: its level, the probability of each class, and the verdict."""
    from ajgdata.acquire.operator import meter
    from ajgdata.live.decision import percent

    simulated = f", holds {take.object} (simulated)" if take.object else ""
    peak = f"{meter(take.peak_dbfs)} {take.peak_dbfs:.1f} dBFS"
    say(f"[b]{take.number}[/b]  {peak}  {take.seconds:.2f} s{escape(simulated)}")
    prediction = take.prediction
    colour, verdict = _VERDICTS[prediction.verdict]
    ordered = sorted(prediction.probability.items(), key=lambda item: -item[1])
    table = Table.grid(padding=(0, 2))
    for name, share in ordered:
        is_sure = share >= THRESHOLD and prediction.verdict in ("known", "not checked")
        bar = Bar(1, 0, share, width=_BAR_WIDTH, color=colour if is_sure else "default")
        table.add_row(escape(name), bar, percent(share))
    if ordered:
        out.print(table)
    if prediction.verdict == "known" and ordered and ordered[0][1] < THRESHOLD:
        colour, verdict = "yellow", f"known, but below {percent(THRESHOLD)}"
    value = "" if prediction.verdict == "nothing" else f": [b]{escape(_value(prediction))}[/b]"
    say(f"[{colour}]{verdict}[/]{value}[dim]{_novelty(prediction)}[/dim]")
    for text in prediction.remarks:
        say(f"[yellow]warning[/yellow] {escape(text)}")


def _value(prediction: Prediction) -> str:
    """Return the predicted class, or the number with its interval."""
    if not prediction.interval:
        return str(prediction.value)
    low, high = prediction.interval
    unit = f" {prediction.unit}" if prediction.unit else ""
    return f"{prediction.value:.4g}{unit}, between {low:.4g} and {high:.4g}"


def _novelty(prediction: Prediction) -> str:
    """Return the novelty, and how many novel objects the check detects, in brackets."""
    from ajgdata.live.decision import percent

    if prediction.novelty is None:
        return ""
    rate = prediction.detection_rate
    detects = "" if rate is None else f"; this check detects up to {percent(rate)} of novel objects"
    return f" (novelty {prediction.novelty:.2g}, limit 1{detects})"
