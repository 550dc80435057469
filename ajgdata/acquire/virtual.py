"""The virtual gripper as a source: every grasp is solved once, every sample adds its noise."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError

from ajgdata import gripper
from ajgdata.acquire.excitation import excitation_samples
from ajgdata.acquire.source import Grasp, GraspError, Take
from ajgdata.gripper.grippers import GRIPPERS, Gripper
from ajgdata.store.responses import ResponseStore
from ajgdata.types import DEFAULT_EXCITATION, ExcitationSpec, describe

#: What of a scene is the same for a session.
SHARED = ("gripper", "medium", "environment", "assembly", "session", "numerics")
Settings = TypeVar("Settings", bound=BaseModel)


class VirtualGripper:
    """Source of simulated recordings (see acquire.source.Source).

    `setup` is any grasp's setup of the session: gripper, medium and numerics are the same for all.
    `signal` is what of the signal chain differs from its defaults. Raises ValueError for an
    excitation that its rate cannot play.
    """

    kind: Literal["virtual"] = "virtual"

    def __init__(
        self,
        setup: Mapping[str, Any],
        solver: ResponseStore,
        signal: Mapping[str, Any] | None = None,
        played: ExcitationSpec = DEFAULT_EXCITATION,
    ) -> None:
        self.sample_rate_hz: int = gripper.SAMPLE_RATE_HZ
        self._scene = scene_of("recipe", setup)
        self._chain = chain_of("recipe: signal", signal or {})
        self._solver, self._before = solver, solver.solved
        self._played = played
        self._samples = excitation_samples(played, self.sample_rate_hz)
        self._solved: tuple[str, gripper.ImpulseResponse] | None = None

    @property
    def solved(self) -> int:
        """Scenes that had to be simulated since this source was made."""
        return self._solver.solved - self._before

    def excitation(self) -> np.ndarray | None:
        """Return the samples (n,) of what is declared; None of a silent speaker."""
        return None if self._chain.level_db_spl is None else self._samples

    def take(self, grasp: Grasp, sample: int) -> Take:
        """Solve the grasp, unless it was the last one, and record one sample of it."""
        (taken,) = self.record(grasp, sample, [self._samples])
        return taken

    def record(self, grasp: Grasp, sample: int, sounds: Sequence[np.ndarray]) -> list[Take]:
        """Return recordings (n,) of one sample of a grasp, one for each of `sounds` (n,).

        Each is what `take` returns where that sound is what is declared.
        """
        scene = scene_of(grasp.grasp_id, grasp.setup)
        if self._solved is None or self._solved[0] != grasp.digest:
            try:
                self._solved = (grasp.digest, self._solver.solve(scene))
            except gripper.SceneError as error:
                raise GraspError(grasp.grasp_id, str(error), "correct the recipe") from None
        seed = gripper.derive_seed(scene.grasp.seed, "noise", sample)
        angle = scene.grasp.angle_deg
        response = self._solved[1]
        taken = (gripper.record(response, sound, self._chain, seed, angle) for sound in sounds)
        return [Take(one.samples, one.clipped_count) for one in taken]

    def describe(self) -> Mapping[str, Any]:
        """Return what session.yaml keeps of this source."""
        scene = self._scene.model_dump(mode="json")
        kept = {key: scene[key] for key in SHARED}
        return {
            "gripper": f"virtual-{_variant(self._scene.gripper)}",
            "medium": self._scene.medium.kind,
            "device": "virtual gripper",
            "excitation": {
                "description": self._played.description,
                "settings": self._played.model_dump(mode="json"),
            },
            "scene": {**kept, "signal": self._chain.model_dump(mode="json")},
        }


@contextmanager
def open_virtual(folder: Path) -> Iterator[Callable[..., VirtualGripper]]:
    """Yield a function (setup, signal, excitation) -> VirtualGripper for each session
    (types.SourceMaker). Responses are kept in `folder`."""
    store = ResponseStore(folder)
    yield lambda setup, signal, played: VirtualGripper(setup, store, signal, played)


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
