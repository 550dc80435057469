"""Errors by quantity of the feature, read back from their tables; what is told of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ajgdata.experiments.base import SCORES, TaskResults
from ajgdata.experiments.stft_settings import error_name, error_of
from ajgdata.report.blocks import Illustration, ShownTable
from ajgdata.report.format import DASH, Score, mean_sd, number, with_unit
from ajgdata.types import Level


class Line(NamedTuple):
    """One feature with one model: error (mean, sd) at each level, and ms to make one."""

    label: str
    errors: tuple[tuple[float, float], ...]
    feature_ms: float
    moved: tuple[float, ...]  #: by noise, at each level but the own


def places_of(results: TaskResults) -> list[tuple[str, str, Level | None]]:
    """Return part (" on:..." or ""), title and level of the task's own data and of the others, in
    rising order of level."""
    found = [("", results.dataset_title, results.level)]
    for name in results.settings.test_on:
        other = results.others[name]
        found.append((f" on:{name}", other.title, other.level))
    if all(level is not None for _, _, level in found):
        found.sort(key=lambda one: one[2].value if one[2] else 0.0)
    return found


def lines_of(results: TaskResults, model: str) -> list[Line]:
    """Return every feature that was tried with a model, the data set's own first."""
    result = results.results[0]
    scores, costs = result.tables[SCORES].where(model=model), result.cost[SCORES]
    moved = result.tables["moved"]
    lines = []
    for row in result.tables["features"].rows:
        part, places = str(row["part"]), places_of(results)
        errors = [error_of(results, scores.where(part=part + place)) for place, *_ in places]
        paid = costs.where(part=f"cost of {part}", metric="feature_s_per_recording")
        others = [place.removeprefix(" on:") for place, *_ in places if place]
        distances = [
            float(moved.where(part=part, dataset=name).numbers("moved")[0]) for name in others
        ]
        feature_ms = 1e3 * float(paid.numbers("value")[0])
        lines.append(Line(str(row["label"]), tuple(errors), feature_ms, tuple(distances)))
    return lines


def figures(results: TaskResults) -> list[Illustration]:
    """Return the figure of error against level, if the data sets have levels."""
    from ajgdata.experiments.feature_quantity.drawing import caption, figure

    places = places_of(results)
    if len(places) < 2 or any(level is None for *_, level in places):
        return []
    return [Illustration(results.named(), caption(results), lambda: figure(results))]


def tables(results: TaskResults) -> list[ShownTable]:
    """Return errors by feature and model, how far noise moves the feature, and its run time."""
    places = places_of(results)
    heads = [f"{_where(title, level)}|" for _, title, level in places]
    rows = []
    for model in results.settings.models:
        lines = lines_of(results, model)
        for line in lines:
            told = [shown(results, error) for error in line.errors]
            ratio = line.feature_ms / lines[0].feature_ms if lines[0].feature_ms else np.nan
            rows.append((label_of_model(results, model), line.label, *told, number(ratio, 2)))
    first = lines_of(results, results.settings.models[0])
    moved = [(line.label, *(_share(one) for one in line.moved)) for line in first]
    others = [f"{_where(title, level)}|" for place, title, level in places if place]
    own = with_unit(number(first[0].feature_ms, 2), "ms")
    return [
        ShownTable(
            f"{error_name(results)}, mean ± sd over folds; never trained elsewhere. Run time: "
            f"processor time of one feature over that of the data set's own ({own}).",
            ("Model", "Feature", *heads, "Run time|"),
            tuple(rows),
            "Errors by feature",
        ),
        ShownTable(
            "Distance of the features of one recording with and without the louder noise, over the "
            "size of the feature (L2), median over recordings. No model is asked.",
            ("Feature", *others),
            tuple(moved),
            "How far noise moves the feature",
        ),
    ]


def _share(moved: float) -> str:
    return f"{number(100 * moved, 2)} %" if np.isfinite(moved) else DASH


def _where(title: str, level: Level | None) -> str:
    return with_unit(number(level.value), level.unit) if level else title


def label_of_model(results: TaskResults, model: str) -> str:
    """Return the name of a model for people."""
    from ajgdata.models import model_label

    return model_label(model, results.kind)


def shown(results: TaskResults, error: tuple[float, float]) -> str:
    """Return an error with its spread, in the unit in which it is shown."""
    return mean_sd(Score(*error), results.shown_unit)
