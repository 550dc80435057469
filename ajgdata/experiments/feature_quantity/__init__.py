"""Quantities of the feature: which of them lets noise from outside in, and what each takes.

`measure` makes the tables; `shown` reads them back and tells, `drawing` draws.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Literal

import numpy as np
from pydantic import Field, ValidationError

from ajgdata.evaluate.task_data import TaskData
from ajgdata.experiments.base import (
    Experiment,
    Inputs,
    Outcome,
    Recordings,
    fold_scores,
    score_table,
)
from ajgdata.experiments.feature_quantity.shown import figures, tables
from ajgdata.report.format import number
from ajgdata.types import FeatureSettings, Kind, ModelName, Name, NotPossibleError, Strict
from ajgdata.types.table import Table, table_of

#: Recordings held at once, and transformed with one setting after the other: the times of all
#: settings are then of the same moments.
BLOCK = 64
COLUMNS = {"part": "Feature", "label": "Name", "kind": "Kind", "quantity": "Quantity",
           "decay_s": "Decay, s"}  # fmt: skip
MOVED = {"part": "Feature", "dataset": "Tested on", "moved": "Moved by noise"}


class FeatureChange(Strict):
    """A difference from the data set's own feature settings."""

    kind: Literal["stft", "sweep_tracking", "transfer_function"] | None = Field(
        None, description="of feature"
    )
    quantity: Literal["magnitude", "power", "root_power"] | None = Field(
        None, description="what is summed over time"
    )
    decay_s: float | None = Field(None, ge=0, le=1, description="of sweep_tracking")


#: Tracked with the default decay time, and with the ends of the range that it is the middle of.
TRIED = (
    FeatureChange(quantity="power"),
    FeatureChange(quantity="root_power"),
    FeatureChange(kind="sweep_tracking"),
    FeatureChange(kind="sweep_tracking", decay_s=0.01),
    FeatureChange(kind="sweep_tracking", decay_s=0.25),
    FeatureChange(kind="transfer_function"),
)


class Settings(Strict):
    """Error under noise, and run time, by what the feature sums: of the same recordings."""

    features: tuple[FeatureChange, ...] = Field(
        TRIED, min_length=1, description="what is tried beside the data set's own settings"
    )
    models: tuple[ModelName, ...] = Field(
        ("cnn", "ridge_plain"), min_length=1, description="models that are evaluated with each"
    )
    test_on: tuple[Name, ...] = Field(
        (), description="data sets that the models are tested on as well, e.g. the same under noise"
    )


def variants(settings: Settings, own: FeatureSettings) -> list[FeatureSettings]:
    """Return the feature settings that are compared, the data set's own first."""
    changes = [one.model_dump(exclude_none=True) for one in settings.features]
    return [FeatureSettings(**(own.model_dump() | change)) for change in ({}, *changes)]


def check(settings: Settings, _: Kind, features: FeatureSettings) -> None:
    """Raise ValueError for settings that no feature can have, and for one that is tried twice."""
    try:
        tried = variants(settings, features)
    except ValidationError as error:
        message = error.errors()[0]["msg"].removeprefix("Value error, ")
        raise ValueError(f"feature_quantity.features: {message}") from None
    if len(set(map(label_of, tried))) < len(tried):
        raise ValueError("feature_quantity.features: one is tried twice, or is the data set's own")
    if features.align:
        raise ValueError("feature_quantity needs recordings as they are: no features.align")


def label_of(one: FeatureSettings) -> str:
    """Return what a feature is, in a few words: `sum of powers`."""
    if one.kind == "transfer_function":
        return "transfer function" + (", squared" if one.quantity == "power" else "")
    what = one.quantity.replace("root_power", "power") + "s"
    root = "root of " if one.quantity == "root_power" else ""
    if one.kind == "sweep_tracking":
        return f"{root}{what} where the sweep is, + {number(1e3 * one.decay_s)} ms"
    return f"{root}sum of {what}"


def measure(inputs: Inputs, settings: Settings, _: str) -> Outcome:
    """Return errors of the models with each feature, at home and elsewhere, and run times.

    Each recording is read once. The same folds serve all features; of a grasp that two data sets
    share, only the fold that holds it out predicts. Times are processor time of one thread, the
    median over recordings of the data set.
    """
    from threadpoolctl import threadpool_limits

    from ajgdata.evaluate.crossval import ExtraTestSet, cross_validate

    tried = variants(settings, inputs.features)
    data = {name: inputs.data(name) for name in ("", *settings.test_on)}
    with threadpool_limits(limits=1):
        made = {name: features_of(inputs, name, data[name], tried) for name in data}
    scores, costs = [], []
    for n, one in enumerate(tried):
        part, own = _part(one), data[""]
        extra = {
            name: ExtraTestSet(made[name][n][0], data[name].value, data[name].group)
            for name in settings.test_on
        }
        for model in settings.models:
            found = cross_validate(
                made[""][n][0], own.value, own.group, model=model, extra_tests=extra, **inputs.split
            )
            scores += list(fold_scores(model, part, found.scores))
            for name, tested in found.extra_tests.items():
                scores += list(fold_scores(model, f"{part} on:{name}", tested.scores))
            times = {"feature_s_per_recording": made[""][n][1], "train_s": found.cost.train_s}
            costs += [(model, f"cost of {part}", name, "measured", s) for name, s in times.items()]
    title = "Quantities of the feature"
    listed = [{"part": _part(one), "label": label_of(one), "kind": one.kind,
               "quantity": one.quantity, "decay_s": one.decay_s} for one in tried]  # fmt: skip
    tables = (
        score_table(scores, title),
        table_of("features", title, listed, **COLUMNS),
        _moved_table(tried, data, made),
    )
    return Outcome(tables, (score_table(costs, title),))


