"""The virtual gripper as a source: every grasp is solved once, every sample adds its noise."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError

from ajgdata import gripper
from ajgdata.acquire.solving import Solver, solving
from ajgdata.acquire.source import Grasp, GraspError, Take
from ajgdata.gripper.grippers import GRIPPERS, Gripper
from ajgdata.types import describe

Settings = TypeVar("Settings", bound=BaseModel)


class VirtualGripper:
    """Source of simulated recordings (see acquire.source.Source).

    `setup` is any grasp's setup of the session: gripper, medium and numerics are the same for all.
    `signal` is what of the signal chain differs from its defaults.
    """

    kind: Literal["virtual"] = "virtual"

    def __init__(
        self, setup: Mapping[str, Any], solver: Solver, signal: Mapping[str, Any] | None = None
    ) -> None:
        self.sample_rate_hz: int = gripper.SAMPLE_RATE_HZ
        self._scene = scene_of("recipe", setup)
        self._chain = chain_of("recipe: signal", signal or {})
        self._solver, self._before = solver, solver.solved
        self._sweep = gripper.excitation_sweep()
        self._solved: tuple[str, gripper.ImpulseResponse] | None = None

    @property
    def solved(self) -> int:
        """Scenes that had to be simulated since this source was made."""
        return self._solver.solved - self._before

    def excitation(self) -> np.ndarray | None:
        """Return a one-second logarithmic sweep (44100,), 20 Hz to 20 kHz; None of a silent
        speaker."""
        return None if self._chain.level_db_spl is None else self._sweep

    def expect(self, grasps: Sequence[Grasp]) -> None:
        """Let the solver work ahead."""
        self._solver.expect([scene_of(grasp.grasp_id, grasp.setup) for grasp in grasps])

    def take(self, grasp: Grasp, sample: int) -> Take:
        """Solve the grasp, unless it was the last one, and record one sample of it."""
        scene = scene_of(grasp.grasp_id, grasp.setup)
        if self._solved is None or self._solved[0] != grasp.digest:
            try:
                self._solved = (grasp.digest, self._solver.solve(scene))
            except gripper.SceneError as error:
                raise GraspError(grasp.grasp_id, str(error), "correct the recipe") from None
        seed = gripper.derive_seed(scene.grasp.seed, "noise", sample)
        angle = scene.grasp.angle_deg
        taken = gripper.record(self._solved[1], self._sweep, self._chain, seed, angle)
        return Take(taken.samples, taken.clipped_count)

    def describe(self) -> Mapping[str, Any]:
        """Return what session.yaml keeps of this source."""
        scene = self._scene.model_dump(mode="json")
        kept = {key: scene[key] for key in ("gripper", "medium", "environment", "numerics")}
        return {
            "gripper": f"virtual-{_variant(self._scene.gripper)}",
            "medium": self._scene.medium.kind,
            "device": "virtual gripper",
            "scene": {**kept, "signal": self._chain.model_dump(mode="json")},
        }


@contextmanager
def open_virtual(folder: Path, cores: int) -> Iterator[Callable[..., VirtualGripper]]:
    """Yield a function (setup, signal) -> VirtualGripper for each session (types.SourceMaker).

    Responses are kept in `folder`; `cores` processes solve scenes, and end with this one.
    """
    with solving(folder, cores) as solver:
        yield lambda setup, signal: VirtualGripper(setup, solver, signal)


def _variant(settings: Gripper) -> str:
    return next((name for name, known in GRIPPERS.items() if known == settings), "custom")


def scene_of(where: str, setup: Mapping[str, Any]) -> gripper.Scene:
    """Return the scene of a grasp's setup; DataError names `where`, key, value and fix."""
    return _validated(gripper.Scene, where, setup)


def chain_of(where: str, signal: Mapping[str, Any]) -> gripper.SignalChain:
    """Return the signal chain with the overrides `signal`; DataError as for `scene_of`."""
    return _validated(gripper.SignalChain, where, signal)


def _validated(kind: type[Settings], where: str, content: Mapping[str, Any]) -> Settings:
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        raise describe(error, where) from None
