"""Reflected energy: how much sound comes back, by class (paper: granular media)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from pydantic import Field, model_validator

from ajgdata.evaluate.agreement import GRASP_INTERVAL, Interval, statement
from ajgdata.experiments.base import (
    Experiment,
    Inputs,
    Lookup,
    Outcome,
    TaskResults,
)
from ajgdata.experiments.plots import Plot
from ajgdata.experiments.scores import ScoreKey, ScoreRow, score_table
from ajgdata.report.comparison import PaperComparison
from ajgdata.report.format import number, words
from ajgdata.types import FeatureSettings, Kind, Strict
from ajgdata.types.table import Table, table_of

ENDS = {"low": "From", "high": "To"}  #: columns of the 95 % interval over grasps


class Settings(Strict):
    """Energy of the recordings of each class of the target, against those of one of them."""

    reference: str = Field(description="value of the target, e.g. air: the empty gripper")
    band_hz: tuple[float, float] = Field(description="frequencies that count, low to high")

    @model_validator(mode="after")
    def _ordered(self) -> Settings:
        if not 0 <= self.band_hz[0] < self.band_hz[1]:
            raise ValueError(f"band_hz {self.band_hz} must be 0 <= low < high")
        return self


def check(_: Settings, __: Kind, features: FeatureSettings) -> None:
    """Raise ValueError for features that are no energies."""
    if (features.quantity, features.normalisation) != ("power", "none"):
        raise ValueError(
            "reflected_energy needs features.quantity power and features.normalisation none"
        )


def measure(inputs: Inputs, settings: Settings, _: str) -> Outcome:
    """Return the energy of each class within the band against that of the reference."""
    from ajgdata.evaluate.energy import band_energy, relative_energies

    data, columns = inputs.all_data(), inputs.store.columns
    names = columns["recording"].values, columns["object"].values
    object_of = dict(zip(*names, strict=True))
    objects = np.array([object_of[name] for name in data.name])
    energy = band_energy(data.feature, inputs.store.frequency_hz, settings.band_hz)
    metric = f"energy relative to {settings.reference}"
    scores: list[ScoreRow] = []
    classes = []
    for item in relative_energies(energy, data.value, data.group, objects, settings.reference):
        statistics = {"mean": item.mean, "sd": item.sd}
        statistics |= dict(zip(GRASP_INTERVAL, item.interval, strict=True))
        statistics |= {f"mean of {name}": value for name, value in item.by_object.items()}
        scores += [
            ScoreRow(metric, statistic, value, ScoreKey(condition=item.label))
            for statistic, value in statistics.items()
        ]
        low, high = item.interval
        row = {"label": item.label, "grasps": item.groups, "mean": item.mean, "sd": item.sd}
        classes.append(row | {"low": low, "high": high})
    title = "Energy by class"
    titles = {"label": "Class", "grasps": "Grasps", "mean": "Mean", "sd": "Over grasps"}
    tables = score_table(scores, title), table_of("classes", title, classes, **titles, **ENDS)
    return Outcome(tables, about={"seed": None})  # nothing is drawn


def by_class(results: TaskResults) -> Table:
    """Return the classes but the reference, the loudest first."""
    table, reference = results.results[0].tables["classes"], results.settings.reference
    title = f"Energy relative to {words(reference)}"
    compared = [row | {"value": row["mean"]} for row in table.rows if row["label"] != reference]
    loudest = sorted(compared, key=lambda row: -row["mean"])
    return table_of("energy", title, loudest, label="Class", value=title, sd="Over grasps", **ENDS)


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield what the class that loses most loses against the reference: the paper says `more
    than`."""
    paper = results.paper
    if paper is None or paper.value is None:
        return
    rows = by_class(results).rows[::-1]  # what is lost is most where energy is lowest
    listed = [f"{row['label']} {number(100 - 100 * row['value'])} %" for row in rows]
    ends = (100 - 100 * rows[0][key] - paper.value for key in ("high", "low"))
    agrees = statement(Interval(*ends))
    yield results.compared(paper, f"lost: {', '.join(listed)}", "", agrees)


CLASSES = Plot(
    "rows",
    by_class,
    "energy of the recordings within the band of each class, on the same objects; it includes the "
    "direct sound from the speaker to the microphone",
    x="label",
    series=(),
    interval=("low", "high"),
    percent=("value",),
    listed=True,
)
EXPERIMENT = Experiment(
    name="reflected_energy",
    order=10,
    title="Reflected energy",
    settings=Settings,
    measure=measure,
    plots=(CLASSES,),
    paper_comparison=paper_comparison,
    check=check,
    kinds=("classification",),
)
