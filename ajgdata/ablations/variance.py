"""Where the feature's variance lies: between grippers, sessions, placements, grasps, recordings."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ajgdata.ablations.base import Ablation
from ajgdata.ablations.data import AblationData
from ajgdata.evaluate.variance_components import balanced, variance_components
from ajgdata.report.blocks import TableFigure
from ajgdata.types.table import Column, Table, Value

if TYPE_CHECKING:
    from ajgdata.report.marks import Picture

#: Data sets of the paper, of one gripper, and one whose every session is another gripper.
DATASETS = ("size", "orientation", "plate", "sphere80", "sphere30", "ycb", "grippers")
GRIPPERS = "grippers"
#: Parts of the band, Hz; materials show in the lower.
BANDS = {"whole band": (0.0, np.inf), "60 to 1,200 Hz": (60.0, 1_200.0)}
#: What varies, in the order of the bars; the first is what models read.
LEVELS = {
    "object": "objects",
    "gripper": "grippers",
    "session": "sessions",
    "object_in_session": "objects in a session",
    "grasp": "grasps",
    "recording": "recordings",
}


def measure(data: AblationData) -> list[Table]:
    """Return the components of variance of the stored features, by data set and band."""
    rows: list[dict[str, Value]] = []
    for dataset in DATASETS:
        shard = data.store(dataset)
        held = shard.columns["object"].values != ""
        names = (shard.columns[key].values[held] for key in ("object", "session_id", "grasp_id"))
        feature = balanced(shard.feature[held], *names)
        for band, (low, high) in BANDS.items():
            within = (shard.frequency_hz >= low) & (shard.frequency_hz <= high)
            found = variance_components(feature[..., within])._asdict()
            between = {"gripper": np.nan, **found}
            if dataset == GRIPPERS:
                between |= {"gripper": found["session"], "session": np.nan}
            rows.append({"dataset": dataset, "band": band, **_shares(between)})
    return [_table(rows)]


def _shares(variance: dict[str, float]) -> dict[str, Value]:
    """Percent of the sum, by level; None where it is not known."""
    total = np.nansum(list(variance.values()))
    percent = {key: 100 * variance[key] / total for key in LEVELS}
    known = {key: None if np.isnan(one) else float(one) for key, one in percent.items()}
    return {**known, "scatter": float(np.sqrt(total - variance["object"]))}


def _table(rows: list[dict[str, Value]]) -> Table:
    return Table(
        "variance",
        "Where the feature's variance lies",
        "Components of the feature's variance, summed over its bins: analysis of variance of"
        " objects and sessions, with grasps in both and recordings in grasps. Objects in a session:"
        " how it was put down, and what one session makes of one object. A session of the data set"
        f" {GRIPPERS} is another gripper. Of a data set with one recording of a grasp, grasps hold"
        " what recordings differ by. Scatter: the root of all but the object's, relative to"
        " the mean feature. Simulated: the amounts are estimates (docs/parameters.md).",
        (
            Column("dataset", "Data set"),
            Column("band", "Band"),
            *(Column(key, name.capitalize(), "%") for key, name in LEVELS.items()),
            Column("scatter", "Scatter"),
        ),
        tuple(rows),
    )


def finding(table: Table) -> str:
    """Return what of the whole band's variance lies between grasps, at least and at most, of the
    data sets whose recordings of one grasp tell it from theirs (of all, where none does)."""
    whole = next(iter(table.parted("band").values()))
    known = np.isfinite(whole.numbers("recording"))
    chosen = known if known.any() else np.full(len(known), True)
    percent = whole.numbers("grasp")[chosen]
    least, most = int(np.argmin(percent)), int(np.argmax(percent))
    names = np.array(whole.column("dataset"))[chosen]
    both = "" if known.any() else ", of one recording each,"
    return (
        f"Between grasps of one object in one session{both} lies {percent[least]:.0f} % "
        f"({names[least]}) to {percent[most]:.0f} % ({names[most]}) of the variance"
    )


def shares(table: Table) -> Picture:
    """Return the shares of the variance: a row per data set, a panel per band."""
    from ajgdata.report.study_figures import picture_of, points_of

    points = [
        point._replace(series=name)
        for key, name in LEVELS.items()
        for point in points_of(table, key, "dataset", "dataset", "band")
    ]
    axis = ("share of the variance", "%")
    return picture_of(finding(table), "of the feature", points, axis, log=False)


ABLATION = Ablation(
    "variance",
    datasets=DATASETS,
    measure=measure,
    figures=(
        TableFigure(
            "variance",
            "object",
            "rows",
            shares,
            "Shares of the variance between objects, grippers, sessions, grasps and recordings.",
        ),
    ),
)
