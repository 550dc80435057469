"""`ajgdata sense`: grasps that a trained model is asked about; nothing of them is kept."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.acquire.card import Card
from ajgdata.acquire.robot import Placement, Robot
from ajgdata.live.predictor import Prediction
from ajgdata.loading import load_predictor
from ajgdata.paths import Paths
from ajgdata.pipeline.acquire_live import VIRTUAL, excitation_of, open_hands
from ajgdata.store.sessions import read_dataset
from ajgdata.types import DataError

if TYPE_CHECKING:
    from ajgdata.live.predictor import Predictor


@dataclass(frozen=True)
class Sensed:
    """One take: what the model says of it, its peak, samples at full scale, and the time from the
    first sample played to the prediction. `object` is what was simulated, "" if nobody knows."""

    number: int
    prediction: Prediction
    peak_dbfs: float
    clipped: int
    seconds: float
    object: str

    def plain(self) -> dict[str, Any]:
        """Return it as JSON can hold it."""
        about = {key: getattr(self, key) for key in ("number", "object", "peak_dbfs", "clipped")}
        return {**about, "seconds": round(self.seconds, 4), **self.prediction.plain()}


@contextmanager
def open_sensing(
    paths: Paths,
    dataset: str,
    task: str,
    model: str,
    *,
    source: str,
    card: Mapping[str, Any],
    objects: tuple[str, ...],
    seed: int,
) -> Iterator[Iterator[Sensed]]:
    """Open model and sound card, and yield an iterator of which each step is one grasp.

    `source` and `card`: see `open_hands`; `objects`: what the virtual gripper holds, in an order
    drawn by `seed` (default: all of the recipe). Raises CardError and DataError.
    """
    spec = read_dataset(paths, dataset)
    if task not in spec.tasks:
        known = ", ".join(spec.tasks) or "none"
        raise DataError(paths.dataset(dataset), f"no task {task!r}", f"declared are: {known}")
    predictor = load_predictor(dataset, task, model, paths.root)
    if source == VIRTUAL and spec.recipe and not objects:
        objects = tuple(made.name for made in spec.recipe.objects)
    if source != VIRTUAL and objects:
        raise DataError("--object", "is for the virtual gripper", "leave it out")
    with open_hands(
        paths, spec, source=source, card=card, robot="manual", robot_settings={}, seed=seed,
        confirm=lambda text: None,
    ) as (robot, opened, _):  # fmt: skip
        played = excitation_of(spec).astype(np.float32)
        yield _sensed(robot, opened, predictor, played, objects, seed)


def _sensed(
    robot: Robot,
    card: Card,
    predictor: Predictor,
    played: NDArray[np.float32],
    objects: tuple[str, ...],
    seed: int,
) -> Iterator[Sensed]:
    """Grasp, play, record and predict, again and again."""
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
        yield Sensed(number, prediction, capture.peak_dbfs, capture.clipped, seconds, name)