def _part(one: FeatureSettings) -> str:
    decay = f" {one.decay_s:g} s" if one.kind == "sweep_tracking" else ""
    return f"feature:{one.kind} {one.quantity}{decay}"


Made = Mapping[str, Sequence[tuple[np.ndarray, float]]]


def _moved_table(
    tried: Sequence[FeatureSettings], data: Mapping[str, TaskData], made: Made
) -> Table:
    """Return how far each feature of another data set lies from that of the same recording here:
    relative L2 distance, the median over recordings that both have by name."""
    rows = []
    place = {name: n for n, name in enumerate(data[""].name.tolist())}
    for n, one in enumerate(tried):
        for name in (name for name in data if name):
            pairs = [(place[r], i) for i, r in enumerate(data[name].name.tolist()) if r in place]
            here, there = np.array(pairs, int).reshape(-1, 2).T
            own, other = made[""][n][0][here], made[name][n][0][there]
            with np.errstate(invalid="ignore", divide="ignore"):
                moved = np.linalg.norm(other - own, axis=1) / np.linalg.norm(own, axis=1)
            moved = moved[np.isfinite(moved)]
            value = float(np.median(moved)) if len(moved) else None
            rows.append({"part": _part(one), "dataset": name, "moved": value})
    return table_of("moved", "How far noise moves the feature", rows, **MOVED)


def features_of(
    inputs: Inputs, other: str, data: TaskData, tried: Sequence[FeatureSettings]
) -> list[tuple[np.ndarray, float]]:
    """Return features (n, bins) of recordings of a data set (its own: "") by each of the settings,
    and the median time of one in seconds.

    Raises NotPossibleError for a sound that does not allow one of them.
    """
    if inputs.recordings is None:
        raise NotPossibleError("the recordings themselves are needed")
    dataset, names = other or inputs.dataset, data.name.tolist()
    makers = _Makers(inputs.recordings, dataset, tried, inputs.audio.sample_rate_hz)
    features: list[list[np.ndarray]] = [[] for _ in tried]
    seconds: list[list[float]] = [[] for _ in tried]
    for start in range(0, len(names), BLOCK):
        named = names[start : start + BLOCK]
        block = list(inputs.recordings.samples(dataset, named, inputs.features.window))
        for n in range(len(tried)):
            for name, samples in zip(named, block, strict=True):
                make = makers.of(name)[n]
                begun = time.process_time()
                features[n].append(make(samples))
                seconds[n].append(time.process_time() - begun)
    return [
        (np.array(made), float(np.median(times)))
        for made, times in zip(features, seconds, strict=True)
    ]


class _Makers:
    """Makers of features by what was played: made once, however many sessions share a sound."""

    def __init__(
        self,
        recordings: Recordings,
        dataset: str,
        tried: Sequence[FeatureSettings],
        sample_rate_hz: float,
    ) -> None:
        self._recordings, self._dataset = recordings, dataset
        self._tried, self._rate = tried, sample_rate_hz
        self._of: dict[bytes, list[Callable[[np.ndarray], np.ndarray]]] = {}
        self._session: dict[str, list[Callable[[np.ndarray], np.ndarray]]] = {}

    def of(self, name: str) -> list[Callable[[np.ndarray], np.ndarray]]:
        """Return the makers for a recording, in the order of the settings."""
        session = name.partition("/")[0]
        if session not in self._session:
            played = self._recordings.played(self._dataset, name)
            key = b"" if played is None else played.tobytes()
            if key not in self._of:
                self._of[key] = self._made(session, played)
            self._session[session] = self._of[key]
        return self._session[session]

    def _made(
        self, session: str, played: np.ndarray | None
    ) -> list[Callable[[np.ndarray], np.ndarray]]:
        from ajgdata.features.maker import UnfitExcitationError, feature_maker

        try:
            return [feature_maker(one, self._rate, played) for one in self._tried]
        except UnfitExcitationError as error:
            raise NotPossibleError(f"session {session}: {error}") from None


EXPERIMENT = Experiment(
    name="feature_quantity",
    order=71,
    title="Quantities of the feature",
    settings=Settings,
    measure=measure,
    figures=figures,
    tables=tables,
    check=check,
    reads_recordings=True,
)
