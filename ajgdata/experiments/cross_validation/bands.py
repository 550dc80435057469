"""Twins of a task from a part of the band: the same recordings, folds and models, fewer bins."""

from __future__ import annotations

import dataclasses

from ajgdata.experiments.base import Inputs, TaskResults
from ajgdata.experiments.cross_validation.results import ModelResult
from ajgdata.report.comparison import Twin
from ajgdata.report.format import Score, number
from ajgdata.report.paper import PaperFigure
from ajgdata.store.features import Shard
from ajgdata.types import NotPossibleError

Band = tuple[float, float]


def part_within(part: str, band: Band) -> str:
    """Return the name of a part of the results, from a band alone: `grouped 60-6000 Hz`."""
    return f"{part} {band[0]:g}-{band[1]:g} Hz"


def band_label(band: Band) -> str:
    """Return a band for people: `60–6,000 Hz`."""
    return f"{number(band[0])}–{number(band[1])} Hz"


def confined(inputs: Inputs, band: Band) -> Inputs:
    """Return the inputs of a task with the bins of `band` alone, in all stores.

    Raises NotPossibleError for a band that holds no bin.
    """
    from ajgdata.features.bands import within

    def of(shard: Shard) -> Shard:
        normalisation = inputs.features.normalisation
        try:
            feature, hz = within(shard.feature, shard.frequency_hz, band, normalisation)
        except ValueError as error:
            raise NotPossibleError(f"bands: {error}") from None
        return dataclasses.replace(shard, feature=feature, frequency_hz=hz)

    others = {name: of(shard) for name, shard in inputs.others.items()}
    return dataclasses.replace(inputs, store=of(inputs.store), others=others)


def bands_of(results: TaskResults) -> tuple[Band, ...]:
    """Return the bands from which alone a task was evaluated as well."""
    return tuple(getattr(results.settings, "bands", ()))


def twins(model: ModelResult, part: str) -> list[tuple[Band, Score]]:
    """Return what a model does on a part of its task from each band alone."""
    named = ((band, part_within(part, band)) for band in bands_of(model.task))
    return [(band, model.score(name)) for band, name in named if model.has(name)]


def beside(paper: PaperFigure, model: ModelResult, part: str) -> tuple[Twin, ...]:
    """Return the twins of a row of the comparison with the paper, each with its verdict."""
    found = []
    for band, _ in twins(model, part):
        name = part_within(part, band)
        agrees = "" if paper.value is None else model.verdict(name, paper.value)
        found.append(Twin(band_label(band), model.shown(model.with_interval(name)), agrees))
    return tuple(found)
