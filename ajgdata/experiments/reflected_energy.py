"""Reflected energy: how much sound comes back, by class (paper: granular media)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from ajgdata.experiments.base import (
    Experiment,
    Inputs,
    Lookup,
    Outcome,
    TaskResults,
    score_table,
)
from ajgdata.report.blocks import Illustration, ResultRow
from ajgdata.report.comparison import PaperComparison, agreement
from ajgdata.report.format import Caption, Score, mean_sd, number, words
from ajgdata.types import FeatureSettings, Kind, Strict
from ajgdata.types.table import table_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
    held = dict(zip(*names, strict=True))
    found = relative_energies(
        band_energy(data.feature, inputs.store.frequency_hz, settings.band_hz),
        data.value, data.group, np.array([held[name] for name in data.name]), settings.reference,
    )  # fmt: skip
    metric = f"energy relative to {settings.reference}"
    scores = []
    for one in found:
        part = f"energy:{one.label}"
        scores += [("", part, metric, name, getattr(one, name)) for name in ("mean", "sd")]
        by_object = one.by_object.items()
        scores += [("", part, metric, f"mean of {name}", value) for name, value in by_object]
    title = "Energy by class"
    grasps = ({"label": one.label, "grasps": one.groups} for one in found)
    return Outcome(
        (
            score_table(scores, title),
            table_of("classes", title, grasps, label="Class", grasps="Grasps"),
        ),
        about={"seed": None},  # nothing is drawn
    )


class ClassEnergy(NamedTuple):
    """One class: energy against that of the reference, 1 being as much; `sd` over grasps."""

    label: str
    grasps: int
    mean: float
    sd: float
    by_object: dict[str, float]


def energies(results: TaskResults) -> list[ClassEnergy]:
    """Return the reference, then the other classes, the loudest first."""
    tables, reference = results.results[0].tables, results.settings.reference
    found = []
    for row in tables["classes"].rows:
        rows = tables["scores"].where(part=f"energy:{row['label']}").rows
        values = {str(r["statistic"]): np.nan if r["value"] is None else r["value"] for r in rows}
        mean, sd = values.pop("mean"), values.pop("sd")
        objects = {name.removeprefix("mean of "): value for name, value in values.items()}
        found.append(ClassEnergy(row["label"], row["grasps"], mean, sd, objects))
    return sorted(found, key=lambda one: (one.label != reference, -one.mean))


def _percent(one: ClassEnergy) -> str:
    return mean_sd(Score(one.mean, one.sd), "%", 100)


def _decibel(one: ClassEnergy) -> str:
    return f"{10 * np.log10(one.mean):.1f}".replace("-0.0", "0.0").replace("-", "−")


def rows(results: TaskResults) -> list[ResultRow]:
    """Return a row for every class but the reference."""
    metric = f"energy, {results.settings.reference} = 100 %, over grasps"
    compared = energies(results)[1:]
    return [ResultRow(words(p.label), metric, _percent(p), paper=results.paper) for p in compared]


def figure(results: TaskResults) -> Figure:
    """Return a bar for each class with its spread over grasps, and a mark for each object."""
    from ajgdata.report.canvas import COLOURS, WIDTH_IN, new_figure

    classes, (low, high) = energies(results), results.settings.band_hz
    drawn = new_figure(
        (WIDTH_IN, 3.4),
        f"{results.title}",
        f"energy from {number(low)} to {number(high, 6)} Hz against "
        f"{words(results.settings.reference)}, mean ± sd over {max(p.grasps for p in classes)} "
        "grasps",
        [results.source],
    )
    axes, place = drawn.subplots(), np.arange(len(classes))
    mean, sd = (100 * np.array([getattr(p, key) for p in classes]) for key in ("mean", "sd"))
    whiskers = {"lw": 1, "capsize": 3, "ecolor": "#333333"}
    axes.bar(place, mean, 0.55, yerr=sd, color=COLOURS[0], alpha=0.75, error_kw=whiskers)
    for i, name in enumerate(sorted({name for part in classes for name in part.by_object})):
        here = [x for x, part in zip(place, classes, strict=True) if name in part.by_object]
        level = [100 * part.by_object[name] for part in classes if name in part.by_object]
        axes.plot(here, level, "os^Dv"[i % 5], color=COLOURS[1 + i % 5], ms=5, label=words(name))
    for x, part, top in zip(place, classes, mean + np.nan_to_num(sd), strict=True):
        text = f"{_percent(part)}\n{_decibel(part)} dB"
        axes.annotate(text, (x, top), (0, 4), textcoords="offset points", ha="center", fontsize=8)
    axes.set_xticks(place, [words(part.label) for part in classes])
    axes.grid(False, axis="x")
    axes.set_ylabel("energy (%)")
    axes.margins(y=0.2)
    axes.set_ylim(bottom=0)
    axes.legend(loc="upper right", title="mean of each object")
    return drawn


def caption(results: TaskResults) -> Caption:
    """Return the caption of `figure`."""
    compared, reference = energies(results)[1:], words(results.settings.reference)
    listed = "; ".join(f"{words(part.label)}: {_percent(part)}" for part in compared)
    lost = "; ".join(f"{words(p.label)} {number(100 * (1 - p.mean))} %" for p in compared)
    paper = f" The paper, on its real gripper: {results.paper.text}." if results.paper else ""
    return Caption(
        f"{results.title}, {results.source}: energy of the recordings, their power "
        f"spectrum summed over time and band, against the mean for {reference} on "
        f"the same object; same sweep, level and gain. It includes what goes straight from speaker "
        f"to microphone. Energy lost: {lost}.{paper}",
        f"Bars of energy relative to {reference}. {listed}.",
    )


def figures(results: TaskResults) -> list[Illustration]:
    """Return the figure of all classes."""
    return [Illustration(results.named(), caption(results), lambda: figure(results))]


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield what the class that loses most loses against the reference."""
    paper = results.paper
    if paper is None or paper.value is None:
        return
    lost = sorted(energies(results)[1:], key=lambda one: one.mean)
    score = Score(100 * (1 - lost[0].mean), 100 * lost[0].sd)
    listed = ", ".join(f"{p.label} {number(100 * (1 - p.mean))} %" for p in lost)
    yield PaperComparison(
        paper, results.dataset, results.task, results.source, f"lost: {listed}", "",
        agreement(score, paper.value, at_least=True),
    )  # fmt: skip


EXPERIMENT = Experiment(
    name="reflected_energy",
    order=10,
    title="Reflected energy",
    settings=Settings,
    measure=measure,
    figures=figures,
    rows=rows,
    paper_comparison=paper_comparison,
    check=check,
    kinds=("classification",),
)
