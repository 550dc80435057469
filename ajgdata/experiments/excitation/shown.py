"""Results of the experiment on excitations: read back, and as figures, tables and words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ajgdata.experiments.base import SCORES, TaskResults
from ajgdata.report.blocks import Illustration, ShownTable
from ajgdata.report.comparison import mark_of, range_of
from ajgdata.report.format import Caption, Score, mean_sd, number, sentence, with_unit
from ajgdata.report.panel import Highlight
from ajgdata.types import DEFAULT_EXCITATION, ExcitationKind
from ajgdata.types.table import Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Where speaker and microphone answer, and where the error of a recovered response is taken.
BAND_HZ = (100.0, 16_000.0)
NAMES: dict[ExcitationKind, str] = {
    "log_sweep": "log sweep",
    "linear_sweep": "linear sweep",
    "multitone": "multitone",
    "mls": "MLS",
    "chirp_train": "chirp train",
}
REFERENCE = DEFAULT_EXCITATION


class Point(NamedTuple):
    """One excitation: the error of each model over folds (mean, sd), and that of its response."""

    kind: ExcitationKind
    length_s: float
    crest_db: float
    recovered_db: float
    worst_db: float
    feature_ms: float
    errors: tuple[Score, ...]  #: NaN where a model was not evaluated with it

    @property
    def label(self) -> str:
        """Return kind and length in short."""
        return f"{NAMES[self.kind]} of {self.length_s:g} s"


def points_of(results: TaskResults) -> list[Point]:
    """Return what was tried, the paper's sweep first."""
    (result,) = results.results
    scores, costs, points = result.tables[SCORES], result.cost[SCORES], []
    for row in result.tables["excitations"].rows:
        of = scores.where(part=row["part"], metric=results.metric)
        cost = costs.where(part=f"cost of {row['part']}", metric="feature_s_per_recording")
        errors = (_error(results, of.where(model=model)) for model in results.settings.models)
        points.append(
            Point(
                row["kind"], row["length_s"], row["crest_db"], row["recovered_db"],
                row["worst_db"], 1e3 * float(cost.numbers("value")[0]), tuple(errors),
            )
        )  # fmt: skip
    return points


def _error(results: TaskResults, scores: Table, statistic: str = "mean") -> Score:
    if not scores.rows:
        return Score(np.nan, np.nan)
    value, sd = (scores.where(statistic=s).numbers("value")[0] for s in (statistic, "sd"))
    wrong = results.kind == "classification"
    return Score(100 * (1 - value), 100 * sd) if wrong else Score(float(value), float(sd))


def _error_name(results: TaskResults) -> str:
    return "share that is wrong" if results.kind == "classification" else "RMSE"


def _labels(results: TaskResults) -> list[str]:
    from ajgdata.models import model_label

    return [model_label(model, results.kind) for model in results.settings.models]


def errors_at(points: list[Point], model: int, length_s: float) -> list[Score]:
    """Return the errors of a model with all kinds of one length."""
    errors = [point.errors[model] for point in points if point.length_s == length_s]
    return [error for error in errors if np.isfinite(error.mean)]


def _range(results: TaskResults, errors: list[Score]) -> str:
    """Return `20 to 24 %`: the errors of all kinds of one length."""
    low, high = (number(f(error.mean for error in errors)) for f in (min, max))
    return with_unit(low if low == high else f"{low} to {high}", results.shown_unit)


def _shortest(points: list[Point], model: int) -> float:
    """Return the shortest length that a model was evaluated with."""
    return min(p.length_s for p in points if np.isfinite(p.errors[model].mean))


def _crest(point: Point) -> str:
    return number(round(abs(point.crest_db), 1))


def finding(results: TaskResults, model: int) -> str:
    """Return the range of a model's errors with all kinds of the shortest length."""
    points, label = points_of(results), _labels(results)[model]
    length_s = _shortest(points, model)
    errors, first = errors_at(points, model, length_s), points[0].errors[model]
    kinds = f"{len(errors)} kind{'s' * (len(errors) > 1)}"
    return (
        f"Exploratory: {label} {_error_name(results)} {_range(results, errors)} with {kinds} of "
        f"{length_s:g} s, {_range(results, [first])} with the paper's sweep"
    )


