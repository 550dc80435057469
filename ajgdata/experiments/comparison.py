"""Comparisons: variants of features or played sound, with the same models, grasps and folds.

Each is a file `reports/comparisons/<name>.yaml` of the project. The first variant is the reference.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import repeat
from typing import Any, NamedTuple

import numpy as np
from pydantic import Field, TypeAdapter, ValidationError

from ajgdata.evaluate.parts import GROUPED, elsewhere, part_columns
from ajgdata.evaluate.task_data import TaskData
from ajgdata.experiments.base import (
    Experiment,
    Inputs,
    Outcome,
    Result,
    TaskResults,
)
from ajgdata.experiments.plots import Plot, value_range
from ajgdata.experiments.scores import SCORES, ScoreKey, ScoreRow, fold_scores, score_table
from ajgdata.report.format import column_title, words
from ajgdata.store.metrics import COST
from ajgdata.types import (
    DEFAULT_EXCITATION,
    ExcitationSpec,
    FeatureSettings,
    Kind,
    Level,
    Name,
    NotPossibleError,
    Strict,
)
from ajgdata.types.comparison import Comparison, Variant
from ajgdata.types.table import Table, table_of

TITLE = "Comparison"
#: Metric of the cost of features.
FEATURE_S = "feature_s_per_recording"
#: Variants that a figure lists by name; more are shown over their cost.
MAX_NAMED_VARIANTS = 6


class Settings(Strict):
    """Comparisons of a task by name, from `reports/comparisons/`."""

    comparisons: dict[Name, Comparison] = Field(min_length=1, description="comparisons by name")
    test_on: tuple[Name, ...] = Field((), description="further data sets of all comparisons")

    @property
    def models(self) -> tuple[str, ...]:
        """Names of the comparisons: each is measured in a job of its own."""
        return tuple(self.comparisons)

    @property
    def titles(self) -> dict[str, str]:
        """Titles of the comparisons by name."""
        return {name: comparison.title for name, comparison in self.comparisons.items()}

    def only(self, name: str) -> Settings:
        """Return the settings of one comparison."""
        comparison = self.comparisons[name]
        return Settings(comparisons={name: comparison}, test_on=comparison.test)


class Features(NamedTuple):
    """Features (n, bins) of the recordings, and the median processor time (s) of one."""

    feature: np.ndarray
    seconds: float


def excitation_of(variant: Variant) -> ExcitationSpec:
    """Return the played sound of a variant, at the peak level of the default sound."""
    adapter: TypeAdapter[ExcitationSpec] = TypeAdapter(ExcitationSpec)
    return adapter.validate_python({"amplitude": DEFAULT_EXCITATION.amplitude} | variant.excitation)


def features_of(variant: Variant, own: FeatureSettings) -> FeatureSettings:
    """Return the feature settings of a variant of a data set with the settings `own`."""
    return FeatureSettings.model_validate(own.model_dump() | variant.features)


def check(settings: Settings, _: Kind, features: FeatureSettings) -> None:
    """Raise ValueError for variants that no feature, or no sound, can have."""
    for name, comparison in settings.comparisons.items():
        for variant in comparison.all_variants:
            try:
                features_of(variant, features)
                if variant.excitation:
                    excitation_of(variant)
            except ValidationError as error:
                message = error.errors()[0]["msg"].removeprefix("Value error, ")
                raise ValueError(f"comparison {name}, {variant.name}: {message}") from None


def measure(inputs: Inputs, settings: Settings, model: str) -> Outcome:
    """Return the errors of all models with each variant of the comparison `model`."""
    from threadpoolctl import threadpool_limits

    from ajgdata.evaluate.crossval import cross_validate
    from ajgdata.evaluate.splits import column_folds

    task = inputs.task_settings
    comparison = settings.comparisons[model]
    data = {name: inputs.data(name) for name in ("", *comparison.test)}
    with threadpool_limits(limits=1):
        spectra = {name: _features(inputs, comparison, name, data[name]) for name in data}
    own = data[""]
    folds = column_folds(own.value, own.group, task.groups, task.kind, task.folds, inputs.seed)
    scores: list[ScoreRow] = []
    costs: list[ScoreRow] = []
    for at, variant in enumerate(comparison.all_variants):
        feature, seconds = spectra[""][at]
        extra = {
            name: data[name]._replace(feature=spectra[name][at].feature) for name in comparison.test
        }
        key = ScoreKey(comparison=model, condition=variant.name)
        if np.isfinite(seconds):
            costs.append(ScoreRow(FEATURE_S, COST, seconds, key))
        for name in comparison.models:
            result = cross_validate(
                feature,
                own.value,
                own.group,
                model=name,
                extra_tests=extra,
                kind=task.kind,
                folds=folds,
                seed=inputs.seed,
                period=task.period_deg,
            )
            tests = {GROUPED: result.scores}
            tests |= {elsewhere(other): part.scores for other, part in result.extra_tests.items()}
            for part, part_scores in tests.items():
                columns = part_columns(part, inputs.dataset)._asdict()
                scores += fold_scores(part_scores, key._replace(model=name, **columns))
            train_cpu_s = result.cost.train_cpu_s
            costs.append(ScoreRow("train_cpu_s", COST, train_cpu_s, key._replace(model=name)))
    return Outcome((score_table(scores, TITLE),), (score_table(costs, TITLE),))


def _features(inputs: Inputs, comparison: Comparison, other: str, data: TaskData) -> list[Features]:
    """Return the features of a data set (its own: "") by each variant.

    Raises NotPossibleError for a sound, or a recording, that does not allow one of them.
    """
    from ajgdata.features.spectrum import spectrum

    variants = comparison.all_variants
    if not comparison.makes_features:
        return [Features(data.feature, np.nan)] * len(variants)
    settings = [features_of(variant, inputs.features) for variant in variants]
    features: list[list[np.ndarray]] = [[] for _ in variants]
    seconds: list[list[float]] = [[] for _ in variants]
    for recordings in _samples(inputs, variants, other, data.name.tolist()):
        for at, samples in enumerate(recordings):
            begun = time.process_time()
            features[at].append(spectrum(samples, inputs.audio.sample_rate_hz, settings[at]))
            seconds[at].append(time.process_time() - begun)
    return [
        Features(np.array(rows), float(np.median(times)))
        for rows, times in zip(features, seconds, strict=True)
    ]


def _samples(
    inputs: Inputs, variants: Sequence[Variant], other: str, names: Sequence[str]
) -> Iterator[list[np.ndarray]]:
    """Yield for each recording of `names` the samples (n,) of every variant.

    Variants with a sound are simulated with it; the others are the recording itself, read once.
    """
    played = [variant for variant in variants if variant.excitation]
    rendered = _rendered(inputs, played, names) if played else repeat(())
    recorded: Iterable[Any] = repeat(None)
    if len(played) < len(variants):
        if inputs.recordings is None:
            raise NotPossibleError("the recordings themselves are needed")
        recorded_variants = [variant for variant in variants if not variant.excitation]
        longest = max(features_of(variant, inputs.features).window for variant in recorded_variants)
        recorded = inputs.recordings.samples(other or inputs.dataset, names, longest)
    for own, sounds in zip(recorded, rendered, strict=False):
        simulated = iter(sounds)
        yield [next(simulated).astype(np.float32) if v.excitation else own for v in variants]


def _rendered(
    inputs: Inputs, variants: Sequence[Variant], names: Sequence[str]
) -> Iterable[Sequence[np.ndarray]]:
    """Return for each simulated recording its samples with the sound of each variant."""
    from ajgdata.acquire.excitation import excitation_samples

    if inputs.render is None:
        raise NotPossibleError("it needs a virtual data set: other sounds are played in its scenes")
    rate = inputs.audio.sample_rate_hz
    try:
        sounds = [excitation_samples(excitation_of(variant), rate) for variant in variants]
    except ValueError as error:  # beyond half the rate of the recordings
        raise NotPossibleError(str(error)) from None
    return inputs.render(names, sounds)


# Report


def errors(result: Result, results: TaskResults) -> Table:
    """Return the metric of one comparison per model, variant, data set and fold."""
    comparison = results.settings.comparisons[result.model]
    levels = {results.dataset: results.level}
    levels |= {name: results.other_sets[name].level for name in comparison.test}
    scores = result.tables[SCORES].where(metric=results.metric)
    rows = []
    for variant in comparison.all_variants:
        seconds = result.cost[SCORES].where(condition=variant.name, metric=FEATURE_S)
        milliseconds = 1e3 * float(seconds.numbers("value")[0]) if seconds.rows else None
        for name, level in levels.items():
            row = {
                "variant": variant.name.rpartition(":")[2],
                "series": variant.series,
                "x": variant.x,
                "ms": milliseconds,
                "tested": name,
                "metric": results.metric,
                "level": level.value if level else None,
            }
            table = scores.where(condition=variant.name, test_set=name)
            rows += [row | values for values in _folds(results, table)]
    columns = {
        "model": "Model",
        "variant": "Variant",
        "series": "Series",
        "x": _axis_title(comparison.axis),
        "ms": "Time per feature, ms",
        "tested": "Tested on",
        "metric": "Metric",
        "level": _level_title(levels.values()),
        "value": "Value",
        "error": column_title("Error", results.shown_unit),
        "chance": "Chance",
    }
    return table_of("comparison", comparison.title, rows, **columns)


def _level_title(levels: Iterable[Level | None]) -> str:
    known = [level for level in levels if level]
    return column_title(known[0].quantity.capitalize(), known[0].unit) if known else "Level"


def _axis_title(key: str) -> str:
    """Return the title of the axis of a key: `excitation.length_s` -> length, in s."""
    name, _, unit = (last := key.rpartition(".")[2]).rpartition("_")
    return column_title(name.capitalize(), unit) if unit == "s" else words(last)


def _folds(results: TaskResults, table: Table) -> Iterator[dict[str, float | str]]:
    """Yield the value of each fold of each model, with chance; errors of classes are in %."""
    wrong = results.task_settings.kind == "classification"
    for model, scores in table.split_by("model").items():
        (chance,) = scores.where(statistic="chance").numbers("value")
        for row in scores.rows:
            if str(row["statistic"]).startswith("fold "):
                error = 100 * (1 - row["value"]) if wrong else row["value"]
                yield {"model": model, "value": row["value"], "error": error, "chance": chance}


def plot_of(results: TaskResults, result: Result) -> Plot:
    """Return the plot of one comparison: over its axis, over levels, over time, or as rows."""
    comparison = results.settings.comparisons[result.model]
    plot = Plot(
        "lines",
        partial(errors, result),
        f"{comparison.title}: the same recordings and folds; exploratory, because the best of "
        "several variants that is chosen on these folds would be optimistically biased",
        series=("variant",),
        panel="model",
        cells={"model": "model", "tested": "data set"},
        metric="metric",
        chance="chance",
        name=result.model,
    )
    levels = [results.level, *(results.other_sets[name].level for name in comparison.test)]
    if comparison.test and all(levels):
        return replace(plot, x="level")
    if comparison.axis:
        return replace(plot, x="x", series=("series",))
    if comparison.test:
        return replace(plot, mark="rows", x="variant", series=("tested",))
    if comparison.makes_features and len(comparison.all_variants) > MAX_NAMED_VARIANTS:
        plot = replace(plot, mark="scatter", value="error", metric="", x="ms", chance="")
    else:
        plot = replace(plot, mark="rows", x="variant", series=())
    return replace(plot, title=partial(range_title, plot))


def range_title(plot: Plot, results: TaskResults) -> str:
    """Return the value of the first model with the reference, and the range of other variants; the
    default title if a value is missing."""
    bound = plot.bind(results)
    panel = bound.points[0].panel
    values = {p.series or p.x: p.score.mean for p in bound.points if p.panel == panel}
    reference = results.settings.comparisons[plot.name].all_variants[0].name.rpartition(":")[2]
    name = words(reference)
    if name not in values or len(values) < 2:
        return bound.default_title
    axis = bound.axis
    value = value_range([values.pop(name)], axis.unit)
    varied = "other variants" if len(values) > 1 else next(iter(values))
    values_text = value_range([*values.values()], axis.unit)
    return f"{panel}: {axis.title} {value} with {name}, {values_text} with {varied}"


def plots(results: TaskResults) -> list[Plot]:
    """Return the plot of every comparison."""
    return [plot_of(results, result) for result in results.results]


def summary(results: TaskResults) -> str:
    """Return the questions of the comparisons."""
    comparisons = results.settings.comparisons
    return " ".join(comparisons[result.model].question for result in results.results)


EXPERIMENT = Experiment(
    name="comparison",
    order=70,
    title=TITLE,
    settings=Settings,
    measure=measure,
    plots=plots,
    summary=summary,
    check=check,
    by_model=True,
    reads_recordings=True,
    renders=True,
)
