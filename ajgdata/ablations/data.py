"""Data of ablations: grasps as they stand in the stores, and with a changed scene."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import JsonValue

from ajgdata.acquire.recipe import plan_session, session_names
from ajgdata.acquire.solving import SerialSolver
from ajgdata.acquire.source import Grasp
from ajgdata.acquire.virtual import VirtualGripper
from ajgdata.evaluate.task_data import TaskData, split_withheld, task_data
from ajgdata.gripper import SAMPLE_RATE_HZ, Scene, SignalChain
from ajgdata.gripper.scene import Nuisance
from ajgdata.gripper.variation import Variation
from ajgdata.paths import Paths
from ajgdata.store.features import Shard, read_store
from ajgdata.store.responses import ResponseStore
from ajgdata.store.sessions import read_dataset
from ajgdata.types import DatasetSpec, FeatureSettings, Kind, NotPossibleError, Recipe

if TYPE_CHECKING:
    from ajgdata.evaluate.crossval import CrossValidation
    from ajgdata.gripper import ImpulseResponse

FOLDS = 5
#: What is drawn anew for each grasp; the correlation lengths are no amounts.
NUISANCES = ("roughness_mm", "slope_deg", "packing", "force", "grain_force", "temperature_k")
QUIET = SignalChain(noise_db_spl=None)


def nuisances(factor: float, only: Sequence[str] = NUISANCES) -> dict[str, JsonValue]:
    """Return the scatter of grasps, `factor` times the default; nothing but `only` scatters."""
    base = Nuisance(**Variation().nuisance({}))
    return {name: factor * getattr(base, name) * (name in only) for name in NUISANCES}


@dataclass(frozen=True)
class AblationData:
    """Grasps of a project, the same ones changed, and models on both."""

    paths: Paths
    seed: int = 0
    quick: bool = False

    @property
    def models(self) -> tuple[str, ...]:
        """Return the models that most trials are made with."""
        return ("linear_plain",) if self.quick else ("cnn", "linear_plain")

    def grasps(self, dataset: str, sessions: int = 1, each: int | None = None) -> list[Grasp]:
        """Return the first grasps of the first `sessions` of the recipe, in order of their names.

        `each` of an object (default: all), named as in the store. Raises ValueError for a data set
        without a recipe.
        """
        recipe = _recipe(read_dataset(self.paths, dataset))
        planned = [
            dataclasses.replace(grasp, grasp_id=f"{session}/{grasp.grasp_id}")
            for session in session_names(recipe)[: 1 if self.quick else sessions]
            for grasp in _first(plan_session(recipe, dataset, session, ""), each)
        ]
        return sorted(planned, key=lambda grasp: grasp.grasp_id)

    def recorded(self, dataset: str, task: str, grasps: Sequence[Grasp]) -> TaskData:
        """Return the first recording of each of `grasps` as it is in the store, in their order.

        `feature` (n, 1025), `value` (n,). Raises ValueError for a grasp that is not there.
        """
        rows = self._stored(dataset, task)
        names, first = np.unique(rows.group, return_index=True)  # rows are in order of names
        place = dict(zip(names.tolist(), first.tolist(), strict=True))
        if missing := [g.grasp_id for g in grasps if g.grasp_id not in place]:
            raise NotPossibleError(f"{dataset} has no recording of grasp {missing[0]}")
        return rows.where(np.array([place[grasp.grasp_id] for grasp in grasps]))

    def store(self, dataset: str) -> Shard:
        """Return the store of a data set, all of it."""
        return read_store(self.paths.features(dataset))

    def known(self, dataset: str, task: str, elsewhere: str | None = None) -> TaskData:
        """Return every recording of a value that the task does not withhold from training.

        `elsewhere`: of another data set, which has the same target.
        """
        return self.parts(dataset, task, elsewhere)[0]

    def parts(
        self, dataset: str, task: str, elsewhere: str | None = None
    ) -> tuple[TaskData, TaskData]:
        """Return the recordings of training values, and those of withheld values (see `known`)."""
        withhold = read_dataset(self.paths, dataset).tasks[task].withhold
        return split_withheld(self._stored(dataset, task, elsewhere), withhold)

    def labels(self, dataset: str) -> list[Mapping[str, float | str]]:
        """Return the labels of each object of the recipe."""
        recipe = _recipe(read_dataset(self.paths, dataset))
        return [made.targets for made in recipe.objects]

    def _stored(self, dataset: str, task: str, elsewhere: str | None = None) -> TaskData:
        spec = read_dataset(self.paths, dataset)
        target, classes = spec.tasks[task].target, spec.tasks[task].classes
        store = self.store(elsewhere or dataset)
        rows = task_data(store, target, spec.targets[target].kind, "grasp_id", classes)
        return rows.where(np.argsort(rows.name))

    def changed(
        self,
        dataset: str,
        task: str,
        grasps: Sequence[Grasp],
        scene: Mapping[str, JsonValue],
        pose: float = 1.0,
    ) -> TaskData:
        """Return the same grasps simulated with `scene` over their setup, each recorded once.

        `feature` (n, 1025), `value` (n,). What the recipe varies of the pose, and the error of each
        placement, is multiplied by `pose`. Raises ValueError for a data set without a recipe.
        """
        from ajgdata.features.spectrum import spectrum

        spec = read_dataset(self.paths, dataset)
        recipe, target = _recipe(spec), spec.tasks[task].target
        solver, feature, value = SerialSolver(self.paths.responses), [], []
        # One for all: what is played is filtered once.
        source = VirtualGripper(grasps[0].setup, solver, recipe.signal, spec.excitation)
        for grasp in grasps:
            setup = _over(grasp.setup, scene)
            held = setup["grasp"]
            nearer = {key: pose * held[key] for key in (*recipe.vary, "placed_deg") if key in held}
            if "placed_mm" in held:
                nearer["placed_mm"] = [pose * one for one in held["placed_mm"]]
            setup["grasp"] = {**held, **nearer}
            take = source.take(dataclasses.replace(grasp, setup=setup), 0)
            feature.append(spectrum(take.samples, SAMPLE_RATE_HZ, spec.features))
            value.append(grasp.object if target == "object" else grasp.targets[target])
        names = np.array([grasp.grasp_id for grasp in grasps])
        return TaskData(np.array(feature), np.array(value), names, names)

    def response(self, setup: Mapping[str, Any]) -> ImpulseResponse:
        """Return the kept response of a scene, or a new one."""
        return ResponseStore(self.paths.responses).solve(Scene.model_validate(setup))

    def heard(self, setup: Mapping[str, Any], grasp: Mapping[str, Any]) -> np.ndarray:
        """Return the feature (1025,) of a scene recorded without noise, held as in `grasp`."""
        from ajgdata.features.spectrum import spectrum
        from ajgdata.gripper import excitation_sweep, record

        take = record(self.response({**setup, "grasp": grasp}), excitation_sweep(), QUIET)
        return spectrum(take.samples, SAMPLE_RATE_HZ, FeatureSettings()).astype(float)

    def validated(
        self,
        rows: TaskData,
        kind: Kind,
        model: str,
        *,
        period: float | None = None,
        random: bool = False,
        extra_tests: Mapping[str, TaskData] | None = None,
    ) -> CrossValidation:
        """Return a cross-validation, by grasps unless `random`, tested on `extra_tests`, too."""
        from ajgdata.evaluate.crossval import ExtraTestSet, cross_validate

        tests = {
            n: ExtraTestSet(r.feature, r.value, r.group) for n, r in (extra_tests or {}).items()
        }
        return cross_validate(
            rows.feature, rows.value, None if random else rows.group,
            kind=kind, model=model, folds=FOLDS, seed=self.seed, period=period, extra_tests=tests,
        )  # fmt: skip


def _first(grasps: Sequence[Grasp], each: int | None) -> list[Grasp]:
    """Return the first `each` grasps of every object, or all."""
    seen: Counter[str] = Counter()
    first = []
    for grasp in grasps:
        seen[grasp.object] += 1
        if each is None or seen[grasp.object] <= each:
            first.append(grasp)
    return first


def _recipe(spec: DatasetSpec) -> Recipe:
    if spec.recipe is None:
        raise NotPossibleError(f"{spec.name} has no recipe: only simulated grasps can be changed")
    return spec.recipe


def _over(setup: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return `setup` with `changes`, key by key; a part that is given by name is replaced."""
    parts = {
        key: _over(setup[key], value)
        for key, value in changes.items()
        if key in setup and isinstance(value, dict) and isinstance(setup[key], dict)
    }
    return {**setup, **changes, **parts}
