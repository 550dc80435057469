"""Sorting live: new grasps of the objects, one after another, until none is probable enough.

`measure` makes the tables; `shown` reads them back, draws and tells.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import numpy as np
from pydantic import Field

from ajgdata.experiments.base import Experiment, Inputs, Outcome, score_table
from ajgdata.experiments.live_sorting.shown import (
    ALWAYS,
    NEEDED,
    PARTS,
    figures,
    paper_comparison,
    tables,
)
from ajgdata.experiments.sorting import RUN_METRICS
from ajgdata.types import ModelName, NotPossibleError, Strict
from ajgdata.types.table import Table, table_of

if TYPE_CHECKING:
    from ajgdata.experiments.live_sorting.trained import Trained

Made = TypeVar("Made")
Row = dict[str, Any]
#: Of measured times: percentiles.
STATISTICS = {"median": 50, "p99": 99}


class Settings(Strict):
    """Sorting new grasps of the objects of a simulated data set, with several looks at each."""

    threshold: float = Field(0.6, gt=0, le=1, description="probability that is enough (paper)")
    placements: int = Field(40, ge=1, description="new placements of each object")
    looks: int = Field(3, ge=1, description="grasps of one placement, at most")
    grasps: tuple[Annotated[int, Field(ge=2)], ...] = Field(
        (4, 12),
        description="further models are trained on so many grasps of each object, the first on all",
    )
    runs: int = Field(20, ge=1, description="runs, each of all placements in another order")
    sort_s: float = Field(
        81.5, gt=0, description="seconds of a sort with one look (paper: 39 in 53 min)"
    )
    look_s: float = Field(
        10.25,
        gt=0,
        description="seconds that one more look adds: loosen, approach, wait 2 s, sense (paper: 320"
        " grasps of two recordings in one hour, 11.25 s each, less the second recording)",
    )
    models: tuple[ModelName, ...] = Field(("cnn",), min_length=1, description="models that sort")


def measure(inputs: Inputs, settings: Settings, model: str) -> Outcome:
    """Return runs of sorting new grasps by `model`, trained on all recordings and on fewer."""
    from ajgdata.experiments.live_sorting.trained import trained

    if inputs.new_grasps is None:
        raise NotPossibleError("it needs a virtual data set: its objects are grasped anew")
    data, clock = inputs.data(), _Clock()
    sizes = (None, *sorted(settings.grasps, reverse=True))
    limits = inputs.most_recordings
    made = [trained(data, model, inputs.seed, size, limits) for size in sizes]
    wanted = wanted_grasps(made[0].classes.tolist(), settings.placements, settings.looks)
    feature, label = _sensed(inputs, settings, inputs.new_grasps(wanted), clock)
    for row in feature[:, 0]:  # one at a time, as they come to a robot
        clock.timed("model", made[0].probabilities, row[np.newaxis])
    conditions: list[Row] = []
    runs: list[Row] = []
    for one in made:
        for told, ran in _sorted(inputs, settings, one, feature, label, clock):
            conditions.append(told)
            runs += ran
    return Outcome(
        _tables(model, conditions, runs),
        (score_table(clock.rows(model), "Live sorting"),),
        about={
            "temperatures": {str(one.grasps): one.temperature for one in made},
            "placements": len(label),
        },
    )


class _Clock:
    """Wall times of the stages from a sound to a decision."""

    def __init__(self) -> None:
        self._seconds: dict[str, list[float]] = {}

    def timed(self, stage: str, call: Callable[..., Made], *given: Any) -> Made:
        begun = time.perf_counter()
        made = call(*given)
        self._seconds.setdefault(stage, []).append(time.perf_counter() - begun)
        return made

    def rows(self, model: str) -> Iterator[tuple[str, str, str, str, float]]:
        for stage, seconds in self._seconds.items():
            for statistic, percent in STATISTICS.items():
                value = float(np.percentile(seconds, percent))
                yield model, "cost of live sorting", f"{stage}_s", statistic, value


def wanted_grasps(
    objects: Iterable[str], placements: int, looks: int
) -> list[tuple[str, int, int]]:
    """Return object, number of placement and of look of each grasp, in the order of results."""
    numbers = range(1, placements + 1)
    return [(o, n, look) for o in objects for n in numbers for look in range(1, looks + 1)]


def _sensed(
    inputs: Inputs, settings: Settings, heard: Iterable[np.ndarray], clock: _Clock
) -> tuple[np.ndarray, np.ndarray]:
    """Return features (placements, looks, bins) of what was heard of new grasps, and the class
    numbers (placements,)."""
    from ajgdata.acquire.excitation import excitation_samples
    from ajgdata.features.maker import feature_maker
    from ajgdata.types import DEFAULT_EXCITATION

    rate = inputs.audio.sample_rate_hz
    make = feature_maker(inputs.features, rate, excitation_samples(DEFAULT_EXCITATION, rate))
    features = [clock.timed("feature", make, one.astype(np.float32)) for one in heard]
    shaped = np.array(features).reshape(-1, settings.looks, len(features[0]))
    return shaped, np.arange(len(shaped)) // settings.placements


def _sorted(
    inputs: Inputs,
    settings: Settings,
    trained: Trained,
    feature: np.ndarray,
    label: np.ndarray,
    clock: _Clock,
) -> Iterator[tuple[Row, list[Row]]]:
    """Yield what is decided on all placements in each condition, and its runs."""
    from ajgdata.evaluate.sorting import look

    count, looks, bins = feature.shape
    flat = feature.reshape(count * looks, bins)
    for name, shares in zip(PARTS, trained.probabilities(flat), strict=True):
        probability = shares.reshape(count, looks, -1)
        for most, policy in _policies(settings):
            named = {"grasps": trained.grasps, "part": name, "policy": policy, "looks": most}
            rules = settings.threshold, most
            looked = look(probability, *rules, always=policy == ALWAYS)
            for one in probability:
                clock.timed("decide", look, one[np.newaxis], *rules)
            yield (
                named | _decided(settings, looked, label),
                [named | row for row in _runs(inputs, settings, trained.classes, looked, label)],
            )


def _policies(settings: Settings) -> Iterator[tuple[int, str]]:
    """Yield how many looks there are at most, and whether each object has them all."""
    for most in range(1, settings.looks + 1):
        yield most, NEEDED
        if most > 1:
            yield most, ALWAYS


def _decided(settings: Settings, looked: Any, label: np.ndarray) -> Row:
    """Return shares of all placements, and what the looks at them took."""
    from ajgdata.evaluate.sorting import STOP, accepted

    passed = accepted(looked.taken, label)
    mean_looks = float(looked.looks.mean())
    return {
        "accuracy": float(np.mean(looked.probability.argmax(axis=1) == label)),
        "accepted": passed.share,
        "right": passed.accuracy,
        "wrong": float(np.mean((looked.taken != STOP) & (looked.taken != label))),
        "mean_looks": mean_looks,
        "added_s": settings.look_s * (mean_looks - 1),
    }


def _runs(
    inputs: Inputs, settings: Settings, classes: np.ndarray, looked: Any, label: np.ndarray
) -> Iterator[Row]:
    """Yield each run; where it stopped: what was held, and the two most probable classes."""
    from ajgdata.evaluate.sorting import orders, run_in_order

    for number, order in enumerate(orders(len(label), settings.runs, inputs.seed)):
        run = run_in_order(looked, label, order)
        tried = run.sorts + (run.stopped_at is not None)
        row: Row = {"run": number, "sorts": run.sorts, "mistakes": run.mistakes}
        row |= {"before_error": run.before_error}
        row["sort_s"] = settings.sort_s + settings.look_s * (run.looks / tried - 1)
        stop = dict.fromkeys(("held", "first", "first_p", "second", "second_p"))
        if run.stopped_at is not None:
            p = looked.probability[run.stopped_at]
            first, second = np.argsort(-p, kind="stable")[:2]
            stop = {"held": classes[label[run.stopped_at]], "first": classes[first]}
            stop |= {"first_p": p[first], "second": classes[second], "second_p": p[second]}
        yield row | stop


def part_name(row: Row) -> str:
    """Return grasps, probabilities and looks in words, as parts of scores are named."""
    looks = "1 look" if row["looks"] == 1 else f"{row['looks']} looks {row['policy']}"
    return f"live sorting, {row['grasps']} grasps, {row['part']}, {looks}"


def _tables(model: str, conditions: list[Row], runs: list[Row]) -> tuple[Table, ...]:
    scores: list[tuple[str, str, str, str, float]] = []
    for one in conditions:
        part = part_name(one)
        scores.append((model, part, "accuracy", "pooled", one["accuracy"]))
        scores.append((model, f"{part}, accepted", "share", "pooled", one["accepted"]))
        scores.append((model, f"{part}, accepted", "accuracy", "pooled", one["right"]))
    for one in runs:
        for metric, key in RUN_METRICS.items():
            scores.append((model, part_name(one), metric, f"run {one['run']}", one[key]))
    of = {"grasps": "Trained on grasps", "part": "Probabilities"}
    which = of | {"policy": "Looks", "looks": "At most"}
    shares = {"accuracy": "Accuracy", "accepted": "Accepted", "right": "Right of those"}
    told = {"wrong": "Into a wrong bin", "mean_looks": "Looks", "added_s": "Added to a sort, s"}
    ran = {"run": "Run", "before_error": "Sorted before the first error"}
    ran |= {"sorts": "Sorted by the paper's rule", "mistakes": "In a wrong bin"}
    ran |= {"sort_s": "A sort, s", "held": "Held at the stop"}
    ran |= {"first": "Most probable", "first_p": "Its probability"}
    ran |= {"second": "Next", "second_p": "Probability of the next"}
    return (
        score_table(scores, "Live sorting"),
        table_of(
            "conditions", "Decisions on new placements", conditions, **which, **shares, **told
        ),
        table_of("runs", "Runs", runs, **which, **ran),
    )


EXPERIMENT = Experiment(
    name="live_sorting",
    order=41,
    title="Live sorting",
    settings=Settings,
    measure=measure,
    figures=figures,
    tables=tables,
    paper_comparison=paper_comparison,
    by_model=True,
    kinds=("classification",),
    renders=True,
)