def highlights(results: TaskResults) -> list[Highlight]:
    """Return the range of the first model's errors with the shortest excitations."""
    points = points_of(results)
    length_s = _shortest(points, 0)
    errors = errors_at(points, 0, length_s)
    if length_s >= REFERENCE.length_s:
        return []
    marks = (
        range_of("ours", f"{length_s:g} s", [error.mean for error in errors]),
        mark_of("other", f"{REFERENCE.length_s:g} s", points[0].errors[0]),
    )
    text = f"{_error_name(results)}, range of {len(errors)} kinds, exploratory"
    return [Highlight("Shorter sound", text, results.shown_unit, marks)]


def figure(results: TaskResults) -> Figure:
    """Return a panel for each model: its error over the length of what is played, by kind."""
    from ajgdata.report.canvas import WIDTH_IN, new_figure

    drawn = new_figure(
        (WIDTH_IN, 3.9),
        finding(results, 0),
        f"{results.title}: error against acquisition time at one peak level; mean ± sd over folds "
        "(grey: the paper's sweep)",
        [results.source],
    )
    labels, points = _labels(results), points_of(results)
    panels = drawn.subplots(1, len(labels), sharey=True, squeeze=False)[0]
    errors = [{(p.kind, p.length_s): p.errors[n] for p in points} for n in range(len(labels))]
    for axes, of, label in zip(panels, errors, labels, strict=True):
        _lines(axes, results, of)
        axes.set_title(label)
    for axes, of in zip(panels, errors, strict=True):
        _names(axes, results, of)
    unit = f" ({results.shown_unit})" if results.shown_unit else ""
    panels[0].set_ylabel(f"{_error_name(results)}{unit}")
    return drawn


def response_figure(results: TaskResults) -> Figure:
    """Return the error of recovered responses over the length of what is played, by kind."""
    from ajgdata.report.canvas import WIDTH_IN, new_figure

    points = points_of(results)
    drawn = new_figure(
        (0.75 * WIDTH_IN, 3.6),
        _response_finding(points),
        f"{results.dataset_title}: error of the transfer function, {BAND_HZ[0]:g} to "
        f"{number(BAND_HZ[1], 5)} Hz; median",
        [results.source],
    )
    axes = drawn.subplots()
    of = {(p.kind, p.length_s): Score(p.recovered_db, 0) for p in points}
    _lines(axes, results, of)
    _names(axes, results, of)
    axes.set_ylabel("error (dB)")
    return drawn


def _response_finding(points: list[Point]) -> str:
    """Return the range of the errors of recovered responses."""
    low, high = (number(f(p.recovered_db for p in points)) for f in (min, max))
    return f"Error of the recovered response: {low} to {high} dB for {len(points)} excitations"


Errors = dict[tuple[ExcitationKind, float], Score]


def _lines(axes: Axes, results: TaskResults, of: Errors) -> None:
    """Draw a line a kind, a square round the paper's sweep, and a band of its deviation."""
    from ajgdata.report.canvas import GREY, line_style, plain_ticks

    for n, kind in enumerate(results.settings.kinds):
        x, mean, sd = _line(results, of, kind)
        style = line_style(n)
        axes.vlines(x, mean - sd, mean + sd, color=style["color"], lw=0.7, alpha=0.4)
        axes.plot(x, mean, **style)
    first = of[REFERENCE.kind, REFERENCE.length_s]
    if first.sd > 0:
        axes.axhspan(first.mean - first.sd, first.mean + first.sd, color=GREY, alpha=0.1, lw=0)
    place: dict[str, Any] = {"mfc": "none", "mec": "black", "ms": 10, "zorder": 5}
    axes.plot(REFERENCE.length_s, first.mean, "s", **place)
    near: dict[str, Any] = {"textcoords": "offset points", "fontsize": 7}
    at = REFERENCE.length_s, first.mean
    axes.annotate("paper", at, (0, 9), ha="center", va="bottom", **near)
    axes.set(xscale="log", xlabel="length of the excitation (s)")
    axes.set_xlim(0.85 * min(length for _, length in of), 9)
    axes.margins(y=0.08)
    plain_ticks(axes.xaxis, sorted({length for _, length in of}))


