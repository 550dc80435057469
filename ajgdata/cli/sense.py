"""`ajgdata sense`: a trained model classifies what the gripper holds; nothing is kept."""

from __future__ import annotations

import json
import secrets
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.cells import cell_len
from rich.markup import escape

from ajgdata.cli.console import out, say
from ajgdata.types import DataError

if TYPE_CHECKING:
    from ajgdata.acquire.robot import Robot
    from ajgdata.acquire.virtual import Card
    from ajgdata.live.predictor import Prediction, Predictor
    from ajgdata.types import DatasetSpec

_CARD = "sound card"
_VIRTUAL = "virtual gripper"
#: Least probability that sorting needs (paper), drawn as a line.
THRESHOLD = 0.6
_EIGHTHS = " ▏▎▍▌▋▊▉"
#: Widths of a bar, in characters; narrower terminals get none.
_WIDEST, _NARROWEST = 40, 8
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

    def plain(self) -> dict[str, Any]:
        """Return the result as JSON represents it."""
        about = {key: getattr(self, key) for key in ("number", "object", "peak_dbfs", "clipped")}
        return {**about, "seconds": round(self.seconds, 4), **self.prediction.plain()}


def sense(
    dataset: Annotated[str, typer.Argument(help="data set of the model")],
    task: Annotated[str, typer.Argument(help="its task")],
    model: Annotated[str, typer.Argument(help="cnn, linear, ...")] = "cnn",
    source: Annotated[str, typer.Option(help="soundcard, or virtual (no hardware)")] = "soundcard",
    watch: Annotated[bool, typer.Option("--watch", help="repeat until Ctrl-C")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="one JSON object per recording")] = False,
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
            _show(take, as_json)
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
            paths, spec, source=source, card=card, robot=None, seed=seed, confirm=lambda text: None
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


def _show(take: SenseResult, as_json: bool) -> None:
    """Print one recording."""
    from ajgdata.acquire.operator import meter

    if as_json:
        sys.stdout.write(json.dumps(take.plain(), allow_nan=False) + "\n")
        sys.stdout.flush()
        return
    simulated = f", holds {take.object} (simulated)" if take.object else ""
    peak = f"{meter(take.peak_dbfs)} {take.peak_dbfs:.1f} dBFS"
    say(f"[b]{take.number}[/b]  {peak}  {take.seconds:.2f} s{escape(simulated)}")
    for line in _table(take.prediction, out.width):
        say(line)


def _bar(share: float, width: int) -> str:
    """Return a bar of `width` characters for a share of 1; `│` stands at the threshold."""
    eighths = round(max(0.0, min(share, 1.0)) * width * 8)
    cells = list(("█" * (eighths // 8) + _EIGHTHS[eighths % 8]).ljust(width)[:width])
    at = int(THRESHOLD * width)
    cells[at] = "│" if cells[at] == " " else "┃"
    return "".join(cells)


def _table(prediction: Prediction, width: int) -> list[str]:
    """Return the lines (rich markup) that show one prediction in `width` columns."""
    from ajgdata.live.decision import percent

    colour, verdict = _VERDICTS[prediction.verdict]
    ordered = sorted(prediction.probability.items(), key=lambda item: -item[1])
    name_width = max((cell_len(name) for name in prediction.probability), default=0)
    room = min(width - name_width - 12, _WIDEST)
    lines = []
    for name, share in ordered:
        bar = f"  {_bar(share, room)}" if room >= _NARROWEST else ""
        is_sure = share >= THRESHOLD and prediction.verdict in ("known", "not checked")
        style = f"[{colour}]" if is_sure else "[dim]" if share < 0.01 else "[default]"
        lines.append(f"{style}{escape(name.ljust(name_width))}{bar}  {percent(share):>7}[/]")
    if prediction.verdict == "known" and ordered and ordered[0][1] < THRESHOLD:
        colour, verdict = "yellow", f"known, but below {percent(THRESHOLD)}"
    value = "" if prediction.verdict == "nothing" else f": [b]{escape(_value(prediction))}[/b]"
    lines.append(f"[{colour}]{verdict}[/]{value}[dim]{_novelty(prediction)}[/dim]")
    return [*lines, *(f"[yellow]warning[/yellow] {escape(text)}" for text in prediction.remarks)]


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
