"""`ajgdata sense`: a trained model classifies what the gripper holds; nothing is kept."""

from __future__ import annotations

import secrets
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import count
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.bar import Bar
from rich.markup import escape
from rich.table import Table

from ajgdata.cli.console import out, say
from ajgdata.cli.device import CARD_PANEL, OutputChannel
from ajgdata.types import DataError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ajgdata.acquire.card import Capture
    from ajgdata.acquire.robot import Robot
    from ajgdata.acquire.virtual import Card
    from ajgdata.live.predictor import Prediction, Predictor

_VIRTUAL = "virtual gripper"
#: Least probability that sorting needs (paper).
THRESHOLD = 0.6
#: Width of a bar in characters.
_BAR_WIDTH = 40
#: Colour and text by verdict (`live.predictor.Verdict`).
_VERDICTS = {
    "known": ("green", "known"),
    "nothing": ("yellow", "nothing held"),
    "unknown": ("red", "novel object"),
    "no sign": ("yellow", "no sign of a novel object"),
    "not checked": ("yellow", "novelty not checked"),
}


def sense(
    dataset: Annotated[str, typer.Argument(help="data set of the model")],
    task: Annotated[str, typer.Argument(help="task of the model")],
    model: Annotated[str, typer.Argument(help="cnn, linear, ...")] = "cnn",
    source: Annotated[str, typer.Option(help="soundcard, or virtual (no hardware)")] = "soundcard",
    watch: Annotated[bool, typer.Option("--watch", help="repeat until Ctrl-C")] = False,
    device: Annotated[
        str, typer.Option(help="exact name in `ajgdata device list`", rich_help_panel=CARD_PANEL)
    ] = "",
    microphone: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="input channel of the microphone; default: that of the model",
            rich_help_panel=CARD_PANEL,
        ),
    ] = None,
    output_channel: OutputChannel = 1,
    objects: Annotated[
        list[str] | None,
        typer.Option(
            "--object",
            help="object in the gripper, or `empty`; repeatable",
            rich_help_panel=_VIRTUAL,
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(min=0, help="seed of the random objects and poses", rich_help_panel=_VIRTUAL),
    ] = None,
) -> None:
    """Classify the object in the gripper."""
    if source not in ("soundcard", "virtual"):
        raise DataError("--source", f"unknown value {source!r}", "use soundcard or virtual")
    if source == "soundcard" and not device:
        fix = 'add --device "…" (see `ajgdata device list`), or --source virtual'
        raise DataError("--source soundcard", "requires a device", fix)
    if source == "soundcard" and objects:
        raise DataError("--object", "is only used with --source virtual", "remove it")
    card: dict[str, Any] = {"device": device, "output_channel": output_channel}
    card |= {} if microphone is None else {"microphone": microphone}
    seed = secrets.randbelow(2**31) if seed is None else seed
    with stopped_by_hand():
        _sense(
            (dataset, task, model), source, card, objects or (), seed, count(1) if watch else (1,)
        )


@contextmanager
def stopped_by_hand() -> Iterator[None]:
    """Turn Ctrl-C, and the dashboard's stop, into exit code 130 without a trace."""
    try:
        yield
    except KeyboardInterrupt:
        raise typer.Exit(130) from None


def _sense(
    names: tuple[str, str, str],
    source: str,
    card: Mapping[str, Any],
    objects: Sequence[str],
    seed: int,
    numbers: Iterable[int],
) -> None:
    """Grasp, record, predict with a model (data set, task, model) and print, for each number.

    `source` and `card`: see `open_hands`; `objects`: what the virtual gripper holds, in a random
    order (default: all of the recipe). Raises CardError and DataError.
    """
    import numpy as np

    from ajgdata.acquire.live_session import excitation_of
    from ajgdata.acquire.signals import ended_by_signals
    from ajgdata.loading import load_predictor
    from ajgdata.paths import find_project
    from ajgdata.pipeline.acquire_live import VIRTUAL, open_hands
    from ajgdata.store.sessions import read_dataset

    paths = find_project()
    spec = read_dataset(paths, names[0])
    predictor = load_predictor(*names, paths.root)
    if source == VIRTUAL and spec.recipe and not objects:
        objects = [item.name for item in spec.recipe.objects]
    played, random = excitation_of(spec).astype(np.float32), np.random.default_rng(seed)
    with (
        ended_by_signals(),
        open_hands(
            paths, spec, source=source, card=card, robot=None, seed=seed,
            confirm=lambda text: None, rate_hz=predictor.sample_rate_hz,
            microphone=predictor.audio.microphone,
        ) as (robot, opened, _),
    ):  # fmt: skip
        for number in numbers:
            name = objects[int(random.integers(len(objects)))] if objects else ""
            _sense_once(number, name, predictor, robot, opened, played)


def _sense_once(
    number: int,
    name: str,
    predictor: Predictor,
    robot: Robot,
    card: Card,
    played: NDArray[np.float32],
) -> None:
    """Grasp the simulated object `name` ("": unknown), play (n,), record, predict and print."""
    from ajgdata.acquire.robot import RobotGrasp

    if name:
        held = "" if name == "empty" else name
        robot.move("approach", **vars(RobotGrasp(f"sense_{number}", held, number, 8.0)))
    begin = time.perf_counter()
    capture = card.take(played)
    prediction = predictor.predict(capture.samples, predictor.sample_rate_hz)
    _show(number, name, capture, prediction, time.perf_counter() - begin)


def _show(number: int, name: str, capture: Capture, prediction: Prediction, seconds: float) -> None:
    """Print one recording: its level, the probability of each class, and the verdict.

    `seconds` is the time from the first sample played to the prediction.
    """
    from ajgdata.acquire.operator import meter
    from ajgdata.live.sort import percent

    simulated = f", holds {name} (simulated)" if name else ""
    peak = f"{meter(capture.peak_dbfs)} {capture.peak_dbfs:.1f} dBFS"
    say(f"[b]{number}[/b]  {peak}  {seconds:.2f} s{escape(simulated)}")
    colour, verdict = _VERDICTS[prediction.verdict]
    ordered = sorted(prediction.probability.items(), key=lambda item: -item[1])
    table = Table.grid(padding=(0, 2))
    for label, share in ordered:
        is_sure = share >= THRESHOLD and prediction.verdict not in ("nothing", "unknown")
        bar = Bar(1, 0, share, width=_BAR_WIDTH, color=colour if is_sure else "default")
        table.add_row(escape(label), bar, percent(share))
    if ordered:
        out.print(table)
    if prediction.verdict in ("known", "no sign") and ordered and ordered[0][1] < THRESHOLD:
        colour, verdict = "yellow", f"{verdict}, but below {percent(THRESHOLD)}"
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
    from ajgdata.live.sort import detection_text

    if prediction.novelty is None:
        return ""
    return f" (novelty {prediction.novelty:.2f}, limit 1; {detection_text(prediction)})"
