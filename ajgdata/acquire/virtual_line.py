"""The virtual gripper in live use: a robot that places objects of a recipe, and a sound card."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.acquire.card import DEVICE, Capture, CardSettings
from ajgdata.acquire.recipe import NEW, new_setup
from ajgdata.acquire.robot import Robot
from ajgdata.acquire.virtual import chain_of, scene_of
from ajgdata.gripper import SAMPLE_RATE_HZ, ImpulseResponse, SceneError, derive_seed, record
from ajgdata.store.responses import ResponseStore
from ajgdata.types import DataError, Recipe


class VirtualTable:
    """The virtual gripper over the objects of a recipe, as a robot and a sound card.

    `seed` draws poses, nuisances and noise; no grasp is one that the recipe records. Responses are
    kept in `folder`. `robot` is moved along, if there is one. Raises DataError for a recipe with a
    silent speaker.
    """

    def __init__(self, recipe: Recipe, seed: int, folder: Path, robot: Robot | None = None) -> None:
        self._recipe, self._seed, self._robot = recipe, seed, robot
        self._chain = chain_of("recipe: signal", recipe.signal)
        if self._chain.level_db_spl is None:
            raise DataError("recipe.signal", "the speaker is silent", "use another data set")
        self._solver = ResponseStore(folder)
        self._response: ImpulseResponse | None = None
        self._angle_deg, self._takes = 0.0, 0
        self.settings = CardSettings(device=DEVICE, sample_rate_hz=SAMPLE_RATE_HZ)

    def move(self, step: str, **about: Any) -> float | None:
        """Make a step of a robot (see acquire.robot); only `approach` changes what is heard."""
        force = self._robot.move(step, **about) if self._robot else None
        if step != "approach":
            return force
        self.place(about["object"], about["number"], about["grasp_id"])
        return force if self._robot else float(about["force_n"])

    def place(self, name: str, number: int, grasp_id: str) -> None:
        """Grasp `name` ("" for nothing): `number` draws its pose, `grasp_id` the rest."""
        pose = derive_seed(self._seed, "pose", name, number)
        nuisance = derive_seed(self._seed, "grasp", name, grasp_id)
        try:
            setup = new_setup(self._recipe, name, pose, nuisance, (self._seed, NEW))
            scene = scene_of(grasp_id, setup)
            self._response = self._solver.solve(scene)
        except ValueError as error:
            raise DataError("objects", str(error), "correct its name") from None
        except SceneError as error:
            raise DataError(name, str(error), "correct the recipe") from None
        self._angle_deg = scene.grasp.angle_deg

    def resume(self, latency_samples: int | None) -> None:
        """Do nothing: there is no latency."""

    def take(self, played: NDArray[np.float32], tail: int = 0) -> Capture:
        """Play (n,) once and return n + tail samples, as the recipe records them."""
        if self._response is None:
            self.place("", 1, "empty")
        assert self._response is not None
        self._takes += 1
        sound = np.concatenate([played, np.zeros(tail)])
        seed = derive_seed(self._seed, "noise", self._takes)
        recorded = record(self._response, sound, self._chain, seed, self._angle_deg)
        return Capture(
            recorded.samples.astype(np.float32),
            latency_samples=0,
            arrival_samples=0,
            peak_dbfs=20 * float(np.log10(max(np.abs(recorded.samples).max(), 1e-10))),
            clipped=recorded.clipped_count,
            xruns=0,
            time=datetime.now(UTC).isoformat(timespec="milliseconds"),
        )

    def listen(self, frames: int) -> Capture:
        """Play nothing and return `frames` samples."""
        return self.take(np.zeros(frames, dtype=np.float32))

    def describe(self) -> Mapping[str, Any]:
        """Return the settings, and what stands for API and driver."""
        return {**self.settings.model_dump(mode="json"), "api": DEVICE, "latency_samples": 0}

    def close(self) -> None:
        """Do nothing: there is nothing to end."""
