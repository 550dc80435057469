"""Figures of variants: one per file, over its numeric axis, noise levels, time, or as rows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import partial

from ajgdata.evaluate.parts import TRAINING_VALUES
from ajgdata.experiments.base import Result, TaskResults
from ajgdata.experiments.plots import Plot, value_range
from ajgdata.experiments.scores import SCORES, is_fold
from ajgdata.experiments.variant_data import FEATURE_S
from ajgdata.report.format import column_title, words
from ajgdata.types import Level
from ajgdata.types.table import Table, table_of

#: Variants that a figure lists by name; more are shown over their cost.
MAX_NAMED_VARIANTS = 6


def errors(result: Result, results: TaskResults) -> Table:
    """Return the metric of one file per model, variant, data set and fold."""
    file = results.settings.files[result.model]
    levels = {
        results.dataset: results.level,
        **{name: results.other_sets[name].level for name in file.test_sets},
    }
    scores = result.tables[SCORES].where(metric=results.metric, target_values=TRAINING_VALUES)
    rows = []
    for variant in file.all_variants:
        costs = result.cost[SCORES].where(condition=variant.name, metric=FEATURE_S)
        milliseconds = 1e3 * float(costs.numbers("value")[0]) if costs.rows else None
        for name, level in levels.items():
            row = {
                "variant": variant.name.rpartition(":")[2],
                "series": file.series(variant),
                "x": file.x(variant),
                "ms": milliseconds,
                "tested": name,
                "metric": results.metric,
                "level": level.value if level else None,
            }
            test_set = file.held_out_set(variant.change) if name == results.dataset else name
            table = scores.where(condition=variant.name, test_set=test_set)
            rows += [row | values for values in _folds(results, table)]
    columns = {
        "model": "Model",
        "variant": "Variant",
        "series": "Series",
        "x": _axis_title(file.axis),
        "ms": "Time per feature, ms",
        "tested": "Tested on",
        "metric": "Metric",
        "level": _level_title(levels.values()),
        "value": "Value",
        "error": column_title("Error", results.shown_unit),
        "chance": "Chance",
    }
    return table_of("variants", file.title, rows, **columns)


def _level_title(levels: Iterable[Level | None]) -> str:
    known = [level for level in levels if level]
    return column_title(known[0].quantity.capitalize(), known[0].unit) if known else "Level"


def _axis_title(key: str) -> str:
    """Return the title of the axis of a key: `excitation.length_s` -> length, in s."""
    last = key.rpartition(".")[2]
    name, _, unit = last.rpartition("_")
    return column_title(name.capitalize(), unit) if unit == "s" else words(last)


def _folds(results: TaskResults, table: Table) -> Iterator[dict[str, float | str]]:
    """Yield the value of each fold of each model, with chance; errors of classes are in %."""
    is_wrong_share = results.task_settings.kind == "classification"
    for model, scores in table.split_by("model").items():
        (chance,) = scores.where(statistic="chance").numbers("value")
        for row in scores.rows:
            if is_fold(row["statistic"]):
                error = 100 * (1 - row["value"]) if is_wrong_share else row["value"]
                yield {"model": model, "value": row["value"], "error": error, "chance": chance}


def plot_of(results: TaskResults, result: Result) -> Plot:
    """Return the plot of one file: over its axis, over levels, over time, or as rows."""
    file = results.settings.files[result.model]
    plot = Plot(
        "lines",
        partial(errors, result),
        f"{file.title}: the same recordings and folds; exploratory, because the best of "
        "several variants that is chosen on these folds would be optimistically biased",
        series=("variant",),
        panel="model",
        cells={"model": "model", "tested": "data set"},
        metric="metric",
        chance="chance",
        name=result.model,
    )
    levels = [results.level, *(results.other_sets[name].level for name in file.test_sets)]
    if file.test_sets and all(levels):
        return replace(plot, x="level")
    if file.axis:
        return replace(plot, x="x", series=("series",))
    if file.test_sets:
        return replace(plot, mark="rows", x="variant", series=("tested",))
    if file.is_computed and len(file.all_variants) > MAX_NAMED_VARIANTS:
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
    reference = results.settings.files[plot.name].all_variants[0].name.rpartition(":")[2]
    name = words(reference)
    if name not in values or len(values) < 2:
        return bound.default_title
    axis = bound.axis
    value = value_range([values.pop(name)], axis.unit)
    varied = "other variants" if len(values) > 1 else next(iter(values))
    values_text = value_range([*values.values()], axis.unit)
    return f"{panel}: {axis.title} {value} with {name}, {values_text} with {varied}"


def plots(results: TaskResults) -> list[Plot]:
    """Return the plot of every file."""
    return [plot_of(results, result) for result in results.results]


def summary(results: TaskResults) -> str:
    """Return the questions of the files."""
    files = results.settings.files
    return " ".join(files[result.model].question for result in results.results)
