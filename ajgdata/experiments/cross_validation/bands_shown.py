"""What models hear in a part of the band: a figure and a table of the twins of a task."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING

from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation.bands import Band, band_label, bands_of, twins
from ajgdata.experiments.cross_validation.results import (
    GROUPED,
    OVERALL,
    RANDOM,
    ModelResult,
    best_of,
    elsewhere,
    metric_axis,
    metric_name,
    models_of,
    paper_model,
    paper_told,
)
from ajgdata.experiments.cross_validation.shown import part_label
from ajgdata.report.blocks import Illustration, ShownTable
from ajgdata.report.format import DASH, Caption, sentence

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WHOLE = "whole band"
#: Said wherever bands stand side by side.
PAPERS = "the paper's 1025 bins are the whole band, 0 to 22.05 kHz"
#: Panels side by side, those beside the paper first: parts beyond are in the table alone.
PANELS = 3
PANEL_HEIGHT_IN = 3.3


def tables(results: TaskResults) -> Iterator[ShownTable]:
    """Yield the metric of every model on every part, from the whole band and from parts of it."""
    bands = bands_of(results)
    if not bands:
        return
    rows = []
    for model in models_of(results):
        for part in _parts(model):
            told = {band: model.shown(score) for band, score in twins(model, part)}
            cells = (told.get(band, DASH) for band in bands)
            rows.append(
                (model.label, _named(results, part), model.shown(model.score(part)), *cells)
            )
    yield ShownTable(
        "The same recordings, folds and models; the feature's bins within the band alone, "
        f"normalised again; {PAPERS}.",
        ("Model", "Tested on", f"{WHOLE.capitalize()}|", *(f"{band_label(b)}|" for b in bands)),
        tuple(rows),
        "From parts of the band alone",
    )


def _parts(model: ModelResult) -> list[str]:
    """Return what stands side by side; a split by recording stands beside the paper alone."""
    return [part for part, _ in model.parts if part != RANDOM]


def _named(results: TaskResults, part: str) -> str:
    if part == GROUPED:
        return f"{results.groups.removesuffix('_id')} held out"
    return part_label(results, part)


def illustrations(results: TaskResults) -> Iterator[Illustration]:
    """Yield the figure of the twins, if there are any."""
    models = models_of(results)
    if bands_of(results) and models:
        yield Illustration(results.named("bands"), _caption(results), partial(figure, results))


def finding(results: TaskResults) -> str:
    """Return what the paper's model, or else the best, reads from each band; of a task with one
    other data set, there as well."""
    models = models_of(results)
    model = paper_model(results) or best_of(models)
    parts = [GROUPED] + [elsewhere(n) for n in model.tested_on if len(model.tested_on) == 1]
    said = [_told(model, part) for part in parts]
    where = f"; {part_label(results, parts[1])}: {said[1]}" if len(parts) > 1 else ""
    return f"{model.label}: {said[0]}{where}"


def _told(model: ModelResult, part: str) -> str:
    whole = f"{model.shown(model.score(part))} from the whole band"
    found = [f"{model.shown(score)} from {band_label(band)}" for band, score in twins(model, part)]
    return ", ".join([whole, *found])


def figure(results: TaskResults) -> Figure:
    """Return the metric of each model from the whole band and from each part of it."""
    from ajgdata.report.canvas import WIDTH_IN, new_figure

    models, bands = models_of(results), bands_of(results)
    papers = dict(models[0].parts)
    parts = sorted(
        _parts(models[0]), key=lambda part: (part != GROUPED, papers[part] is None, part == OVERALL)
    )[:PANELS]
    drawn = new_figure(
        (WIDTH_IN, PANEL_HEIGHT_IN),
        finding(results),
        f"{results.title}: {metric_name(results)}, mean ± sd over {models[0].count('folds')} folds",
        [results.source],
    )
    panels = drawn.subplots(1, len(parts), sharey=True, squeeze=False)[0]
    for axes, part in zip(panels, parts, strict=True):
        _panel(axes, models, part, bands, last=axes is panels[-1])
    panels[0].set_ylabel(metric_axis(results))
    panels[0].set_ylim(bottom=0)
    return drawn


def _panel(
    axes: Axes, models: Sequence[ModelResult], part: str, bands: Sequence[Band], last: bool
) -> None:
    from ajgdata.report.canvas import WIDTH_IN, model_line
    from ajgdata.report.labels import LABEL_PT, REFERENCES, label_end, reference_line, wrapped

    results, scale = models[0].task, models[0].task.scale
    for i, model in enumerate(models):
        scores = [model.score(part), *(score for _, score in twins(model, part))]
        at = [n + 0.06 * (i - (len(models) - 1) / 2) for n in range(len(scores))]
        mean = [scale * score.mean for score in scores]
        sd = [scale * score.sd for score in scores]
        axes.errorbar(at, mean, sd, capsize=2.5, label=model.label, **model_line(i))
        if last:
            label_end(axes, at[-1], mean[-1], model.label, str(model_line(i)["color"]))
    chance, told = scale * models[0].chance(part), paper_told(models[0], part)
    if last and math.isfinite(chance):
        reference_line(axes, "chance", chance, "chance")
    elif math.isfinite(chance):
        axes.axhline(chance, **REFERENCES["chance"])
    if told:
        axes.axhline(told[0], **REFERENCES["paper"])
        axes.annotate("the paper", (0, told[0]), (2, 2), xycoords=("axes fraction", "data"),
                      textcoords="offset points", fontsize=LABEL_PT)  # fmt: skip
    width = (WIDTH_IN - 2) / PANELS
    names = (WHOLE, *map(band_label, bands))
    axes.set_xticks(
        range(len(names)), ["\n".join(wrapped(name, 0.8 * width / len(names), 7)) for name in names]
    )
    axes.set_title("\n".join(wrapped(_named(results, part), width, LABEL_PT)), fontsize=LABEL_PT)
    axes.margins(x=0.12)


def _caption(results: TaskResults) -> Caption:
    listed = "; ".join(
        f"{model.label}: {model.shown(model.score(GROUPED))} ({WHOLE}), "
        + ", ".join(f"{model.shown(s)} ({band_label(b)})" for b, s in twins(model, GROUPED))
        for model in models_of(results)
    )
    return Caption(
        f"{results.title}: {metric_name(results)} of the same models on the same folds, from the "
        "whole band and from the bins of a part of it alone, normalised again. "
        f"{sentence(PAPERS)}; dotted: chance. Lines join a model's marks and mean nothing between.",
        f"{sentence(finding(results))}. {metric_name(results)} by band. {listed}.",
    )
