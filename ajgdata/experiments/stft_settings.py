"""Settings of the STFT: error of cheap models against the run time of the feature."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from pydantic import Field, ValidationError

from ajgdata.evaluate.task_data import TaskData
from ajgdata.experiments.base import (
    SCORES,
    Experiment,
    Inputs,
    Outcome,
    TaskResults,
    fold_scores,
    score_table,
)
from ajgdata.report.blocks import Illustration, ShownTable
from ajgdata.report.comparison import mark_of, range_of
from ajgdata.report.format import Score, number, with_unit
from ajgdata.report.panel import Highlight
from ajgdata.types import FeatureSettings, Kind, ModelName, NotPossibleError, Strict
from ajgdata.types.table import table_of

if TYPE_CHECKING:
    pass

#: Recordings held at once, and transformed with one setting after the other: the times of all
#: settings are then of the same moments.
BLOCK = 64
TICKS_MS = (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50)


class FeatureChange(Strict):
    """A difference from the data set's own feature settings."""

    window: int | None = Field(None, ge=16, description="STFT window in samples")
    hop: int | None = Field(None, ge=1, description="samples between windows")
    band_hz: tuple[float, float] | None = Field(None, description="keep bins from low to high")


class Settings(Strict):
    """Error against run time of the feature, for other settings of the STFT."""

    settings: tuple[FeatureChange, ...] = Field(
        min_length=1, description="what is tried beside the data set's own settings"
    )
    models: tuple[ModelName, ...] = Field(
        ("ridge_plain", "knn_plain"),
        min_length=1,
        description="models that are evaluated with each",
    )


def variants(settings: Settings, own: FeatureSettings) -> list[FeatureSettings]:
    """Return the feature settings that are compared, the data set's own first."""
    changes = [one.model_dump(exclude_none=True) for one in settings.settings]
    return [FeatureSettings(**(own.model_dump() | change)) for change in ({}, *changes)]


def check(settings: Settings, _: Kind, features: FeatureSettings) -> None:
    """Raise ValueError for settings that no feature can have."""
    try:
        if any(one.kind != "stft" for one in variants(settings, features)):
            raise ValueError("stft_settings.settings: features.kind is no STFT")
    except ValidationError as error:
        message = error.errors()[0]["msg"].removeprefix("Value error, ")
        raise ValueError(f"stft_settings.settings: {message}") from None


def measure(inputs: Inputs, settings: Settings, _: str) -> Outcome:
    """Return errors of the models with features made by each of the settings, and run times.

    Each recording is read once. The same folds serve all settings. Times are processor time of one
    thread, the median over recordings.
    """
    from ajgdata.evaluate.crossval import cross_validate

    tried = variants(settings, inputs.features)
    if any(one.align for one in tried):
        raise NotPossibleError(
            "settings of the STFT need recordings as they are: no features.align"
        )
    data = inputs.data()
    scores, costs, points = [], [], []
    for one, (features, seconds) in zip(tried, features_of(inputs, data, tried), strict=True):
        part = _part(one)
        band = one.band_hz or (None, None)
        points.append(
            {"part": part, "window": one.window, "hop": one.hop, "low_hz": band[0]}
            | {"high_hz": band[1], "bins": features.shape[1]}
        )
        for model in settings.models:
            found = cross_validate(features, data.value, data.group, model=model, **inputs.split)
            scores += list(fold_scores(model, part, found.scores))
            times = {"feature_s_per_recording": seconds, "train_s": found.cost.train_s}
            times["inference_s_per_recording"] = found.cost.inference_s_per_recording
            costs += [(model, f"cost of {part}", name, "measured", s) for name, s in times.items()]
    columns = {"part": "Setting", "window": "Window, samples", "hop": "Hop, samples"}
    columns |= {"low_hz": "From, Hz", "high_hz": "To, Hz", "bins": "Bins"}
    title = "Settings of the STFT"
    return Outcome(
        (score_table(scores, title), table_of("settings", title, points, **columns)),
        (score_table(costs, title),),
    )


def _part(one: FeatureSettings) -> str:
    band = " {:g}-{:g} Hz".format(*one.band_hz) if one.band_hz else ""
    return f"stft:{one.window}/{one.hop}{band}"


def features_of(
    inputs: Inputs, data: TaskData, tried: list[FeatureSettings]
) -> list[tuple[np.ndarray, float]]:
    """Return features (n, bins) by each of the settings, and the median time of one in seconds.

    Raises ValueError for a recording that is gone or was changed into one that cannot be used.
    """
    from ajgdata.features.spectrum import spectrum

    if inputs.recordings is None:
        raise ValueError("the recordings themselves are needed")
    features: list[list[np.ndarray]] = [[] for _ in tried]
    seconds: list[list[float]] = [[] for _ in tried]
    longest, names = max(one.window for one in tried), data.name.tolist()
    for start in range(0, len(names), BLOCK):
        block = list(
            inputs.recordings.samples(inputs.dataset, names[start : start + BLOCK], longest)
        )
        for one, made, times in zip(tried, features, seconds, strict=True):
            for samples in block:
                begun = time.process_time()
                made.append(spectrum(samples, inputs.audio.sample_rate_hz, one))
                times.append(time.process_time() - begun)
    return [
        (np.array(made), float(np.median(times)))
        for made, times in zip(features, seconds, strict=True)
    ]


