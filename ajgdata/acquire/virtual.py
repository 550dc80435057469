"""The virtual gripper as a source: every grasp is simulated once, every sample adds its noise."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from pydantic import ValidationError

from ajgdata import gripper
from ajgdata.acquire.source import Grasp, Take
from ajgdata.types import DataError, describe


class VirtualGripper:
    """Source of simulated recordings (see acquire.source.Source).

    `setup` is any grasp's setup of the session: gripper, medium and numerics are the same for all.
    """

    kind: Literal["virtual"] = "virtual"

    def __init__(self, setup: Mapping[str, Any]) -> None:
        self.sample_rate_hz: int = gripper.SAMPLE_RATE_HZ
        self._scene = scene_of("recipe", setup)
        self._sweep = gripper.excitation_sweep()
        self._solved: tuple[str, gripper.ImpulseResponse] | None = None

    def excitation(self) -> np.ndarray:
        """One-second logarithmic sweep, 20 Hz to 20 kHz."""
        return self._sweep

    def take(self, grasp: Grasp, sample: int) -> Take:
        """Simulate the grasp, unless it was the last one, and record one sample of it."""
        scene = scene_of(grasp.grasp_id, grasp.setup)
        if self._solved is None or self._solved[0] != grasp.digest:
            try:
                self._solved = (grasp.digest, gripper.simulate(scene))
            except gripper.SceneError as error:
                raise DataError(grasp.grasp_id, str(error), "correct the recipe") from None
        seed = gripper.derive_seed(scene.grasp.seed, "noise", sample)
        taken = gripper.record(self._solved[1], self._sweep, seed=seed)
        return Take(taken.samples, taken.clipped_count)

    def describe(self) -> Mapping[str, Any]:
        """What session.yaml keeps of this source."""
        scene = self._scene.model_dump(mode="json")
        return {
            "gripper": "virtual-default" if scene["gripper"] == _DEFAULT else "virtual-custom",
            "medium": self._scene.medium.kind,
            "device": "virtual gripper",
            "scene": {key: scene[key] for key in ("medium", "environment", "numerics")},
        }


_DEFAULT = gripper.Scene().gripper.model_dump(mode="json")


def scene_of(where: str, setup: Mapping[str, Any]) -> gripper.Scene:
    """The scene of a grasp's setup; DataError names `where`, key, value and fix."""
    try:
        return gripper.Scene.model_validate(setup)
    except ValidationError as error:
        raise describe(error, where) from None
