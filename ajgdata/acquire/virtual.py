"""The virtual gripper: it records the grasps of a recipe, or acts as robot and sound card.

Every grasp is simulated once, and every recording of it adds its own noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata import gripper
from ajgdata.acquire.card import DEVICE, Capture, CardSettings, Sound
from ajgdata.acquire.excitation import played_samples
from ajgdata.acquire.recipe import NEW, RecipeGrasp, new_setup
from ajgdata.acquire.robot import NOTHING_MEASURED, Measured, Robot
from ajgdata.acquire.robot_numbers import FORCE
from ajgdata.acquire.sound_card import SoundCard
from ajgdata.gripper.grippers import GRIPPERS
from ajgdata.store.responses import ResponseStore
from ajgdata.types import (
    DEFAULT_EXCITATION,
    DataError,
    ExcitationSpec,
    PassiveRecording,
    Recipe,
    checked,
)

#: Keys of a scene that are equal for all grasps of a session.
SESSION_KEYS = ("gripper", "medium", "environment", "assembly", "session", "numerics")


class GraspError(DataError):
    """One grasp cannot be simulated."""


class VirtualGripper:
    """Source of simulated recordings of one session.

    `setup` is the setup of any grasp of the session, because SESSION_KEYS are equal for all.
    `signal` are settings of the signal chain that differ from the defaults. `project` is the folder
    to which the path of a sound file is relative. Raises ValueError for an excitation that cannot
    be played at the sample rate, and DataError for a file that cannot be played.
    """

    def __init__(
        self,
        setup: Mapping[str, Any],
        solver: ResponseStore,
        signal: Mapping[str, Any] | None = None,
        played: ExcitationSpec = DEFAULT_EXCITATION,
        project: Path = Path(),
    ) -> None:
        self.sample_rate_hz: int = gripper.SAMPLE_RATE_HZ
        self._scene = checked(gripper.Scene, "recipe", setup)
        self._chain = checked(gripper.SignalChain, "recipe: signal", signal or {})
        self._solver = solver
        self._solved_before = solver.solved
        self._played = played
        self._samples = played_samples(played, self.sample_rate_hz, project)
        #: Digest and impulse response of the last grasp.
        self._response: tuple[str, gripper.ImpulseResponse] | None = None

    @property
    def solved(self) -> int:
        """Number of scenes that this source simulated."""
        return self._solver.solved - self._solved_before

    def excitation(self) -> np.ndarray | None:
        """Return the played samples (n,); None for a silent speaker."""
        return None if self._chain.level_db_spl is None else self._samples

    def take(self, grasp: RecipeGrasp, sample: int) -> gripper.SimulatedRecording:
        """Return one recording of a grasp. Raises GraspError for an impossible scene."""
        return self.record(grasp, sample, [self._samples])[0]

    def record(
        self, grasp: RecipeGrasp, sample: int, sounds: Sequence[np.ndarray]
    ) -> list[gripper.SimulatedRecording]:
        """Return recordings (n,) of one sample of a grasp, one for each of `sounds` (n,)."""
        scene = checked(gripper.Scene, grasp.grasp_id, grasp.setup)
        if self._response is None or self._response[0] != grasp.digest:
            try:
                self._response = (grasp.digest, self._solver.solve(scene))
            except gripper.SceneError as error:
                raise GraspError(grasp.grasp_id, str(error), "correct the recipe") from None
        seed = gripper.derive_seed(scene.grasp.seed, "noise", sample)
        angle = scene.grasp.angle_deg
        response = self._response[1]
        return [gripper.record(response, sound, self._chain, seed, angle) for sound in sounds]

    def describe(self) -> Mapping[str, Any]:
        """Return the keys of session.yaml that describe this source."""
        scene = self._scene.model_dump(mode="json")
        shared = {key: scene[key] for key in SESSION_KEYS}
        names = (name for name, known in GRIPPERS.items() if known == self._scene.gripper)
        return {
            "gripper": f"virtual-{next(names, 'custom')}",
            "medium": self._scene.medium.kind,
            "device": DEVICE,
            "excitation": {
                "description": self._played.description,
                "settings": self._played.model_dump(mode="json"),
            },
            "scene": {**shared, "signal": self._chain.model_dump(mode="json")},
        }


class VirtualTable:
    """The virtual gripper over the objects of a recipe, as a robot and a sound card.

    `seed` draws poses, nuisances and noise, which differ from those of the recipe. Responses are
    cached in `folder`. A given `robot` makes the same steps. Raises DataError for a recipe with a
    silent speaker.
    """

    def __init__(self, recipe: Recipe, seed: int, folder: Path, robot: Robot | None = None) -> None:
        self._recipe = recipe
        self._seed = seed
        self._robot = robot
        self._chain = checked(gripper.SignalChain, "recipe: signal", recipe.signal)
        if self._chain.level_db_spl is None:
            raise DataError("recipe.signal", "the speaker is silent", "use another data set")
        self._solver = ResponseStore(folder)
        self._response: gripper.ImpulseResponse | None = None
        self._angle_deg = 0.0
        self._takes = 0
        self.settings = CardSettings(device=DEVICE, sample_rate_hz=gripper.SAMPLE_RATE_HZ)

    def move(self, step: str, **about: Any) -> Measured:
        """Make a step of a robot (see acquire.robot); only `approach` changes the response."""
        measured = self._robot.move(step, **about) if self._robot else NOTHING_MEASURED
        if step != "approach":
            return measured
        self.place(about["object"], about["number"], about["grasp_id"])
        return measured if self._robot else {FORCE: float(about["force_n"])}

    def place(self, name: str, number: int, grasp_id: str) -> None:
        """Grasp the object `name` ("": none). `number` draws the pose, `grasp_id` the nuisances."""
        pose = gripper.derive_seed(self._seed, "pose", name, number)
        nuisance = gripper.derive_seed(self._seed, "grasp", name, grasp_id)
        try:
            setup = new_setup(self._recipe, name, pose, nuisance, (self._seed, NEW))
            scene = checked(gripper.Scene, grasp_id, setup)
            self._response = self._solver.solve(scene)
        except ValueError as error:
            raise DataError("objects", str(error), "correct its name") from None
        except gripper.SceneError as error:
            raise DataError(name, str(error), "correct the recipe") from None
        self._angle_deg = scene.grasp.angle_deg

    def resume(self, latency_samples: int | None) -> None:
        """Do nothing: there is no latency."""

    def take(self, played: Sound, tail: int = 0) -> Capture:
        """Play `played` (n,) once and return n + `tail` samples.

        Before the first step of the robot, the gripper is empty. Raises DataError without a sound.
        """
        if isinstance(played, PassiveRecording):
            fix = "use another kind of excitation, or a sound card"
            raise DataError("virtual gripper", "it records only a played sound", fix)
        if self._response is None:
            self.place("", 1, "empty")
        assert self._response is not None
        self._takes += 1
        sound = np.concatenate([played, np.zeros(tail)])
        seed = gripper.derive_seed(self._seed, "noise", self._takes)
        recorded = gripper.record(self._response, sound, self._chain, seed, self._angle_deg)
        return Capture.measured(
            recorded.samples.astype(np.float32),
            latency_samples=0,
            arrival_samples=0,
            clipped=recorded.clipped_count,
            xruns=0,
            time=datetime.now(UTC).isoformat(timespec="milliseconds"),
        )

    def describe(self) -> Mapping[str, Any]:
        """Return the settings, and the simulated API."""
        return {**self.settings.model_dump(mode="json"), "api": DEVICE, "latency_samples": 0}

    def close(self) -> None:
        """Do nothing: no device is open."""


#: A real or simulated sound card.
Card = SoundCard | VirtualTable