def _line(
    results: TaskResults, of: Errors, kind: ExcitationKind
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return places on the axis, beside those of the other kinds, mean and deviation (n,), of what
    was evaluated."""
    kinds = results.settings.kinds
    found = sorted((n, *e[:2]) for (other, n), e in of.items() if other == kind)
    lengths, mean, sd = np.array([one for one in found if np.isfinite(one[1])]).reshape(-1, 3).T
    return lengths * 1.025 ** (kinds.index(kind) - len(kinds) // 2), mean, sd


def _names(axes: Axes, results: TaskResults, of: Errors) -> None:
    """Name the line of each kind in the legend."""
    from ajgdata.report.canvas import line_style
    from ajgdata.report.labels import label_end

    for n, kind in enumerate(results.settings.kinds):
        x, mean, _ = _line(results, of, kind)
        if len(x):
            label_end(axes, float(x[-1]), float(mean[-1]), NAMES[kind], line_style(n)["color"])


def caption(results: TaskResults) -> Caption:
    """Return the caption of `figure`."""
    points, unit, lines = points_of(results), results.shown_unit, []
    for model, label in enumerate(_labels(results)):
        lengths = sorted({point.length_s for point in points})
        ranges = ", ".join(
            f"{_range(results, errors)} with {len(errors)} of {length_s:g} s"
            for length_s in lengths
            if (errors := errors_at(points, model, length_s))
        )
        lines.append(
            f"{label}: {mean_sd(points[0].errors[model], unit)} with the paper's "
            f"{points[0].label}; by kinds {ranges}"
        )
    scores = results.results[0].tables[SCORES].where(metric=results.metric)
    chance = _error(results, scores.where(model=results.settings.models[0]), "chance").mean
    listed = "; ".join(lines)
    crest = ", ".join(
        f"{NAMES[p.kind]} {_crest(p)} dB" for p in points if p.length_s == REFERENCE.length_s
    )
    return Caption(
        f"{results.title}, {results.source}: the same grasps, noise and folds, recorded with other "
        f"sounds of the same peak level ({REFERENCE.level_dbfs:.2f} dBFS). {listed}; chance: "
        f"{with_unit(number(chance), unit)}. Crest factors: {crest}: the lower, the more energy in "
        "the same time. Exploratory: the ranges are over all kinds, because the best of many that "
        "is chosen on these folds would be optimistically biased.",
        f"{sentence(finding(results, 0))}. {_error_name(results).capitalize()} over the length "
        f"of the excitation. {listed}.",
    )


def response_caption(results: TaskResults) -> Caption:
    """Return the caption of `response_figure`."""
    points = points_of(results)
    listed = ", ".join(
        f"{p.label} {number(p.recovered_db)} dB" for p in points if p.length_s in (0.1, 1.0)
    )
    return Caption(
        f"{results.dataset_title}, {results.source}: the transfer function recovered from a "
        f"recording (regularised least squares) against the scene's own, over "
        f"{results.settings.responses} recordings: {listed}. A logarithmic sweep that is short "
        "ends while its highest frequencies still sound: what was not heard is not recovered.",
        f"{_response_finding(points)}. Error over the length of the excitation: {listed}.",
    )


def figures(results: TaskResults) -> list[Illustration]:
    """Return errors of models, and of recovered responses."""
    return [
        Illustration(results.named(), caption(results), lambda: figure(results)),
        Illustration(
            results.named("response"), response_caption(results), lambda: response_figure(results)
        ),
    ]


def tables(results: TaskResults) -> list[ShownTable]:
    """Return every excitation with its errors."""
    unit = f" in {results.shown_unit}" if results.shown_unit else ""
    name = "Share that is wrong" if results.kind == "classification" else "RMSE"
    models = (f"{label}|" for label in _labels(results))
    heads = ("Excitation", "Length, s|", "Crest factor, dB|", "ms a feature|", *models)
    heads += ("Response, dB|", "Largest, dB|")
    rows = tuple(
        (
            NAMES[p.kind], f"{p.length_s:g}", _crest(p), number(p.feature_ms),
            *(mean_sd(error) for error in p.errors), number(p.recovered_db), number(p.worst_db),
        )
        for p in sorted(points_of(results), key=lambda p: (list(NAMES).index(p.kind), p.length_s))
    )  # fmt: skip
    told = (
        f"{name}{unit}, mean ± sd over folds; error of the recovered response against the true one "
        f"from {BAND_HZ[0]:g} Hz to {BAND_HZ[1]:g} Hz, median and largest."
    )
    return [ShownTable(told, heads, rows, folded="Every excitation")]
