"""Reflected energy: how much sound comes back, by class (paper: granular media)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any

from ajgdata.evaluate.agreement import (
    GRASP_INTERVAL,
    Interval,
    difference,
    joint_verdict,
    statement_verdict,
)
from ajgdata.evaluate.energy import band_energy, relative_energies
from ajgdata.evaluate.task_data import column_labels
from ajgdata.experiments.base import (
    Experiment,
    Inputs,
    Lookup,
    Outcome,
    TaskResults,
)
from ajgdata.experiments.built_in import BUILT_IN
from ajgdata.experiments.plots import Plot
from ajgdata.experiments.scores import ScoreKey, ScoreRow, score_table
from ajgdata.experiments.settings import ReflectedEnergySettings
from ajgdata.report.comparison import PaperComparison
from ajgdata.report.format import enumerated, number, with_unit, words
from ajgdata.types.table import Table, table_of

ENDS = {"low": "From", "high": "To"}  #: columns of the 95 % interval over grasps


def measure(inputs: Inputs, settings: ReflectedEnergySettings, _: str) -> Outcome:
    """Return the energy of each class within the band against that of the reference."""
    data = inputs.all_data()
    objects = column_labels(inputs.store, data, "object")
    energy = band_energy(data.feature, inputs.store.frequency_hz, settings.band_hz)
    metric = f"energy relative to {settings.reference}"
    scores: list[ScoreRow] = []
    classes = []
    for item in relative_energies(energy, data.value, data.group, objects, settings.reference):
        statistics = {
            "mean": item.mean,
            "sd": item.sd,
            **dict(zip(GRASP_INTERVAL, item.interval, strict=True)),
            **{f"mean of {name}": value for name, value in item.by_object.items()},
        }
        scores += [
            ScoreRow(metric, statistic, value, ScoreKey(condition=item.label))
            for statistic, value in statistics.items()
        ]
        low, high = item.interval
        classes.append(
            {
                "label": item.label,
                "grasps": item.groups,
                "mean": item.mean,
                "sd": item.sd,
                "low": low,
                "high": high,
            }
        )
    title = "Energy by class"
    titles = {"label": "Class", "grasps": "Grasps", "mean": "Mean", "sd": "Over grasps"}
    tables = score_table(scores, title), table_of("classes", title, classes, **titles, **ENDS)
    return Outcome(tables, about={"seed": None})  # the measurement has no random choice


def by_class(results: TaskResults) -> Table:
    """Return the classes without the reference, the loudest first."""
    table = results.results[0].tables["classes"]
    reference = results.settings.reference
    title = f"Energy relative to {words(reference)}"
    compared = [row | {"value": row["mean"]} for row in table.rows if row["label"] != reference]
    loudest = sorted(compared, key=lambda row: -row["mean"])
    return table_of("energy", title, loudest, label="Class", value=title, sd="Over grasps", **ENDS)


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield the losses of all classes and their order, compared with the published statement.

    The statement has a part on the order (`order` of the published value), and the part that the
    last class, and no other class, loses more than `value` per cent. Without `order`, only the
    class of lowest energy is compared.
    """
    paper = results.paper
    if paper is None or paper.value is None:
        return
    rows = {str(row["label"]): row for row in by_class(results).rows}
    order = [label for label in paper.order if label in rows]
    last = order[-1] if order else list(rows)[-1]
    losses = {label: _loss(row) for label, row in rows.items()}
    excess = {label: ends.shifted(-paper.value) for label, (_, ends) in losses.items()}
    exceeding = [label for label, gap in excess.items() if statement_verdict(gap) == "agrees"]
    verdicts = [statement_verdict(excess[last])]
    values = [f"{label} {number(losses[label][0])} %" for label in reversed(losses)]
    intervals = [
        f"{label} {number(ends.low)} to {number(ends.high)} %"
        for label, (_, ends) in reversed(losses.items())
    ]
    texts = [f"energy lost: {', '.join(values)}", f"95 % intervals: {', '.join(intervals)}"]
    for louder, quieter in pairwise(order):
        gap = difference(*losses[quieter], *losses[louder])
        verdicts.append(statement_verdict(gap))
        points = f"{number(gap.low)} to {number(gap.high)} percentage points"
        texts.append(f"{quieter} loses {points} more than {louder}")
    unnamed = [label for label in order if label != last]
    # The paper states a loss above `value` only for the last class.
    for label in unnamed:
        gap = excess[label]
        verdicts.append(statement_verdict(Interval(-gap.high, -gap.low)))
    shared = [label for label in unnamed if label in exceeding]
    if shared:
        limit = with_unit(number(paper.value), paper.unit)
        texts.append(f"{enumerated(shared)} lose more than {limit} as well")
    yield results.compared(paper, "; ".join(texts), "", joint_verdict(verdicts))


def _loss(row: Mapping[str, Any]) -> tuple[float, Interval]:
    """Return the lost share of the energy of a class in per cent, with its interval."""
    value, low, high = (100 - 100 * float(row[key]) for key in ("value", "high", "low"))
    return value, Interval(low, high)


CLASSES_PLOT = Plot(
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
    BUILT_IN["reflected_energy"],
    measure=measure,
    plots=(CLASSES_PLOT,),
    paper_comparison=paper_comparison,
)
