"""Reflected energy: how much sound comes back, by class (paper: granular media)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from ajgdata.evaluate.agreement import GRASP_INTERVAL, Interval, statement
from ajgdata.experiments.base import (
    Experiment,
    Inputs,
    Lookup,
    Outcome,
    TaskResults,
    score_table,
)
from ajgdata.report.blocks import Illustration, ResultRow
from ajgdata.report.comparison import Mark, PaperComparison, mark_of
from ajgdata.report.format import Caption, Score, mean_sd, number, sentence, words
from ajgdata.types import FeatureSettings, Kind, Strict
from ajgdata.types.table import table_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ajgdata.evaluate.energy import RelativeEnergy

#: Energies (%) that are ticks.
TICKS_PERCENT = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500)
#: Frequencies (Hz) that are ticks.
TICKS_HZ = (63, 125, 250, 500, 1_000, 2_000, 4_000, 8_000, 16_000)


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
    from ajgdata.evaluate.energy import band_energy, relative_energies, third_octave_bands

    data, columns = inputs.all_data(), inputs.store.columns
    names = columns["recording"].values, columns["object"].values
    held = dict(zip(*names, strict=True))
    objects = np.array([held[name] for name in data.name])

    def within(band_hz: tuple[float, float]) -> list[RelativeEnergy]:
        energy = band_energy(data.feature, inputs.store.frequency_hz, band_hz)
        return relative_energies(energy, data.value, data.group, objects, settings.reference)

    found = within(settings.band_hz)
    bands = [
        {"label": one.label, "centre_hz": centre_hz, "mean": one.mean, "sd": one.sd}
        for centre_hz, band_hz in third_octave_bands(inputs.store.frequency_hz)
        for one in within(band_hz)
    ]
    metric = f"energy relative to {settings.reference}"
    scores = []
    for one in found:
        part = f"energy:{one.label}"
        scores += [("", part, metric, name, getattr(one, name)) for name in ("mean", "sd")]
        ends = zip(GRASP_INTERVAL, one.interval, strict=True)
        scores += [("", part, metric, name, end) for name, end in ends]
        by_object = one.by_object.items()
        scores += [("", part, metric, f"mean of {name}", value) for name, value in by_object]
    title = "Energy by class"
    grasps = ({"label": one.label, "grasps": one.groups} for one in found)
    return Outcome(
        (
            score_table(scores, title),
            table_of("classes", title, grasps, label="Class", grasps="Grasps"),
            table_of(
                "bands",
                f"{metric}, by third octave",
                bands,
                label="Class",
                centre_hz="Third octave at, Hz",
                mean="Mean",
                sd="Over grasps",
            ),
        ),
        about={"seed": None},  # nothing is drawn
    )


class ClassEnergy(NamedTuple):
    """One class: energy relative to the reference; `sd` and 95 % `interval` are over grasps."""

    label: str
    grasps: int
    mean: float
    sd: float
    interval: Interval
    by_object: dict[str, float]


def energies(results: TaskResults) -> list[ClassEnergy]:
    """Return the reference, then the other classes, the loudest first."""
    tables, reference = results.results[0].tables, results.settings.reference
    found = []
    for row in tables["classes"].rows:
        rows = tables["scores"].where(part=f"energy:{row['label']}").rows
        values = {str(r["statistic"]): np.nan if r["value"] is None else r["value"] for r in rows}
        mean, sd, *ends = (values.pop(name, np.nan) for name in ("mean", "sd", *GRASP_INTERVAL))
        objects = {name.removeprefix("mean of "): value for name, value in values.items()}
        found.append(ClassEnergy(row["label"], row["grasps"], mean, sd, Interval(*ends), objects))
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


def finding(results: TaskResults) -> str:
    """Return what the class that loses most still returns, in a few words."""
    reference, *others = energies(results)
    if not others:
        return f"Energy of {words(reference.label)}"
    least = others[-1]
    return (
        f"{words(least.label)} returns {_percent(least)} of the energy that "
        f"{words(reference.label)} does ({_decibel(least)} dB)"
    )


def figure(results: TaskResults) -> Figure:
    """Return a row for each class with its spread over grasps, and a mark for each object."""
    from ajgdata.report.canvas import COLOURS, WIDTH_IN, new_figure, plain_ticks
    from ajgdata.report.labels import LABEL_PT, reference_line

    classes, (low, high) = energies(results), results.settings.band_hz
    drawn = new_figure(
        (WIDTH_IN, 1.6 + 0.45 * len(classes)),
        finding(results),
        f"{results.title}: energy from {number(low)} to {number(high, 6)} Hz, mean ± sd over "
        f"{max(p.grasps for p in classes)} grasps",
        [results.source],
    )
    axes = drawn.subplots()
    for row, part in enumerate(classes):
        sd = 100 * np.nan_to_num(part.sd)
        style: dict[str, Any] = {"color": COLOURS[0], "ms": 7, "capsize": 3}
        axes.errorbar(100 * part.mean, row, xerr=sd, fmt="o", **style)
        axes.annotate(
            f"{_percent(part)}\n{_decibel(part)} dB", (1, row), (6, 0), va="center",
            xycoords=("axes fraction", "data"), textcoords="offset points", fontsize=LABEL_PT,
        )  # fmt: skip
    _objects(axes, classes)
    if results.paper is not None and results.paper.value is not None:
        least = f"the paper: {words(classes[-1].label)} at most {100 - results.paper.value:g} %"
        reference_line(axes, "paper", 100 - results.paper.value, least, "x")
    axes.set_yticks(range(len(classes)), [words(part.label) for part in classes])
    axes.set_ylim(len(classes) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0)
    axes.set(xscale="log", xlabel=f"energy (%), {words(results.settings.reference)} = 100")
    plain_ticks(axes.xaxis, TICKS_PERCENT)
    return drawn


def _objects(axes: Axes, classes: list[ClassEnergy]) -> None:
    """Draw the mean of each object below that of all, and name the objects."""
    from ajgdata.report.canvas import GREY, MARKERS

    for i, name in enumerate(sorted({name for part in classes for name in part.by_object})):
        here = [row for row, part in enumerate(classes) if name in part.by_object]
        level = [100 * classes[row].by_object[name] for row in here]
        style: dict[str, Any] = {"ls": "", "mfc": "white", "mec": GREY, "ms": 5}
        marker = MARKERS[(i + 1) % len(MARKERS)]
        place = np.array(here) + 0.24
        axes.plot(level, place, marker, label=words(name), zorder=1.9, **style)
    if axes.get_legend_handles_labels()[1]:
        axes.legend(loc="upper left", title="mean of each object")


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
        f"{sentence(finding(results))}. Energy relative to {reference}: {listed}.",
    )


class BandEnergy(NamedTuple):
    """One class by third octave: centres (Hz), energy against the reference, sd over grasps."""

    label: str
    centre_hz: np.ndarray
    mean: np.ndarray
    sd: np.ndarray


def band_energies(results: TaskResults) -> list[BandEnergy]:
    """Return the classes but the reference, in the order of `energies`."""
    table = results.results[0].tables["bands"]
    found = []
    for one in energies(results)[1:]:
        rows = table.where(label=one.label).rows
        columns = (np.array([row[key] for row in rows], float) for key in BandEnergy._fields[1:])
        found.append(BandEnergy(one.label, *columns))
    return found


def band_finding(results: TaskResults) -> str:
    """Return which classes return more than the reference in some third octave, and where most."""
    reference = words(results.settings.reference)
    most = max(band_energies(results), key=lambda one: one.mean.max(), default=None)
    if most is None or most.mean.max() <= 1:
        return f"No third octave in which more comes back than of {reference}"
    at = int(most.mean.argmax())
    return (
        f"At {number(most.centre_hz[at])} Hz {words(most.label)} returns "
        f"{number(most.mean[at])} times the energy of {reference}"
    )


def band_figure(results: TaskResults) -> Figure:
    """Return a curve over frequency for each class; the reference is the line at 0 dB."""
    from ajgdata.report.canvas import COLOURS, MARKERS, WIDTH_IN, new_figure, plain_ticks

    reference = words(results.settings.reference)
    drawn = new_figure(
        (WIDTH_IN, 3.6),
        band_finding(results),
        f"{results.title}: energy by third octave, mean ± sd over grasps",
        [results.source],
    )
    axes = drawn.subplots()
    for i, one in enumerate(band_energies(results)):
        mean, sd = 10 * np.log10(one.mean), np.nan_to_num(one.sd) / one.mean
        colour = COLOURS[(i + 1) % len(COLOURS)]
        axes.plot(
            one.centre_hz, mean, color=colour, marker=MARKERS[i % len(MARKERS)], ms=4,
            label=words(one.label),
        )  # fmt: skip
        spread = 10 * np.log10(1 + sd)
        axes.fill_between(one.centre_hz, mean - spread, mean + spread, color=colour, alpha=0.15)
    axes.axhline(0, color="k", lw=0.8)
    axes.set(xscale="log", xlabel="third octave (Hz)", ylabel=f"energy (dB), {reference} = 0")
    plain_ticks(axes.xaxis, TICKS_HZ)
    axes.legend(loc="upper right")
    return drawn


def band_caption(results: TaskResults) -> Caption:
    """Return the caption of `band_figure`."""
    reference = words(results.settings.reference)
    crossing = "; ".join(
        f"{words(one.label)}: more than {reference} in {int((one.mean > 1).sum())} of "
        f"{len(one.mean)} third octaves"
        for one in band_energies(results)
    )
    return Caption(
        f"{results.title}, {results.source}: the same energy by third octave, each against "
        f"{reference} on the same object. {crossing}. Bands: one standard deviation over "
        "grasps above, and as many dB below.",
        f"{sentence(band_finding(results))}. {crossing}.",
    )


def figures(results: TaskResults) -> list[Illustration]:
    """Return the figure of all classes, and that by third octave."""
    return [
        Illustration(results.named(), caption(results), lambda: figure(results)),
        Illustration(results.named("bands"), band_caption(results), lambda: band_figure(results)),
    ]


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield what the class that loses most loses against the reference: the paper says `more
    than`."""
    paper = results.paper
    if paper is None or paper.value is None:
        return
    lost = sorted(energies(results)[1:], key=lambda one: one.mean)
    most = lost[0].interval.scaled(100)
    listed = ", ".join(f"{p.label} {number(100 * (1 - p.mean))} %" for p in lost)
    yield PaperComparison(
        paper, results.dataset, results.task, results.source, f"lost: {listed}", "",
        statement(Interval(100 - most.high - paper.value, 100 - most.low - paper.value)),
        marks=tuple(_marks(lost, paper.value)),
    )  # fmt: skip


def _marks(lost: list[ClassEnergy], paper: float) -> Iterator[Mark]:
    """Yield what each class loses, and what the one that loses most loses in the paper."""
    for one in lost:
        ends = one.interval.scaled(100)
        score = Score(100 * (1 - one.mean), 100 * one.sd, (), 100 - ends.high, 100 - ends.low)
        yield mark_of("ours", "lost", score, part=words(one.label))
    yield mark_of("paper", "paper >", Score(paper, 0.0), part=words(lost[0].label))


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
