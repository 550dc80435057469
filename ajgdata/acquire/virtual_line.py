"""The virtual gripper as a line, in this process: a take as a sound card makes it, without one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.acquire.card import DEVICE, CardSettings, Heard
from ajgdata.acquire.plant import Plant, noise_floor, scene_noise, scene_response
from ajgdata.acquire.recipe import NEW, new_setup
from ajgdata.acquire.robot import Placement, Robot
from ajgdata.acquire.sound_card import SoundCard
from ajgdata.acquire.virtual import chain_of, scene_of
from ajgdata.gripper import SAMPLE_RATE_HZ, SceneError, derive_seed
from ajgdata.store.responses import ResponseStore
from ajgdata.types import DataError, Recipe

#: Latency in samples: a usual period of a driver.
PERIOD = 1_024


class PlantLine:
    """Line (see acquire.card) through a plant: input 1 is the microphone, 2 the loop-back.

    As a real card it hears everything `latency` samples late.
    """

    def __init__(self, plant: Plant, latency: int = PERIOD) -> None:
        self._plant, self._latency = plant, latency

    def play(self, sound: NDArray[np.float32], frames: int) -> Heard:
        """Play `sound` (n,) once and return (frames, 2)."""
        played = np.zeros(frames, dtype=np.float32)
        heard = sound[: max(frames - self._latency, 0)]
        played[self._latency : self._latency + len(heard)] = heard
        return Heard(self._plant.process(played).T)

    def describe(self) -> Mapping[str, Any]:
        """Return what stands for API and driver."""
        return {"api": "virtual gripper", "inputs": 2}

    def close(self) -> None:
        """There is nothing to end."""


class VirtualTable:
    """Objects of a recipe, placed under the virtual gripper one after another.

    `seed` draws poses and nuisances; no grasp is one that the recipe records. Responses are kept in
    `folder`. Raises DataError for a recipe with sounds that are no response to what is played.
    """

    def __init__(self, recipe: Recipe, seed: int, folder: Path) -> None:
        self._recipe, self._seed = recipe, seed
        self._chain = chain_of("recipe: signal", recipe.signal)
        if self._chain.motor is not None:
            fix = "use a data set without"
            raise DataError("recipe.signal", "motor cannot be heard live", fix)
        if self._chain.level_db_spl is None:
            raise DataError("recipe.signal", "the speaker is silent", "use another data set")
        self._solver = ResponseStore(folder)
        self._plant = Plant(np.zeros(1), noise_floor(self._chain), derive_seed(seed, "noise"))

    def place(self, name: str, number: int, grasp_id: str) -> None:
        """Let `name` ("" for nothing) be grasped: `number` draws its pose, `grasp_id` the rest."""
        pose = derive_seed(self._seed, "pose", name, number)
        nuisance = derive_seed(self._seed, "grasp", name, grasp_id)
        try:
            setup = new_setup(self._recipe, name, pose, nuisance, (self._seed, NEW))
            response = self._solver.solve(scene_of(grasp_id, setup))
        except ValueError as error:
            raise DataError("objects", str(error), "correct its name") from None
        except SceneError as error:
            raise DataError(name, str(error), "correct the recipe") from None
        sound = scene_response(response, self._chain)
        self._plant.set_response(sound, scene_noise(response, self._chain))

    def card(self) -> SoundCard:
        """Return the sound card on which the gripper is heard."""
        settings = CardSettings(device=DEVICE, sample_rate_hz=SAMPLE_RATE_HZ, loopback_channel=2)
        return SoundCard(PlantLine(self._plant), settings)


class VirtualHands:
    """Robot that moves the virtual gripper, and with it another robot, if there is one.

    Nothing takes time by itself.
    """

    def __init__(self, table: VirtualTable, robot: Robot | None = None) -> None:
        self._table, self._robot = table, robot

    def approach(self, placement: Placement) -> float | None:
        """Press onto the object; return the force (N)."""
        force = self._robot.approach(placement) if self._robot else placement.force_n
        self._table.place(placement.object, placement.number, placement.grasp_id)
        return force

    def loosen(self) -> None:
        """Nothing of the virtual gripper outlasts a grasp."""
        self._also("loosen")

    def hold(self, seconds: float) -> None:
        """Virtual grains have settled."""
        self._also("hold", seconds)

    def jam(self) -> None:
        """Only the other robot moves."""
        self._also("jam")

    def lift(self) -> None:
        """Only the other robot moves."""
        self._also("lift")

    def release(self) -> None:
        """Only the other robot moves."""
        self._also("release")

    def place(self, bin: str) -> None:
        """Only the other robot moves."""
        self._also("place", bin)

    def halt(self, held: str) -> None:
        """Only the other robot moves."""
        self._also("halt", held)

    def _also(self, step: str, *about: Any) -> None:
        if self._robot:
            getattr(self._robot, step)(*about)
