"""Repeatability: distances between spectra within a grasp, and between grasps."""

from typing import Literal

import numpy as np
from pydantic import Field
from scipy.spatial.distance import cdist

from ajgdata.experiments.base import Experiment, Inputs, Outcome
from ajgdata.experiments.plots import Plot
from ajgdata.experiments.scores import ScoreKey, ScoreRow, score_table
from ajgdata.experiments.spec import ExperimentSpec
from ajgdata.types import Strict
from ajgdata.types.table import table_of


class Settings(Strict):
    """Keys under `experiments: {repeatability: ...}` in a task of dataset.yaml."""

    distance: Literal["euclidean", "cityblock"] = Field("euclidean", description="of two spectra")


def measure(inputs: Inputs, settings: Settings, _: str) -> Outcome:
    """Return the mean distance of pairs of recordings: same grasp, same label, other label."""
    data = inputs.data()  # feature (n, n_features), value (n,) and group (n,)
    distances = cdist(data.feature, data.feature, settings.distance)
    same_grasp = data.group[:, None] == data.group
    same_label = data.value[:, None] == data.value
    pairs = {
        "same grasp": same_grasp & ~np.eye(len(data.group), dtype=bool),
        "same label, other grasp": same_label & ~same_grasp,
        "other label": ~same_label,
    }
    means = {name: float(distances[mask].mean()) for name, mask in pairs.items() if mask.any()}
    scores = [
        ScoreRow("distance", "mean", mean, ScoreKey(condition=name)) for name, mean in means.items()
    ]
    rows = [{"pairs": name, "distance": mean} for name, mean in means.items()]
    table = table_of("pairs", "Repeatability", rows, pairs="Pairs", distance="Distance")
    return Outcome((score_table(scores, "Repeatability"), table))


PAIRS = Plot(
    "rows",
    "pairs",
    "mean distance between the spectra of two recordings",
    value="distance",
    x="pairs",
    series=(),
    listed=True,
)
EXPERIMENT = Experiment(
    ExperimentSpec(name="repeatability", title="Repeatability", settings=Settings),
    measure=measure,
    plots=(PAIRS,),
)
