"""Sorting live: new grasps of the objects, with further looks while no class is probable enough."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from pydantic import Field

from ajgdata.evaluate.task_data import TaskData
from ajgdata.experiments.base import (
    Experiment,
    Inputs,
    Lookup,
    Outcome,
    ScoreRow,
    TaskResults,
    score_table,
)
from ajgdata.experiments.plots import Plot
from ajgdata.experiments.sorting import (
    PARTS,
    RUN_COLUMNS,
    SHARE_COLUMNS,
    Row,
    run_comparison,
    sorting_scores,
)
from ajgdata.report.comparison import PaperComparison
from ajgdata.types import ModelName, NotPossibleError, Strict
from ajgdata.types.table import table_of


class Settings(Strict):
    """Sorting new grasps of the objects of a simulated data set, with several looks at each."""

    threshold: float = Field(0.6, gt=0, le=1, description="probability that is enough (paper)")
    placements: int = Field(40, ge=1, description="new placements of each object")
    looks: int = Field(3, ge=1, description="grasps of one placement, at most")
    runs: int = Field(20, ge=1, description="runs, each of all placements in another order")
    models: tuple[ModelName, ...] = Field(("cnn",), min_length=1, description="models that sort")


def measure(inputs: Inputs, settings: Settings, model: str) -> Outcome:
    """Return runs of sorting new grasps by `model`, trained on all recordings."""
    if inputs.new_grasps is None:
        raise NotPossibleError("it needs a virtual data set: its objects are grasped anew")
    data = inputs.data()
    ready = trained(inputs, data, model)
    wanted = wanted_grasps(ready.classes.tolist(), settings.placements, settings.looks)
    feature = _features(inputs, inputs.new_grasps(wanted), settings.looks)
    label = np.arange(len(feature)) // settings.placements
    scores: list[ScoreRow] = []
    conditions: list[Row] = []
    runs: list[Row] = []
    for condition, own_runs in _sorted(inputs, settings, ready, feature, label):
        part = _part_name(condition, ready.grasps)
        scores += sorting_scores(model, part, condition, own_runs)
        conditions.append(condition)
        runs += own_runs
    columns = {"part": "Probabilities", "looks": "Looks at most"}
    return Outcome(
        (
            score_table(scores, "Live sorting"),
            table_of("conditions", "Decisions", conditions, **columns, **SHARE_COLUMNS),
            table_of("runs", "Runs", runs, **columns, **RUN_COLUMNS),
        ),
        about={"placements": len(label)},
    )


class Trained(NamedTuple):
    """A model for use; `grasps` is the smallest number of training grasps of a class."""

    grasps: int
    classes: np.ndarray
    fitted: Any
    temperature: float

    def probabilities(self, feature: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return probabilities (n, n_classes) of features (n, bins): as they are, and scaled."""
        from ajgdata.evaluate.calibration import with_temperature

        plain = self.fitted.predict_proba(feature)
        return plain, with_temperature(plain, self.temperature)


def trained(inputs: Inputs, data: TaskData, model: str) -> Trained:
    """Return `model` trained on all recordings.

    Model and temperature are those of training for use (pipeline.train). Raises NotPossibleError
    for a model without probabilities, and for a class with one grasp.
    """
    from threadpoolctl import threadpool_limits

    from ajgdata.evaluate.in_use import scaling_temperature
    from ajgdata.models import fit_named_model

    classes = np.unique(data.value)
    count = [len(np.unique(data.group[data.value == name])) for name in classes]
    if min(count) < 2:
        name = classes[int(np.argmin(count))]
        raise NotPossibleError(f"{name} has {min(count)} grasp: record at least two")
    x, y, group, _ = data
    options: dict[str, Any] = {"seed": inputs.seed, "limits": inputs.most_recordings}
    with threadpool_limits(limits=1):
        temperature = scaling_temperature(x, y, group, model=model, **options)
        fitted = fit_named_model(model, "classification", x, y, group, **options)
    return Trained(min(count), classes, fitted, temperature)


def wanted_grasps(
    objects: Iterable[str], placements: int, looks: int
) -> list[tuple[str, int, int]]:
    """Return object, number of placement and of look of each grasp, in the order of results."""
    numbers = range(1, placements + 1)
    return [(o, n, look) for o in objects for n in numbers for look in range(1, looks + 1)]


def _features(inputs: Inputs, samples: Iterable[np.ndarray], looks: int) -> np.ndarray:
    """Return features (placements, looks, bins) of the samples of new grasps."""
    from ajgdata.acquire.excitation import excitation_samples
    from ajgdata.features.maker import feature_maker
    from ajgdata.types import DEFAULT_EXCITATION

    rate = inputs.audio.sample_rate_hz
    make = feature_maker(inputs.features, rate, excitation_samples(DEFAULT_EXCITATION, rate))
    features = np.array([make(one.astype(np.float32)) for one in samples])
    return features.reshape(-1, looks, features.shape[1])


def _sorted(
    inputs: Inputs, settings: Settings, model: Trained, feature: np.ndarray, label: np.ndarray
) -> Iterator[tuple[Row, list[Row]]]:
    """Yield the decisions on all placements and their runs, per number of looks."""
    from ajgdata.evaluate.sorting import look, orders, run_of

    count, looks, bins = feature.shape
    flat = feature.reshape(count * looks, bins)
    for name, shares in zip(PARTS, model.probabilities(flat), strict=True):
        for most in range(1, looks + 1):
            which = {"part": name, "looks": most}
            decided = look(shares.reshape(count, looks, -1), settings.threshold, most)
            runs = [
                which | {"run": number, **vars(run_of(decided.taken, label, order))}
                for number, order in enumerate(orders(count, settings.runs, inputs.seed))
            ]
            yield which | decided.shares(label), runs


def _part_name(row: Row, grasps: int) -> str:
    """Return grasps, probabilities and looks in words, as parts of scores are named."""
    looks = "1 look" if row["looks"] == 1 else f"{row['looks']} looks as needed"
    return f"live sorting, {grasps} grasps, {row['part']}, {looks}"


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield the runs of the first model with one look."""
    result = results.results[0]
    which: dict[str, Any] = {"part": PARTS[0], "looks": 1}
    longest = result.about["placements"]
    yield from run_comparison(results, result, longest, "new grasps", **which)


LENGTHS = Plot(
    "lines",
    "runs",
    "objects sorted before the first error in runs on new placements, by the largest number of "
    "looks at an object",
    value="before_error",
    x="looks",
    panel="part",
    over="runs",
    headline="trend",
    better="high",
    published="value",
)
WRONG = replace(
    LENGTHS,
    table="conditions",
    about="share of new placements that are sorted into a wrong bin",
    value="wrong",
    over="placements",
    better="low",
    published="",
    percent=True,
    name="wrong",
)
EXPERIMENT = Experiment(
    name="live_sorting",
    order=41,
    title="Live sorting",
    settings=Settings,
    measure=measure,
    plots=(LENGTHS, WRONG),
    paper_comparison=paper_comparison,
    by_model=True,
    kinds=("classification",),
    renders=True,
)
