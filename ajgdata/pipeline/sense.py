"""`ajgdata sense`: grasps that a trained model is asked about; nothing of them is kept."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.acquire.card import Card
from ajgdata.acquire.robot import Confirm, Placement, Robot
from ajgdata.live.prediction import Prediction
from ajgdata.loading import load_predictor
from ajgdata.paths import Paths
from ajgdata.pipeline.acquire_live import excitation_of
from ajgdata.pipeline.live_source import open_hands
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


class Sensing:
    """A gripper, a sound card and a model; `sense` makes one grasp."""

    def __init__(
        self,
        robot: Robot,
        card: Card,
        predictor: Predictor,
        played: NDArray[np.float32],
        things: tuple[str, ...],
        seed: int,
    ) -> None:
        self._robot, self._card, self._predictor = robot, card, predictor
        self._played, self._things = played, things
        self._random = np.random.default_rng(seed)
        self._number = 0

    def sense(self) -> Sensed:
        """Grasp, play, record, predict. Raises CardError, and DataError for what is no sound."""
        self._number += 1
        thing = ""
        if self._things:
            thing = self._things[self._random.integers(len(self._things))]
            held = "" if thing == "empty" else thing
            place = Placement(f"sense_{self._number}", held, self._number, 8.0)
            self._robot.move("approach", **vars(place))
        begin = time.perf_counter()
        capture = self._card.take(self._played)
        rate = self._card.settings.sample_rate_hz
        said = self._predictor.predict(capture.samples, rate)
        seconds = time.perf_counter() - begin
        return Sensed(self._number, said, capture.peak_dbfs, capture.clipped, seconds, thing)


@contextmanager
def open_sensing(
    paths: Paths,
    dataset: str,
    task: str,
    model: str,
    *,
    source: str,
    card: Mapping[str, Any],
    things: tuple[str, ...],
    seed: int,
    confirm: Confirm,
) -> Iterator[Sensing]:
    """Open model and sound card. `source` and `card`: see live_source.open_hands; `things`: objects
    that the virtual gripper holds, in an order drawn by `seed` (default: all of the recipe).

    Raises DataError.
    """
    spec = read_dataset(paths, dataset)
    if task not in spec.tasks:
        known = ", ".join(spec.tasks) or "none"
        raise DataError(paths.dataset(dataset), f"no task {task!r}", f"declared are: {known}")
    predictor = load_predictor(dataset, task, model, paths.root)
    if source == "virtual" and spec.recipe and not things:
        things = tuple(made.name for made in spec.recipe.objects)
    if source != "virtual" and things:
        raise DataError("--object", "is for the virtual gripper", "leave it out")
    with open_hands(
        paths, spec, source=source, card=card, robot="manual", robot_settings={}, seed=seed,
        confirm=confirm,
    ) as (robot, opened, _):  # fmt: skip
        played = excitation_of(paths.dataset(dataset), spec).astype(np.float32)
        yield Sensing(robot, opened, predictor, played, things, seed)
