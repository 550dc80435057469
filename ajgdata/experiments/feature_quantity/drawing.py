"""Error against the level of noise, one line a quantity of the feature."""

from __future__ import annotations

from matplotlib.figure import Figure

from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.feature_quantity.shown import label_of_model, lines_of, places_of, shown
from ajgdata.experiments.stft_settings import error_name
from ajgdata.report.canvas import WIDTH_IN, line_style, new_figure, plain_ticks
from ajgdata.report.format import Caption, number, sentence, with_unit
from ajgdata.report.labels import label_end

TICKS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100)


def finding(results: TaskResults) -> str:
    """Return what the first model does at the loudest level with the own feature and the best."""
    model = results.settings.models[0]
    lines, level = lines_of(results, model), places_of(results)[-1][2]
    own, best = lines[0], min(lines, key=lambda line: line.errors[-1][0])
    at = with_unit(number(level.value), level.unit) if level else ""
    told = (
        f"{label_of_model(results, model)} at {at}: {shown(results, own.errors[-1])} ({own.label})"
    )
    if best is own:
        return f"{told}, least of {len(lines)}"
    return f"{told}, {shown(results, best.errors[-1])} ({best.label})"


def figure(results: TaskResults) -> Figure:
    """Return a panel for each model: error over level, logarithmic, one line a feature."""
    models, places = results.settings.models, places_of(results)
    levels = [level for *_, level in places if level]
    drawn = new_figure(
        (WIDTH_IN, 2.9 * len(models) + 0.4),
        finding(results),
        f"{results.title}: {error_name(results)}, mean ± sd over folds, never trained elsewhere",
        [results.source],
    )
    panels = drawn.subplots(len(models), 1, sharex=True, squeeze=False)[:, 0]
    for axes, model in zip(panels, models, strict=True):
        for n, line in enumerate(lines_of(results, model)):
            style = line_style(n)
            mean, sd = zip(*line.errors, strict=True)
            axes.errorbar([one.value for one in levels], mean, sd, elinewidth=0.6, **style)
            label_end(axes, levels[-1].value, mean[-1], line.label, str(style["color"]))
        unit = f" ({results.shown_unit})" if results.shown_unit else ""
        axes.set(ylabel=f"{error_name(results)}{unit}", title=label_of_model(results, model))
        if results.kind == "regression":
            axes.set_yscale("log")
            plain_ticks(axes.yaxis, TICKS)
    unit = f" ({levels[0].unit})" if levels[0].unit else ""
    panels[-1].set_xlabel(f"{levels[0].quantity}{unit}")
    return drawn


def caption(results: TaskResults) -> Caption:
    """Return the caption of `figure`."""
    places = places_of(results)
    listed = []
    for model in results.settings.models:
        for line in lines_of(results, model):
            errors = ", ".join(
                f"{shown(results, error)} at {with_unit(number(level.value), level.unit)}"
                for error, (*_, level) in zip(line.errors, places, strict=True)
                if level
            )
            listed.append(f"{label_of_model(results, model)}, {line.label}: {errors}")
    return Caption(
        f"{results.title}, {results.source}: the same recordings, folds and models; only what the "
        "feature sums differs. A sweep is at one frequency for a few frames, noise is in all of "
        "them. The default was not chosen by this.",
        f"{sentence(finding(results))}. {error_name(results)} over level. {'; '.join(listed)}.",
    )
