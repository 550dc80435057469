"""Recordings of the variants of an evaluation: stored features, or features computed for them."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from itertools import repeat
from typing import Any, NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from ajgdata.acquire.excitation import excitation_samples
from ajgdata.acquire.recipe import RecipeGrasp
from ajgdata.evaluate.parts import WITHHELD, elsewhere
from ajgdata.evaluate.task_data import TaskData, split_withheld
from ajgdata.experiments.base import Inputs
from ajgdata.features.compute import FeatureComputer
from ajgdata.features.spectrum import within
from ajgdata.types import FeatureSettings, NotPossibleError
from ajgdata.types.variants import ChosenGrasps, NamedVariant, Variant, Variants

#: Metric of the cost of features.
FEATURE_S = "feature_s_per_recording"


class VariantData(NamedTuple):
    """Recordings to train on, and those to test on as well, by part (see `evaluate.parts`)."""

    known: TaskData
    tests: dict[str, TaskData]


class ComputedFeatures(NamedTuple):
    """Features (n, bins) of named recordings, and the median CPU time (s) of one."""

    feature: dict[str, np.ndarray]
    seconds: float

    def of(self, data: TaskData) -> TaskData:
        """Return recordings with these features."""
        return data._replace(feature=np.array([self.feature[name] for name in data.name]))


@dataclass(frozen=True)
class VariantRecordings:
    """Recordings of all variants of a file, for the task of `inputs`."""

    inputs: Inputs
    file: Variants
    #: Features (n, bins) of simulated grasps, by change: several variants can share them.
    simulated: dict[str, np.ndarray] = field(default_factory=dict)

    def data(self, variant: NamedVariant) -> VariantData:
        """Return the recordings of a variant.

        Raises NotPossibleError if the data sets lack what it needs.
        """
        inputs = self.inputs_of(variant.change)
        withhold = inputs.task_settings.withhold
        if variant.change.grasps is not None:
            chosen = variant.change.grasps
            rows = self._grasps(inputs, chosen)
            if chosen.all_values or not withhold:
                return VariantData(rows, {})
            known, withheld = split_withheld(rows, withhold)
            return VariantData(known, {WITHHELD: withheld})
        names = self.file.trained_on(variant.change)
        known, withheld = _joined(
            split_withheld(self._stored(inputs, variant, name), withhold) for name in names
        )
        tests = {WITHHELD: withheld} if withhold else {}
        for name in self.file.test:
            if names != (name,):  # its held-out grasps are tested already
                rows = self._stored(inputs, variant, name)
                tests[elsewhere(name)] = split_withheld(rows, withhold)[0]
        return VariantData(known, tests)

    def inputs_of(self, change: Variant) -> Inputs:
        """Return the inputs with the task that a variant evaluates."""
        if change.task in (None, self.inputs.task):
            return self.inputs
        settings = self.inputs.other_tasks[str(change.task)]
        if settings.augment is not None:
            raise NotPossibleError(f"variants have no copies of recordings: {change.task} has them")
        if settings.balance:
            raise NotPossibleError(f"variants do not balance classes, as {change.task} requests")
        if settings.covariates:
            raise NotPossibleError(f"variants have no covariates: {change.task} has them")
        return replace(self.inputs, task_settings=settings)

    def feature_s(self, variant: NamedVariant) -> float:
        """Return the median CPU time (s) of a feature of the data set; NaN for stored features."""
        if not self._is_computed(variant.change):
            return float("nan")
        return self._computed[self.inputs.dataset][variant.name].seconds

    def _is_computed(self, change: Variant) -> bool:
        """Return whether the features of a variant are computed from recordings.

        The reference of a file is computed if another variant is, so that their costs compare.
        """
        is_stored = (
            change.grasps is not None or change.bins_hz is not None or change.task is not None
        )
        return self.file.is_computed and not is_stored

    def _stored(self, inputs: Inputs, variant: NamedVariant, dataset: str) -> TaskData:
        """Return the recordings of a data set, with the features of a variant."""
        rows = inputs.all_data(dataset)
        change = variant.change
        if self._is_computed(change):
            rows = self._computed[dataset][variant.name].of(rows)
        if self.file.exclude:
            rows = rows.where(~np.isin(rows.value, self.file.exclude))
        if change.one_recording:
            rows = rows.where(np.sort(np.unique(rows.group, return_index=True)[1]))
        if change.bins_hz is not None:
            rows = rows._replace(feature=self._bins(rows.feature, change.bins_hz))
        return rows

    def _bins(self, feature: np.ndarray, bins_hz: tuple[float, float]) -> np.ndarray:
        """Return the bins of features (n, f) in a band, normalised again."""
        store = self.inputs.store
        features = self.inputs.features
        if not (isinstance(features, FeatureSettings) and store.has_bins_only):
            raise NotPossibleError("bins_hz needs the spectra of one microphone")
        return within(feature, store.frequency_hz, bins_hz, features.normalisation)[0]

    # Grasps of the recipe

    def _grasps(self, inputs: Inputs, chosen: ChosenGrasps) -> TaskData:
        """Return the first recordings of planned grasps: as stored, or simulated with a change."""
        if inputs.grasps is None:
            raise NotPossibleError(
                f"{inputs.dataset} has no recipe: grasps cannot be simulated again"
            )
        excluded = set(self.file.exclude)
        grasps = [
            grasp
            for grasp in inputs.grasps.planned(chosen)
            if excluded.isdisjoint(map(str, grasp.targets.values()))
        ]
        if chosen.is_changed:
            return self._simulated(inputs, grasps, chosen)
        return _recorded(inputs.all_data(), grasps)

    def _simulated(
        self, inputs: Inputs, grasps: Sequence[RecipeGrasp], chosen: ChosenGrasps
    ) -> TaskData:
        """Return grasps simulated with a change, each recorded once."""
        key = chosen.model_dump_json()
        if key not in self.simulated:
            assert inputs.grasps is not None, "planned from it"
            compute = self._computer(Variant())
            if compute.needs_played:
                raise NotPossibleError(
                    f"simulated grasps have no features of the kind {inputs.features.kind}, which "
                    "need the played sound"
                )
            recordings = inputs.grasps.recordings(grasps, chosen)
            self.simulated[key] = np.array(
                [compute(samples).values.ravel() for samples in recordings]
            )
        target = inputs.task_settings.target
        value = [grasp.object if target == "object" else grasp.targets[target] for grasp in grasps]
        names = np.array([grasp.grasp_id for grasp in grasps])
        return TaskData(self.simulated[key], np.array(value), names, names)

    # Features that are computed from recordings

    @cached_property
    def _computed(self) -> dict[str, dict[str, ComputedFeatures]]:
        """Features of each data set, by name of the variant; each recording is read once."""
        own = self.inputs.dataset
        names = dict.fromkeys((own, *self.file.test_sets, *self.file.train_sets))
        with threadpool_limits(limits=1):
            return {name: self._features(name) for name in names}

    def _features(self, dataset: str) -> dict[str, ComputedFeatures]:
        """Return the features of a data set by variant.

        Raises NotPossibleError for a sound, or a recording, that does not allow one of them.
        """
        inputs = self.inputs
        variants = [v for v in self.file.all_variants if self._is_computed(v.change)]
        computers = [self._computer(variant.change) for variant in variants]
        names = inputs.all_data(dataset).name.tolist()
        features: list[dict[str, np.ndarray]] = [{} for _ in variants]
        seconds: list[list[float]] = [[] for _ in variants]
        sounds = self._samples([variant.change for variant in variants], dataset, names)
        played = [
            excitation_samples(variant.change.played(), inputs.audio.sample_rate_hz)
            if computer.needs_played and variant.change.excitation
            else None
            for variant, computer in zip(variants, computers, strict=True)
        ]
        for name, recordings in zip(names, sounds, strict=True):
            for at, samples in enumerate(recordings):
                reference = played[at]
                if computers[at].needs_played and reference is None:
                    assert inputs.recordings is not None, "its samples are read"
                    reference = inputs.recordings.played(dataset, name)
                begun = time.process_time()
                feature = computers[at](samples, reference)
                seconds[at].append(time.process_time() - begun)
                features[at][name] = feature.values.ravel()
        return {
            variant.name: ComputedFeatures(features[at], float(np.median(seconds[at])))
            for at, variant in enumerate(variants)
        }

    def _computer(self, change: Variant) -> FeatureComputer:
        """Return the computation of the features of a variant."""
        settings = change.feature_settings(self.inputs.features)
        return FeatureComputer(self.inputs.audio, settings, self.inputs.folder)

    def _samples(
        self, variants: Sequence[Variant], dataset: str, names: Sequence[str]
    ) -> Iterator[list[np.ndarray]]:
        """Yield for each recording of `names` the samples (n,) of every variant.

        Variants with a sound are simulated with it; the others are the recording itself.
        """
        inputs = self.inputs
        with_sound = [variant for variant in variants if variant.excitation]
        without = [variant for variant in variants if not variant.excitation]
        rendered = _rendered(inputs, with_sound, names) if with_sound else repeat(())
        recorded: Iterable[Any] = repeat(None)
        if without:
            if inputs.recordings is None:
                raise NotPossibleError("the recordings themselves are needed")
            least_samples = max(self._computer(variant).least_samples for variant in without)
            recorded = inputs.recordings.samples(dataset, names, least_samples)
        for own, sounds in zip(recorded, rendered, strict=False):
            simulated = iter(sounds)
            yield [next(simulated).astype(np.float32) if v.excitation else own for v in variants]


def _rendered(
    inputs: Inputs, variants: Sequence[Variant], names: Sequence[str]
) -> Iterable[Sequence[np.ndarray]]:
    """Return for each simulated recording its samples with the sound of each variant."""
    if inputs.render is None:
        raise NotPossibleError("it needs a virtual data set: other sounds are played in its scenes")
    rate = inputs.audio.sample_rate_hz
    try:
        sounds = [excitation_samples(variant.played(), rate) for variant in variants]
    except ValueError as error:  # beyond half the rate of the recordings
        raise NotPossibleError(str(error)) from None
    return inputs.render(names, sounds)


def _recorded(rows: TaskData, grasps: Sequence[RecipeGrasp]) -> TaskData:
    """Return the first stored recording of each of `grasps`, in their order."""
    names, first = np.unique(rows.group, return_index=True)
    place = dict(zip(names.tolist(), first.tolist(), strict=True))
    for grasp in grasps:
        if grasp.grasp_id not in place:
            raise NotPossibleError(f"there is no recording of grasp {grasp.grasp_id}")
    return rows.where(np.array([place[grasp.grasp_id] for grasp in grasps]))


def _joined(parts: Iterable[tuple[TaskData, TaskData]]) -> tuple[TaskData, TaskData]:
    """Return the known and the withheld recordings of several data sets, each together."""
    known, withheld = zip(*parts, strict=True)
    return reduce(TaskData.joined, known), reduce(TaskData.joined, withheld)
