"""`ajgdata sense`: classify the object in the gripper. Recordings are not stored."""

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

from ajgdata.acquire.robot import RobotGrasp
from ajgdata.acquire.signals import ended_by_signals
from ajgdata.cli.completion import dataset_names
from ajgdata.cli.console import JsonOption, out, print_json, say
from ajgdata.cli.device import CARD_PANEL, OutputChannel, project_for
from ajgdata.paths import Paths
from ajgdata.store.sessions import read_dataset, require_waveforms
from ajgdata.types import DataError, PassiveRecording
from ajgdata.types.protocol import NOTHING

if TYPE_CHECKING:
    from ajgdata.acquire.card import Capture, Sound
    from ajgdata.live.predictor import Prediction

#: Panel of the help text for options of the virtual gripper.
_VIRTUAL_PANEL = "virtual gripper"
#: Smallest probability that is not reported as uncertain (threshold of the paper for sorting).
THRESHOLD = 0.6
#: Force of the virtual gripper on the object.
_FORCE_N = 8.0
#: Width of a bar in characters.
_BAR_WIDTH = 40
#: Colour and text by verdict (`live.predictor.NoveltyVerdict`).
_VERDICTS = {
    "known": ("green", "known"),
    "nothing": ("yellow", "nothing held"),
    "unknown": ("red", "novel object"),
    "no sign": ("yellow", "no sign of a novel object"),
    "not checked": ("yellow", "novelty not checked"),
}


