"""Fold values of the variants of an ablation: recordings as stored, or grasps simulated again."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from pydantic import JsonValue

from ajgdata.ablations import trial_table
from ajgdata.acquire.recipe import RecipeGrasp, plan_session, session_names
from ajgdata.acquire.virtual import VirtualGripper
from ajgdata.evaluate.crossval import Scores, cross_validate
from ajgdata.evaluate.splits import column_folds, random_folds
from ajgdata.evaluate.task_data import TaskData, split_withheld, task_data
from ajgdata.features.spectrum import spectrum, within
from ajgdata.gripper import SAMPLE_RATE_HZ
from ajgdata.gripper.scene import Nuisance
from ajgdata.gripper.variation import Variation
from ajgdata.paths import Paths
from ajgdata.store.features import read_store
from ajgdata.store.responses import ResponseStore
from ajgdata.store.sessions import overridden, read_dataset
from ajgdata.types import DatasetSpec, NotPossibleError, TaskSettings
from ajgdata.types.comparison import WITHHELD, Ablation, AblationVariant, Grasps, Grid
from ajgdata.types.table import Table, table_of

#: What is drawn anew for each grasp; the correlation lengths are no amounts.
NUISANCES = ("roughness_mm", "slope_deg", "packing", "force", "grain_force")


def nuisances(factor: float) -> dict[str, JsonValue]:
    """Return the scatter of grasps, `factor` times the default."""
    base = Nuisance(**Variation().nuisance({}))
    return {name: factor * getattr(base, name) for name in NUISANCES}


def measure(paths: Paths, name: str, ablation: Ablation, *, seed: int) -> Table:
    """Return the tests of an ablation's hypotheses.

    Raises NotPossibleError for data sets that lack what it asks for.
    """
    spec = read_dataset(paths, ablation.train)
    task = spec.task_settings(ablation.task)
    metric = "accuracy" if task.kind == "classification" else "rmse"
    folds: dict[str, dict[str, Sequence[float]]] = {model: {} for model in ablation.models}
    for variant_name, variant in ablation.variants.items():
        data = VariantData(paths, spec, ablation, variant)
        known, tests = data.recordings()
        for model, variants in folds.items():
            scores = _evaluated(variant, data.task, known, tests, variant.model or model, seed)
            for tested, result in scores.items():
                label = f"{variant_name} on:{tested}" if tested else variant_name
                variants[label] = result.per_fold[metric]
    return trial_table(name, ablation, folds, metric, task.unit if metric == "rmse" else "")


def measure_grid(paths: Paths, ablation: Ablation, grid: Grid, *, seed: int) -> Table:
    """Return the errors at withheld values for all pairs of values of a grid.

    Each grasp of the recipe is simulated with both changes and recorded once. The folds and the
    withheld values are those of the tasks.
    """
    from ajgdata.models import model_label

    spec = read_dataset(paths, grid.train)
    tasks = [spec.task_settings(name) for name in grid.tasks]
    rows = []
    for (x, x_scene), (series, series_scene) in product(
        grid.x.scenes.items(), grid.series.scenes.items()
    ):
        scene = overridden(overridden(dict(grid.scene), x_scene), series_scene)
        grasps = Grasps(sessions=grid.sessions, scene=scene)
        variant = AblationVariant(task=next(iter(grid.tasks)), grasps=grasps)
        data = VariantData(paths, spec, ablation, variant)
        simulated = data.changed(data.planned(grasps))
        for task, label in zip(tasks, grid.tasks.values(), strict=True):
            known, withheld = split_withheld(simulated, task.withhold)
            scores = _evaluated(variant, task, known, {WITHHELD: withheld}, grid.model, seed)
            errors = scores[WITHHELD].per_fold["rmse"]
            chance = scores[WITHHELD].chance["rmse"]
            rows.append(
                {
                    "task": label,
                    "x": x,
                    "series": series,
                    "error": float(np.mean(errors)),
                    "sd": float(np.std(errors, ddof=1)),
                    "chance": chance,
                }
            )
    unit = f" ({tasks[0].unit})"
    columns = {
        "task": "Task",
        "x": f"{grid.x.title} ({grid.x.unit})",
        "series": f"{grid.series.title} ({grid.series.unit})",
        "error": f"RMSE at withheld values, {model_label(grid.model, 'regression')}{unit}",
        "sd": "Standard deviation over folds",
        "chance": "Chance level",
    }
    return table_of(grid.name, grid.title, rows, grid.note, **columns)


def _evaluated(
    variant: AblationVariant,
    task: TaskSettings,
    known: TaskData,
    tests: Mapping[str, TaskData],
    model: str,
    seed: int,
) -> dict[str, Scores]:
    """Return the scores of a model on held-out grasps, by what is tested on ("": its own)."""
    is_grouped = variant.split == "grouped"
    if is_grouped:
        folds = column_folds(known.value, known.group, task.groups, task.kind, task.folds, seed)
    else:
        folds = random_folds(known.value, task.kind, task.folds, seed)
    result = cross_validate(
        known.feature,
        known.value,
        known.group if is_grouped else None,
        kind=task.kind,
        model=model,
        folds=folds,
        seed=seed,
        period=task.period_deg,
        extra_tests=tests if is_grouped else None,
    )
    return {"": result.scores} | {k: result.scores for k, result in result.extra_tests.items()}


@dataclass(frozen=True)
class VariantData:
    """Recordings of a variant of an ablation; `spec` is the data set that it trains on."""

    paths: Paths
    spec: DatasetSpec
    ablation: Ablation
    variant: AblationVariant

    @cached_property
    def task(self) -> TaskSettings:
        """Return the settings of the task that the variant evaluates."""
        return self.spec.task_settings(self.variant.task or self.ablation.task)

    def recordings(self) -> tuple[TaskData, dict[str, TaskData]]:
        """Return the recordings to train on, and those to test on as well."""
        if self.variant.grasps is not None:
            grasps = self.planned(self.variant.grasps)
            changed = self.variant.grasps.is_changed
            return (self.changed if changed else self.recorded)(grasps), {}
        withhold = self.task.withhold
        trained = [
            split_withheld(self._stored(name), withhold)
            for name in self.variant.train or (self.spec.name,)
        ]
        known, withheld = (_joined(parts) for parts in zip(*trained, strict=True))
        tests = {WITHHELD: withheld} if len(withhold) else {}
        for name in self.ablation.test:
            tests[name] = split_withheld(self._stored(name), withhold)[0]
        return known, tests

    def _stored(self, dataset: str) -> TaskData:
        """Return the recordings of a data set in the order of their names."""
        table, task = read_store(self.paths.features(dataset)), self.task
        rows = task_data(
            table,
            task.target,
            task.kind,
            task.groups,
            task.classes,
            task.placebo_objects,
        )
        rows = rows.where(np.argsort(rows.name))
        if self.ablation.exclude:
            rows = rows.where(~np.isin(rows.value, self.ablation.exclude))
        if self.variant.one_recording:
            rows = rows.where(np.sort(np.unique(rows.group, return_index=True)[1]))
        if self.variant.band_hz is None:
            return rows
        normalisation = read_dataset(self.paths, dataset).features.normalisation
        band = within(rows.feature, table.frequency_hz, self.variant.band_hz, normalisation)
        return rows._replace(feature=band[0])

    def planned(self, settings: Grasps) -> list[RecipeGrasp]:
        """Return grasps of the recipe, in the order of their names, which are those of the store.

        Raises NotPossibleError for a data set without a recipe.
        """
        spec = self.spec
        if spec.recipe is None:
            raise NotPossibleError(f"{spec.name} has no recipe: grasps cannot be simulated again")
        planned = [
            dataclasses.replace(grasp, grasp_id=f"{session}/{grasp.grasp_id}")
            for session in session_names(spec.recipe)[: settings.sessions]
            for grasp in _first(plan_session(spec.recipe, spec.name, session, ""), settings.each)
            if not set(map(str, grasp.targets.values())) & set(self.ablation.exclude)
        ]
        return sorted(planned, key=lambda grasp: grasp.grasp_id)

    def recorded(self, grasps: Sequence[RecipeGrasp]) -> TaskData:
        """Return the first recording of each of `grasps` as it is in the store, in their order."""
        rows = self._stored(self.spec.name)
        names, first = np.unique(rows.group, return_index=True)  # rows are in order of names
        place = dict(zip(names.tolist(), first.tolist(), strict=True))
        if missing := [g.grasp_id for g in grasps if g.grasp_id not in place]:
            raise NotPossibleError(f"there is no recording of grasp {missing[0]}")
        return rows.where(np.array([place[grasp.grasp_id] for grasp in grasps]))

    def changed(self, grasps: Sequence[RecipeGrasp]) -> TaskData:
        """Return the same grasps simulated with the variant's changes, each recorded once."""
        change, recipe, target = self.variant.grasps, self.spec.recipe, self.task.target
        assert recipe is not None and change is not None, "planned from them"
        solver, feature, value = ResponseStore(self.paths.responses), [], []
        # One for all: what is played is filtered once.
        source = VirtualGripper(grasps[0].setup, solver, recipe.signal, self.spec.excitation)
        for grasp in grasps:
            setup = changed_setup(grasp.setup, change, recipe.vary)
            take = source.take(dataclasses.replace(grasp, setup=setup), 0)
            feature.append(spectrum(take.samples, SAMPLE_RATE_HZ, self.spec.features))
            value.append(grasp.object if target == "object" else grasp.targets[target])
        names = np.array([grasp.grasp_id for grasp in grasps])
        return TaskData(np.array(feature), np.array(value), names, names)