class Point(NamedTuple):
    """One setting: the feature's run time, and the error (mean, sd) of each model.

    Errors of classes are 100 - accuracy in per cent, of numbers the RMSE.
    """

    window: int
    hop: int
    band: str  #: in kHz, "all" for the whole
    bins: int
    feature_ms: float
    errors: tuple[tuple[float, float], ...]

    @property
    def label(self) -> str:
        """Return window, hop and band in short."""
        return f"{self.window}/{self.hop}" + (f", {self.band}" if self.band != "all" else "")


def points_of(results: TaskResults) -> list[Point]:
    """Return the settings that were compared, the data set's own first."""
    result = results.results[0]
    scores, costs = result.tables[SCORES], result.cost[SCORES]
    points = []
    for row in result.tables["settings"].rows:
        part = str(row["part"])
        cost = costs.where(part=f"cost of {part}", metric="feature_s_per_recording")
        errors = [error_of(results, scores.where(part=part, model=m)) for m in models_of(results)]
        low, high = row["low_hz"], row["high_hz"]
        band = "all" if low is None else f"{low / 1000:g}–{high / 1000:g}"
        feature_ms = 1e3 * float(cost.numbers("value")[0])
        points.append(
            Point(row["window"], row["hop"], band, row["bins"], feature_ms, tuple(errors))
        )
    return points


def models_of(results: TaskResults) -> tuple[str, ...]:
    """Return the names of the models, in the order of their errors in a point."""
    return tuple(results.settings.models)


def labels_of(results: TaskResults) -> list[str]:
    """Return the names of the models for people."""
    from ajgdata.models import model_label

    return [model_label(model, results.kind) for model in models_of(results)]


def error_of(results: TaskResults, scores: Any, statistic: str = "mean") -> tuple[float, float]:
    """Return an error as it is shown, and its sd, of a table of scores of one setting and model."""
    of = scores.where(metric=results.metric)
    value = float(of.where(statistic=statistic).numbers("value")[0])
    sd = float(of.where(statistic="sd").numbers("value")[0])
    return (100 - 100 * value, 100 * sd) if results.kind == "classification" else (value, sd)


def error_name(results: TaskResults) -> str:
    """Return what the error is."""
    return "share that is wrong" if results.kind == "classification" else "RMSE"


def figures(results: TaskResults) -> list[Illustration]:
    """Return the figure of all settings."""
    from ajgdata.experiments.drawings.stft_settings import caption, figure

    return [Illustration(results.named(), caption(results), lambda: figure(results))]


def error_range(results: TaskResults, model: int) -> str:
    """Return `28 to 35 %`: the errors of a model with all settings but the data set's own."""
    errors = [point.errors[model][0] for point in points_of(results)[1:]]
    low, high = (number(f(errors)) for f in (min, max))
    return with_unit(low if low == high else f"{low} to {high}", results.shown_unit)


def tables(results: TaskResults) -> list[ShownTable]:
    """Return every setting with its run time and errors."""
    unit = f" in {results.shown_unit}" if results.shown_unit else ""
    name = "Share that is wrong" if results.kind == "classification" else "RMSE"
    heads = ("Window", "Hop", "Band, kHz", "Bins|", "ms a feature|")
    rows = tuple(
        (
            str(p.window),
            str(p.hop),
            p.band,
            f"{p.bins:,}",
            number(p.feature_ms),
            *(f"{number(mean)} ± {number(sd, 2)}" for mean, sd in p.errors),
        )
        for p in points_of(results)
    )
    labels = tuple(f"{label}|" for label in labels_of(results))
    told = f"{name}{unit}, mean ± sd over folds."
    return [ShownTable(told, heads + labels, rows, folded="Every setting of the STFT")]


def highlights(results: TaskResults) -> list[Highlight]:
    """Return the range of the first model's errors over all settings but the data set's own."""
    own, *others = points_of(results)
    marks = (
        range_of("ours", f"{len(others)} settings", [point.errors[0][0] for point in others]),
        mark_of("other", own.label, Score(*own.errors[0])),
    )
    text = f"{error_name(results)}, range, exploratory"
    return [Highlight("Feature settings", text, results.shown_unit, marks)]


EXPERIMENT = Experiment(
    name="stft_settings",
    order=70,
    title="Settings of the STFT",
    settings=Settings,
    measure=measure,
    figures=figures,
    tables=tables,
    highlights=highlights,
    check=check,
    reads_recordings=True,
)
