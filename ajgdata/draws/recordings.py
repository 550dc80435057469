"""A gripper of some parameters -> the features of its recordings, in memory: nothing is kept.

Grasps, scenes, recordings and features are made by the code that makes the data sets.
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
from ajgdata.features.spectrum import frequencies_hz
from ajgdata.gripper.parameters import overrides
from ajgdata.gripper.scene import GRAINS
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


def recipe_with(
    recipe: Recipe, values: Mapping[str, float], name: str = "", seed: int | None = None
) -> Recipe:
    """Return the recipe of a gripper called `name` whose settings are `values`.

    What the recipe says itself stays. A support is changed only where there is one, and the
    packing of grains only in media that are packed as it says.
    """
    made = overrides(values)
    scene = {
        key: value
        for key, value in made.get("scene", {}).items()
        if key != "support" or "support" in recipe.scene
    }
    medium = scene.get("medium", {})
    variation = merged(made.get("variation", {}), recipe.variation or {})
    if name:
        variation = merged(variation, {"gripper": {"name": name}})
    changes: dict[str, Any] = {
        "scene": merged(scene, recipe.scene),
        "variants": {key: _of_medium(medium, one) for key, one in recipe.variants.items()},
        "signal": merged(made.get("signal", {}), recipe.signal),
        "variation": None if recipe.variation is None else variation,
    }
    if seed is not None:
        changes["seed"] = seed
    return recipe.model_copy(update=changes)


def _of_medium(medium: Mapping[str, Any], variant: Mapping[str, Any]) -> dict[str, Any]:
    """Return a variant, which replaces `scene.medium`, with what of `medium` holds in it, too."""
    given = variant.get("medium")
    if not isinstance(given, Mapping) or "kind" not in given:
        return dict(variant)
    spheres = GRAINS["plastic"][1]
    fits = GRAINS[str(given["kind"])][1] == spheres  # coffee is packed otherwise
    kept = {key: value for key, value in medium.items() if fits or key != "porosity"}
    kept.pop("grain_diameter_mm", None)
    return {**variant, "medium": {**kept, **given}}


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
    """Features of a data set's recordings, `rows` (n, f); `held` (n,) is the object, `variant`
    (n,) that of the scene. `noisy` has the same grasps under other noise, one recording each."""

    rows: TaskData
    held: np.ndarray
    variant: np.ndarray
    frequency_hz: np.ndarray
    noisy: TaskData | None
    scenes: int
    refused: int  #: grasps that cannot be made


def record_dataset(
    spec: DatasetSpec, recipe: Recipe, target: str, noisy_signal: Mapping[str, Any] | None = None
) -> Recorded:
    """Record every grasp of `recipe`, a version of that of `spec`, with the target's values.

    A grasp that cannot be made is left out. Raises NotPossibleError where an object, or a medium,
    has none: what is then read would not be the row any more.
    """
    solver = LastSolver()
    found: dict[str, list[Any]] = {key: [] for key in ("clean", "noisy")}
    refused = []
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
                refused.append(((grasp.object, _medium(grasp)), f"{grasp.object}: {error.problem}"))
    made = {(one[3], one[4]) for one in found["clean"]}
    if lost := [why for pair, why in refused if pair not in made]:
        raise NotPossibleError(f"{spec.name}: {lost[0]}")
    clean = list(zip(*found["clean"], strict=True))
    frequency = frequencies_hz(gripper.SAMPLE_RATE_HZ, spec.features)
    noisy = _rows(list(zip(*found["noisy"], strict=True))) if found["noisy"] else None
    return Recorded(
        _rows(clean), np.array(clean[3]), np.array(clean[4]), frequency, noisy, solver.solved,
        len(refused),
    )  # fmt: skip


def _takes(
    spec: DatasetSpec, source: VirtualGripper, grasp: Grasp, target: str, samples: int
) -> list[tuple[Any, ...]]:
    """Return feature, value, grasp, object and medium of each recording."""
    make = feature_maker(spec.features, source.sample_rate_hz, source.excitation())
    value = grasp.object if target == "object" else grasp.targets.get(target, "")
    about = (value, grasp.grasp_id, grasp.object, _medium(grasp))
    return [(make(source.take(grasp, sample).samples), *about) for sample in range(samples)]


def _medium(grasp: Grasp) -> str:
    return str(grasp.setup.get("medium", {}).get("kind", "plastic"))


def _rows(columns: Sequence[Sequence[Any]]) -> TaskData:
    names = np.array(columns[2])
    return TaskData(np.array(columns[0]), np.array(columns[1]), names, names)