def changed_setup(
    setup: Mapping[str, Any], change: Grasps, varied: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the setup of a grasp with a changed scene, scatter and pose; `varied` are pose keys
    of the recipe."""
    changes: dict[str, Any] = dict(change.scene)
    if change.scatter is not None:
        scatter = {"nuisance": nuisances(change.scatter)}
        changes["grasp"] = overridden(changes.get("grasp", {}), scatter)
    merged = overridden(dict(setup), changes)
    held = merged["grasp"]
    nearer = {key: change.pose * held[key] for key in (*varied, "placed_deg") if key in held}
    if change.scatter is not None and "temperature_k" in held:
        nearer["temperature_k"] = change.scatter * held["temperature_k"]
    if "placed_mm" in held:
        nearer["placed_mm"] = [change.pose * offset for offset in held["placed_mm"]]
    return {**merged, "grasp": {**held, **nearer}}


def _first(grasps: Sequence[RecipeGrasp], each: int | None) -> Iterator[RecipeGrasp]:
    """Yield the first `each` grasps of every object, or all."""
    seen: Counter[str] = Counter()
    for grasp in grasps:
        seen[grasp.object] += 1
        if each is None or seen[grasp.object] <= each:
            yield grasp


def _joined(parts: Sequence[TaskData]) -> TaskData:
    return TaskData(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
