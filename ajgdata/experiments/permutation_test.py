"""Permutation test: whether a model does better than chance (paper: 30 mm spheres near chance)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import Field

from ajgdata.experiments.base import (
    METRIC_NAMES,
    Experiment,
    Inputs,
    Lookup,
    Outcome,
    TaskResults,
    score_table,
)
from ajgdata.experiments.cross_validation.results import (
    models_of,
    paper_model,
)
from ajgdata.experiments.cross_validation.shown import marks_of
from ajgdata.report.blocks import Illustration
from ajgdata.report.comparison import NEAR_CHANCE, PaperComparison
from ajgdata.report.format import Caption, number, sentence, with_unit
from ajgdata.types import CROSS_VALIDATION, Strict
from ajgdata.types.table import table_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Hundreds of times trained: of the models that train at once, the better one on ycb's inner folds
#: (docs/models.md).
MODEL = "ridge_plain"
LEVEL = 0.05  #: of significance


class Settings(Strict):
    """Test against chance with permuted labels."""

    permutations: int = Field(ge=1, description="labels permuted so often")


def measure(inputs: Inputs, settings: Settings, _: str) -> Outcome:
    """Return the metric of all held-out predictions with true labels, and with permuted ones."""
    from ajgdata.evaluate.permutations import permutation_test

    data = inputs.data()
    found = permutation_test(
        data.feature, data.value, data.group,
        model=MODEL, permutations=settings.permutations, **inputs.split,
    )  # fmt: skip
    scores = [
        (MODEL, "permutations", found.metric, "pooled", found.value),
        (MODEL, "permutations", "p", f"of {len(found.null)}", found.p),
    ]
    title = "Test against chance"
    null = ({"permutation": n, "value": value} for n, value in enumerate(found.null))
    return Outcome(
        (
            score_table(scores, title),
            table_of("null", title, null, permutation="Permutation", value="Value"),
        ),
        about={"model": MODEL},
    )


def tested(results: TaskResults) -> tuple[float, float, np.ndarray]:
    """Return p, corrected for all tests on the page, the metric with true labels, and that with
    permuted ones (n,), as shown."""
    tables = results.results[0].tables
    (p,) = results.corrected(p_values(results))
    value = tables["scores"].where(metric=results.metric).numbers("value")[0]
    return p, results.scale * value, results.scale * tables["null"].numbers("value")


def p_values(results: TaskResults) -> list[float]:
    """Return the p value of the test, without correction."""
    scores = results.results[0].tables["scores"]
    return [float(scores.where(metric="p").numbers("value")[0])]


def verdict(results: TaskResults) -> str:
    """Return the result of the test in a sentence."""
    p, value, null = tested(results)
    reached, by_chance = (with_unit(number(x), results.shown_unit) for x in (value, null.mean()))
    differs = "differs" if p < LEVEL else "is not distinguishable"
    count = results.tests_on_page(p_values(results))
    family = f" (corrected for the {count} tests on this page, Holm)" if count > 1 else ""
    return (
        f"Permutation test: {METRIC_NAMES[results.metric]} of {results.results[0].label}, all "
        f"held-out predictions together, is {reached}; with labels exchanged between groups it is "
        f"{by_chance} on average of {len(null)}; p = {number(p, 2)}{family}: it {differs} from "
        f"chance at {100 * LEVEL:g} %."
    )


def finding(results: TaskResults) -> str:
    """Return whether the model differs from chance, in a few words."""
    p, value, null = tested(results)
    reached, by_chance = (with_unit(number(x), results.shown_unit) for x in (value, null.mean()))
    differs = "differs from chance" if p < LEVEL else "is not distinguishable from chance"
    return (
        f"{results.results[0].label} {differs}: {METRIC_NAMES[results.metric]} {reached}, "
        f"with labels exchanged {by_chance} (p = {number(p, 2)})"
    )


def figure(results: TaskResults) -> Figure:
    """Return what the model reaches, among what it reaches with labels exchanged between groups."""
    from ajgdata.report.canvas import COLOURS, WIDTH_IN, new_figure
    from ajgdata.report.labels import GREY, LABEL_PT, REFERENCES, ink

    _, value, null = tested(results)
    drawn = new_figure(
        (WIDTH_IN, 2.6),
        finding(results),
        f"{results.title}: {len(null)} times labels exchanged between groups",
        [results.source],
    )
    axes = drawn.subplots()
    axes.hist(null, bins="fd", color=COLOURS[4], ec="white", label="labels exchanged")
    axes.axvline(null.mean(), label="their mean", **REFERENCES["ideal"])
    axes.axvline(value, color=COLOURS[1], lw=2, label="true labels")
    above: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "fontsize": LABEL_PT}
    above |= {"textcoords": "offset points", "va": "bottom"}
    left = value < null.mean()
    for at, name, colour, here in (
        (null.mean(), "labels exchanged, mean", GREY, not left),
        (value, "true labels", ink(COLOURS[1]), left),
    ):
        side: dict[str, Any] = {"ha": "right" if here else "left", "color": colour}
        axes.annotate(name, (at, 1), (-2 if here else 2, 1), **above, **side)
    axes.margins(x=0.12)
    axes.set_xlabel(f"{METRIC_NAMES[results.metric]} ({results.shown_unit})")
    axes.set_ylabel("permutations")
    return drawn


def caption(results: TaskResults) -> Caption:
    """Return the caption of `figure`."""
    text = verdict(results)
    return Caption(
        f"{results.title}, {results.source}: whole groups (grasps) exchange their labels, "
        f"folds are made anew and the model is trained and tested again. {text}",
        f"{sentence(finding(results))}. Histogram of {METRIC_NAMES[results.metric]} under permuted "
        f"labels. {text}",
    )


def figures(results: TaskResults) -> list[Illustration]:
    """Return the figure of the test."""
    return [Illustration(results.named(), caption(results), lambda: figure(results))]


def paper_comparison(results: TaskResults, lookup: Lookup) -> Iterator[PaperComparison]:
    """Yield a result that the paper calls near chance: chance is then the published value."""
    evaluated = lookup(CROSS_VALIDATION, results.dataset, results.task)
    model = paper_model(evaluated) if evaluated else None
    paper = evaluated.papers.get("known") if evaluated else None
    if evaluated is None or model is None or paper is None or paper.text != NEAR_CHANCE:
        return
    p, _, _ = tested(results)
    reached = model.shown(model.with_interval())
    told = f"{reached}; {results.results[0].label} against chance: p = {number(p, 2)}"
    yield PaperComparison(
        paper, results.dataset, results.task, results.source, told, model.label,
        model.verdict(model.leading, evaluated.scale * model.chance()),
        marks=marks_of(models_of(evaluated), model), shown_unit="%",
    )  # fmt: skip


EXPERIMENT = Experiment(
    name="permutation_test",
    order=20,
    title="Test against chance",
    settings=Settings,
    measure=measure,
    figures=figures,
    p_values=p_values,
    paper_comparison=paper_comparison,
)
