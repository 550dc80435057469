"""Record a reduced data set in memory; no file is written.

The code that makes the data sets makes the grasps, scenes, recordings and features.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ajgdata import gripper
from ajgdata.acquire.recipe import plan_session, session_names
from ajgdata.acquire.source import Grasp, GraspError
from ajgdata.acquire.virtual import VirtualGripper
from ajgdata.evaluate.task_data import TaskData
from ajgdata.features.maker import feature_maker
from ajgdata.types import DatasetSpec, NotPossibleError, Recipe


def merged(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Return `base` with `over`, key by key at all depths; `over` wins.

    >>> merged({"a": {"b": 1, "c": 2}}, {"a": {"b": 3}})
    {'a': {'b': 3, 'c': 2}}
    """
    both = {
        key: merged(base[key], value)
        for key, value in over.items()
        if isinstance(base.get(key), Mapping) and isinstance(value, Mapping)
    }
    return {**base, **over, **both}


@dataclass
class LastSolver:
    """Solver (see acquire.solving) that keeps nothing but the last response."""

    solved: int = 0
    _last: tuple[str, gripper.ImpulseResponse] | None = field(default=None, repr=False)

    def expect(self, scenes: Sequence[gripper.Scene]) -> None:
        """Nothing is done ahead."""

    def solve(self, scene: gripper.Scene) -> gripper.ImpulseResponse:
        """Return the response of a scene. Raises gripper.SceneError."""
        scene = gripper.canonical(scene)
        digest = gripper.scene_digest(scene)
        if self._last is None or self._last[0] != digest:
            self.solved += 1
            self._last = digest, gripper.simulate(scene)
        return self._last[1]


@dataclass(frozen=True)
class Recorded:
    """Features of a data set's recordings, `rows` (n, f), and the number of scenes solved.
    `noisy` has the same grasps under other noise, one recording each."""

    rows: TaskData
    noisy: TaskData | None
    scenes: int


def record_dataset(
    spec: DatasetSpec, recipe: Recipe, target: str, noisy_signal: Mapping[str, Any] | None = None
) -> Recorded:
    """Record every grasp of `recipe`, a version of that of `spec`, with the target's values.

    Grasps that cannot be made are left out. Raises NotPossibleError if an object has none: the
    result would then not be that of the row.
    """
    solver = LastSolver()
    found: dict[str, list[tuple[Any, ...]]] = {key: [] for key in ("clean", "noisy")}
    refused: dict[str, str] = {}
    signals = {"clean": recipe.signal}
    if noisy_signal is not None:
        signals["noisy"] = merged(recipe.signal, noisy_signal)
    for session in session_names(recipe):
        grasps = plan_session(recipe, spec.name, session, "", spec.excitation)
        sources = {
            key: VirtualGripper(grasps[0].setup, solver, signal, spec.excitation)
            for key, signal in signals.items()
        }
        for grasp in grasps:
            try:
                for key, source in sources.items():
                    samples = grasp.samples if key == "clean" else 1
                    found[key] += _takes(spec, source, grasp, target, samples)
            except GraspError as error:
                refused.setdefault(grasp.object, error.problem)
    recorded = {one[3] for one in found["clean"]}
    for name, problem in refused.items():
        if name not in recorded:
            raise NotPossibleError(f"{spec.name}: {name}: {problem}")
    noisy = _rows(found["noisy"]) if found["noisy"] else None
    return Recorded(_rows(found["clean"]), noisy, solver.solved)


def _takes(
    spec: DatasetSpec, source: VirtualGripper, grasp: Grasp, target: str, samples: int
) -> list[tuple[Any, ...]]:
    """Return feature, value, grasp and object of each recording."""
    make = feature_maker(spec.features, source.sample_rate_hz, source.excitation())
    value = grasp.object if target == "object" else grasp.targets.get(target, "")
    about = (value, grasp.grasp_id, grasp.object)
    return [(make(source.take(grasp, sample).samples), *about) for sample in range(samples)]


def _rows(recordings: Sequence[tuple[Any, ...]]) -> TaskData:
    feature, value, grasp, _ = zip(*recordings, strict=True)
    return TaskData(np.array(feature), np.array(value), np.array(grasp), np.array(grasp))