def sense(
    dataset: Annotated[
        str, typer.Argument(help="data set of the model", autocompletion=dataset_names)
    ],
    task: Annotated[str, typer.Argument(help="task of the model")],
    model: Annotated[
        str, typer.Argument(help="model; default: cnn, else the first of the task")
    ] = "",
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
            rich_help_panel=_VIRTUAL_PANEL,
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(
            min=0, help="seed of the random objects and poses", rich_help_panel=_VIRTUAL_PANEL
        ),
    ] = None,
    covariates: Annotated[
        list[str] | None,
        typer.Option("--covariate", help="value of a covariate, NAME=VALUE; repeatable"),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Classify the object in the gripper."""
    paths = project_for(source, device)
    if source == "soundcard" and objects:
        raise DataError("--object", "is only used with --source virtual", "remove it")
    card: dict[str, Any] = {"device": device, "output_channel": output_channel}
    if microphone is not None:
        card["microphone"] = microphone
    if seed is None:
        seed = secrets.randbelow(2**31)
    with stopped_by_hand():
        _sense(
            paths,
            dataset,
            task,
            model,
            source=source,
            card=card,
            objects=objects or (),
            covariates=covariate_values(covariates or ()),
            seed=seed,
            numbers=count(1) if watch else (1,),
            as_json=as_json,
        )


def covariate_values(texts: Iterable[str]) -> dict[str, float]:
    """Return the value of each covariate from texts NAME=VALUE. Raises DataError for other texts.

    >>> covariate_values(["robot_force_n=4.5"])
    {'robot_force_n': 4.5}
    """
    values = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            values[name.strip()] = float(value)
        except ValueError:
            problem = f"{text!r} is not NAME=VALUE with a number"
            raise DataError("--covariate", problem, "write e.g. robot_force_n=4.5") from None
    return values


@contextmanager
def stopped_by_hand() -> Iterator[None]:
    """Exit with code 130, without a traceback, after Ctrl-C or a stop on the dashboard."""
    try:
        yield
    except KeyboardInterrupt:
        raise typer.Exit(130) from None


def _sense(
    paths: Paths,
    dataset: str,
    task: str,
    model: str,
    *,
    source: str,
    card: Mapping[str, Any],
    objects: Sequence[str],
    covariates: Mapping[str, float],
    seed: int,
    numbers: Iterable[int],
    as_json: bool,
) -> None:
    """Grasp, record, predict and print for each number.

    `source` and `card` are those of `open_hands`. The virtual gripper grasps random `objects`, by
    default of the recipe. Raises CardError and DataError.
    """
    import numpy as np

    from ajgdata.acquire.live_session import excitation_of
    from ajgdata.loading import load_predictor
    from ajgdata.pipeline.acquire_live import VIRTUAL, open_hands

    spec = read_dataset(paths, dataset)
    require_waveforms(spec, "ajgdata sense")
    model = model or spec.default_model(task)
    predictor = load_predictor(dataset, task, model, paths.root)
    predictor.covariate_columns(covariates)  # raises DataError
    if source == VIRTUAL and spec.recipe and not objects:
        objects = [item.name for item in spec.recipe.objects]
    played: Sound
    samples = None  # of the played sound
    waiting_text = ""
    if isinstance(spec.excitation, PassiveRecording):
        played = spec.excitation
        waiting_text = played.waiting_text
    else:
        played = samples = np.asarray(excitation_of(paths, spec), np.float32)
    generator = np.random.default_rng(seed)
    hands = open_hands(
        paths,
        spec,
        source=source,
        card=card,
        robot=None,
        seed=seed,
        confirm=lambda text: None,
        rate_hz=predictor.sample_rate_hz,
        microphone=predictor.audio.microphone,
    )
    with ended_by_signals(), hands as (robot, opened_card, _):
        for number in numbers:
            name = objects[int(generator.integers(len(objects)))] if objects else ""
            if name:
                grasp = RobotGrasp(
                    grasp_id=f"sense_{number}",
                    object="" if name == NOTHING else name,
                    number=number,
                    force_n=_FORCE_N,
                )
                robot.move("approach", **vars(grasp))
            if waiting_text and not as_json:
                say(f"[dim]{waiting_text}[/dim]")
            start = time.perf_counter()
            capture = opened_card.take(played)
            prediction = predictor.predict(
                capture.samples, predictor.sample_rate_hz, samples, covariates
            )
            seconds = time.perf_counter() - start
            if as_json:
                print_json(
                    {
                        "number": number,
                        "source": "simulated" if source == VIRTUAL else "recorded",
                        "object": name or None,
                        "time_s": seconds,
                        "peak_dbfs": capture.peak_dbfs,
                        "clipped": capture.clipped,
                        **_json_prediction(prediction),
                    }
                )
            else:
                _print_prediction(number, name, capture, prediction, seconds)


def _json_prediction(prediction: Prediction) -> dict[str, Any]:
    """Return the fields of a prediction. Without an object in the gripper, `value` is None."""
    content = prediction.plain()
    content["unit"] = prediction.unit or None
    if prediction.verdict == "nothing":
        content["value"] = None
    return content


def _print_prediction(
    number: int, name: str, capture: Capture, prediction: Prediction, seconds: float
) -> None:
    """Print the level of a recording, the probability of each class, and the verdict.

    `name` is the object of the virtual gripper. It is "" for a real gripper, which a person has
    closed on an unknown object. `seconds` is the time from the first played sample to the
    prediction.
    """
    from ajgdata.acquire.operator import meter
    from ajgdata.live.sort import percent

    simulated = f", holds {name} (simulated)" if name else ""
    peak = f"{meter(capture.peak_dbfs)} {capture.peak_dbfs:.1f} dBFS"
    say(f"[b]{number}[/b]  {peak}  {seconds:.2f} s{escape(simulated)}")
    colour, verdict = _VERDICTS[prediction.verdict]
    may_be_sorted = prediction.verdict not in ("nothing", "unknown")
    table = Table.grid(padding=(0, 2))
    for label, share in sorted(prediction.probability.items(), key=lambda item: -item[1]):
        bar_colour = colour if may_be_sorted and share >= THRESHOLD else "default"
        bar = Bar(1, 0, share, width=_BAR_WIDTH, color=bar_colour)
        table.add_row(escape(label), bar, percent(share))
    if prediction.probability:
        out.print(table)
        is_uncertain = max(prediction.probability.values()) < THRESHOLD
        if is_uncertain and prediction.verdict in ("known", "no sign"):
            colour = "yellow"
            verdict = f"{verdict}, but below {percent(THRESHOLD)}"
    value = ""
    if prediction.verdict != "nothing":
        value = f": [b]{escape(_value_text(prediction))}[/b]"
    say(f"[{colour}]{verdict}[/]{value}[dim]{_novelty_text(prediction)}[/dim]")
    for text in prediction.remarks:
        say(f"[yellow]warning[/yellow] {escape(text)}")


def _value_text(prediction: Prediction) -> str:
    """Return the predicted class, or the number or vector with its interval."""
    if not prediction.interval:
        return str(prediction.value)
    low, high = prediction.interval
    unit = f" {prediction.unit}" if prediction.unit else ""
    if isinstance(prediction.value, tuple):
        vector = ", ".join(f"{number:.4g}" for number in prediction.value)
        return f"({vector}){unit}, within {(high[0] - low[0]) / 2:.4g}{unit}"
    return f"{prediction.value:.4g}{unit}, between {low:.4g} and {high:.4g}"


def _novelty_text(prediction: Prediction) -> str:
    """Return the novelty and the detection rate of novel objects, in brackets; "" for none."""
    from ajgdata.live.sort import detection_text

    if prediction.novelty is None:
        return ""
    return f" (novelty {prediction.novelty:.2f}, limit 1; {detection_text(prediction)})"
