"""Plots of experiments: roles of columns, names on figures, and figures that no mark draws."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest
from experiment_samples import task_results
from matplotlib.figure import Figure

from ajgdata.experiments.base import Outcome, TaskResults
from ajgdata.experiments.plots import BoundPlot, Plot
from ajgdata.experiments.registry import load_experiment
from ajgdata.report.canvas import draw
from ajgdata.report.format import Caption
from ajgdata.report.projections import projections_figure
from ajgdata.report.report_data import Illustration
from ajgdata.types.table import Table, table_of

#: Names of classes that are also names of a model, of a data set with the title `Gripper b`, and of
#: a model whose label is `ridge classifier`.
CLASSES = ("forest", "b", "ridge", "steel_balls")
#: Keys of columns that hold names of models or data sets in the tables of some experiments.
KEYS = ("true", "model", "data_set", "dataset", "other", "tested")


def table(rows: Sequence[Mapping[str, object]], **titles: str) -> Table:
    """A table whose columns are called as their keys, if they have no title."""
    return table_of("t", "t", rows, **{key: titles.get(key, key) for key in rows[0]})


def results(stored: Table | None = None, **changes) -> TaskResults:
    """Results of a random forest with a stored table `t`."""
    return task_results("sorting", {"forest": Outcome((stored,) if stored else ())}, **changes)


def of_table(rows: Sequence[Mapping[str, object]], **roles) -> BoundPlot:
    """A plot of a table that a function returns."""
    return Plot("rows", lambda _: table(rows), "", **roles).bind(results())


# Names on figures


@pytest.mark.parametrize("key", KEYS)
@pytest.mark.parametrize("name", CLASSES)
def test_a_class_keeps_its_name_whatever_its_column_is_called(name, key):
    rows = [{key: name, "value": 1.0}]
    shown = name.replace("_", " ")
    (place,) = of_table(rows, x=key, series=()).points
    (line,) = of_table(rows, series=(key,)).points
    (panel,) = of_table(rows, series=(), panel=key).points
    assert (place.x, line.series, panel.panel) == (shown, shown, shown)


def test_a_table_says_which_cells_are_labels_models_and_data_sets():
    rows = [{"first": "forest", "second": "b", "third": "own_model", "value": 1.0}]
    cells = {"first": "model", "second": "data set", "third": "label"}
    roles = {"series": ("first",), "x": "second", "panel": "third"}
    (point,) = of_table(rows, **roles, cells=cells).points
    assert (point.series, point.x, point.panel) == ("random forest", "Gripper b", "own_model")


def test_the_data_set_of_the_task_is_shown_by_its_title():
    (point,) = of_table(
        [{"set": "size", "value": 1.0}], x="set", series=(), cells={"set": "data set"}
    ).points
    assert point.x == "Cube size"


def test_rows_of_a_stored_table_have_the_label_of_their_model():
    stored = table([{"true": name, "value": 1.0} for name in CLASSES])
    points = Plot("rows", "t", "", x="true").bind(results(stored)).points
    assert {point.series for point in points} == {"random forest"}
    assert [point.x for point in points] == ["forest", "b", "ridge", "steel balls"]


# Roles


METRICS = [
    {"metric": metric, "value": value, "chance": 0.25}
    for metric, value in (("accuracy", 0.5), ("accuracy", 0.7), ("f1", 0.1))
]


def test_the_metric_of_the_task_is_selected_and_shown_in_its_unit_only_if_declared():
    plot = of_table(METRICS, series=(), metric="metric", chance="chance")
    (point,) = plot.points
    assert point.score.mean == pytest.approx(60)
    assert (plot.axis, plot.chance, plot.limits) == (("accuracy", "%"), {"": 25}, (0, 100))
    plain = of_table(METRICS, series=())
    assert plain.points[0].score.mean == pytest.approx(1.3 / 3)
    assert (plain.axis, plain.limits) == (("value", ""), (-np.inf, np.inf))


@pytest.mark.parametrize(
    ("percent", "place", "value", "units"),
    [
        ((), 0.5, 0.4, ("", "")),
        (("held",), 0.5, 40, ("", "%")),
        (("held", "stated"), 50, 40, ("%", "%")),
    ],
)
@pytest.mark.parametrize("ideal", [False, True])
def test_shares_are_shown_in_per_cent_where_it_is_declared(percent, place, value, units, ideal):
    rows = [{"stated": 0.5, "held": 0.4, "low": 0.3, "high": 0.45}]
    plot = of_table(
        rows,
        x="stated",
        value="held",
        series=(),
        interval=("low", "high"),
        percent=percent,
        ideal=ideal,
    )
    (point,) = plot.points
    factor = value / 0.4
    assert (point.x, point.score.mean) == pytest.approx((place, value))
    assert (point.score.low, point.score.high) == pytest.approx((0.3 * factor, 0.45 * factor))
    assert (plot.place.unit, plot.axis.unit) == units


def test_the_caption_introduces_the_chance_level_as_declared():
    roles = {"series": (), "metric": "metric", "chance": "chance"}
    assert "Chance level: 25 %." in of_table(METRICS, **roles).caption.text
    plot = of_table(METRICS, **roles, chance_label="A guess reaches")
    assert "A guess reaches 25 %." in plot.caption.text


def test_a_figure_and_its_words_read_the_table_once():
    calls = []

    def counted(_: TaskResults) -> Table:
        calls.append(1)
        return table([{"n": n, "value": float(n)} for n in (1, 2)])

    plot = Plot("lines", counted, "numbers", x="n", series=()).bind(results())
    illustration = plot.illustration
    draw(illustration)
    assert [row.label for row in plot.rows()] == ["n 1", "n 2"]
    assert illustration.title == "value 1 (n 1), 2 (n 2)"
    assert illustration.caption.alt == "value 1 (n 1), 2 (n 2). n 1: 1; n 2: 2."
    assert len(calls) == 1


# Figures that no mark draws


def blank(name: str) -> Callable[[TaskResults], list[Illustration]]:
    """A figure of an experiment: its caption counts the tasks of the page."""

    def own_figures(results: TaskResults) -> list[Illustration]:
        tasks = [task.task for task in results.same_page]
        return [Illustration(results.named(name), Caption(", ".join(tasks), ""), Figure)]

    return own_figures


def test_an_experiment_has_figures_of_its_own_above_those_of_its_plots():
    rows = [{"n": n, "value": float(n)} for n in (1, 2)]
    first, second = (results(table(rows), task=task) for task in ("first", "second"))
    first = replace(first, same_page=(first, second))
    plots = (
        Plot("lines", "t", "numbers", x="n", name="plotted"),
        Plot("lines", "missing", "no table", x="n", name="empty"),
    )
    experiment = replace(load_experiment("sorting"), plots=plots, own_figures=blank("own"))
    own, plotted = experiment.figures(first)
    assert (own.name, own.caption.text) == ("sorting--size--first--own", "first, second")
    assert plotted.name == "sorting--size--first--plotted"
    assert isinstance(draw(own), Figure)


def test_projections_have_a_panel_each_and_open_marks_for_validation():
    plane = np.array([[0.0, 1], [2, 3], [4, 5], [6, 7]])
    labels = np.array(["ball", "ball", "steel_box", "ball"])
    is_training = np.array([True, False, True, True])
    planes = {"raw, PCA": plane, "latent, PCA": plane[::-1]}
    figure = projections_figure(planes, labels, is_training, "Cubes", "simulated")
    panels = [axes for axes in figure.axes if axes.get_visible()]
    assert [axes.get_title() for axes in panels] == list(planes)
    filled, hollow, boxes, _ = panels[0].collections
    assert filled.get_offsets().tolist() == [[0, 1], [6, 7]]
    assert hollow.get_offsets().tolist() == [[2, 3]]
    assert boxes.get_offsets().tolist() == [[4, 5]]
    assert (len(filled.get_facecolor()), len(hollow.get_facecolor())) == (1, 0)
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["ball", "steel box"]
