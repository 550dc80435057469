"""Figures of pages: functions of all results of the report, with the published values."""

import dataclasses
import math

import numpy as np
import pytest
from embedding_samples import SETTINGS
from matplotlib.figure import Figure
from result_samples import (
    COST,
    RMSE,
    SIZES,
    kind_result,
    kinds,
    paper_figure,
    random_split,
    size_result,
    sizes,
)

from ajgdata.evaluate.mirror import mirror_image
from ajgdata.evaluate.parts import GROUPED, SESSIONS, placebo
from ajgdata.experiments.base import Other, Result, TaskResults
from ajgdata.experiments.scores import ScoreKey, ScoreRow, score_table
from ajgdata.experiments.settings import (
    LearningCurveSettings,
    ReflectedEnergySettings,
    SortingSettings,
)
from ajgdata.pages import (
    PAGE_FIGURES,
    direct_labels,
    embedding_projections,
    materials,
    models,
    noise,
    page_causes,
    page_figures,
    sorting,
    ycb,
)
from ajgdata.pages.selection import MAX_TITLE
from ajgdata.report.format import Score
from ajgdata.types import CrossValidationSettings as Settings
from ajgdata.types import Embedding, Level
from ajgdata.types.table import Table, table_of


def drawn_points(figure: Figure) -> set[tuple[float, float]]:
    """Return all points of lines and marks of a figure."""
    lines = [line for axes in figure.axes for line in axes.get_lines()]
    return {
        (float(x), float(y))
        for line in lines
        for x, y in zip(*line.get_data(), strict=False)
        if not isinstance(x, str)
    }


def drawn_texts(figure: Figure) -> set[str]:
    """Return all texts inside the axes of a figure."""
    return {text.get_text() for axes in figure.axes for text in axes.texts}


def stored(name: str, rows: list[dict]) -> Table:
    """Return a table whose columns have the titles of their keys."""
    return table_of(name, name, rows, **{key: key for key in rows[0]})


def one_figure(page: str, *results: TaskResults):
    """Return the only figure of a page, after the checks that hold for all figures."""
    (shown,) = page_figures(page, results)
    assert len(shown.title) <= MAX_TITLE
    assert shown.caption.alt.startswith(shown.title)
    assert "The paper, on its real gripper: as told." in shown.caption.text
    assert shown.table.rows
    return shown


QUIET, LOUD = (Level(value=value, unit="dBA", quantity="white sound") for value in (45, 80))

NOISE = {"loud": Other("In noise", LOUD)}


def in_noise(**changes):
    """Return a task of a CNN that is also tested at 80 dB(A), where its error is 9 mm."""
    loud = ({"rmse": Score(9.0, 0.5, (8.5, 9.5))}, 8.2)
    predicted = {"grouped": (SIZES, SIZES), "on:loud": (SIZES, SIZES)}
    result = size_result(parts={"on:loud": loud}, predictions=predicted)
    given = {
        "settings": Settings(test_on=("loud",)),
        "other_sets": NOISE,
        "level": QUIET,
        "page": "noise",
    }
    return sizes(result, **(given | changes))


def test_errors_over_noise_levels_are_those_of_the_test_sets():
    (model,) = noise.models_of(in_noise())
    by_level = noise.scores(model)
    assert list(by_level) == [45, 80]
    assert [score.mean for score in by_level.values()] == [RMSE.mean, 9.0]
    assert by_level[80].low == 9.0 - 1.5 * 0.5  # the interval of the samples
    title = noise.conclusion(model, {})
    assert title == "CNN: RMSE 2.2 mm at 45 dB(A), 9 mm at 80 dB(A) (chance 8.2 mm)"


def repeated_fits():
    """Return fits at 80 dB(A) with a median of 7 mm; the paper reports 3.5 mm."""
    key = ScoreKey("cnn", "grouped", "loud", "training")
    values = {"median": 7.0, "low": 6.0, "high": 8.0, "chance": 8.2}
    rows = [ScoreRow("rmse", name, value, key) for name, value in values.items()]
    fit = Result("cnn", "CNN", {}, {"scores": score_table(rows, "Errors")}, {})
    papers = {"repeated_fits": paper_figure("noise", 3.5)}
    changes = {"results": (fit,), "experiment": "repeated_fits", "papers": papers}
    return dataclasses.replace(in_noise(), **changes)


def test_the_published_errors_and_the_median_of_fits_are_drawn_at_their_levels():
    quiet = sizes(papers={"known": paper_figure("size-known", 2.7)}, page="size")
    (shown,) = page_figures("noise", [in_noise(papers={}), repeated_fits(), quiet])
    assert shown.name == "size--against-noise"
    assert shown.title == "CNN: RMSE 2.2 mm at 45 dB(A), 7 mm at 80 dB(A) (published 2.7, 3.5 mm)"
    assert "The paper, on its real gripper: as told." in shown.caption.text
    assert "median of several fits" in shown.caption.text
    assert [(row["level"], row["value"]) for row in shown.table.rows] == [(45, 2.2), (80, 9.0)]
    assert shown.table.columns[2].unit == "mm"
    figure = shown.draw()
    assert {(45, 2.7), (80, 3.5), (80, 7.0), (45, 2.2), (80, 9.0)} <= drawn_points(figure)
    assert {"published 2.7", "published 3.5", "CNN", "chance"} <= drawn_texts(figure)


def test_all_models_of_the_noise_page_are_drawn():
    ridge = dataclasses.replace(in_noise().results[0], model="linear", label="ridge")
    other_task = in_noise(task="noise_one_scale")
    both = in_noise(results=(*in_noise().results, ridge))
    (shown,) = page_figures("noise", [both, other_task])
    assert [row["model"] for row in shown.table.rows[::2]] == ["CNN", "ridge", "CNN"]
    assert {"CNN", "ridge"} <= drawn_texts(shown.draw())


def test_tasks_without_levels_and_pages_without_a_figure_have_none():
    assert page_figures("noise", [sizes(page="noise")]) == ()
    assert page_figures("noise", [in_noise(page="size")]) == ()
    assert page_figures("shortcut", [in_noise()]) == ()
    one_level = in_noise(other_sets={"loud": Other("In noise", None)})
    assert page_figures("noise", [one_level]) == ()


def test_a_test_set_that_was_refused_or_has_the_level_of_the_training_is_not_drawn():
    refused = sizes(
        settings=Settings(test_on=("loud",)), level=QUIET, other_sets=NOISE, page="noise"
    )
    assert page_figures("noise", [refused]) == ()
    same_level = {"loud": Other("Second microphone", QUIET)}
    assert noise.levels(in_noise(other_sets=same_level)) == {"grouped": 45}
    assert page_figures("noise", [in_noise(other_sets=same_level)]) == ()
    assert page_figures("noise", [in_noise(level=None)]) == ()


def test_the_caption_names_the_level_of_the_training():
    trained_loud = {"loud": Other("In quiet", QUIET)}
    (shown,) = page_figures("noise", [in_noise(level=LOUD, other_sets=trained_loud)])
    assert "Models are trained at 80 dB(A)." in shown.caption.text
    assert shown.title == "CNN: RMSE 9 mm at 45 dB(A), 2.2 mm at 80 dB(A) (chance 8.2 mm)"


def three_models(**changes):
    """Return a task with errors of 1, 2 and 4 mm in 10, 1 and 5 s; the error of a guess is 8 mm."""
    quick = {"cnn": (1.0, 10.0, 0.1), "linear": (2.0, 1.0, 0.2), "forest": (4.0, 5.0, 0.05)}
    return sizes(
        *(
            size_result(
                name,
                name,
                scores={"rmse": Score(error, 0.1)},
                chance=8.0,
                cost=(train_s, prediction_ms, 100.0),
            )
            for name, (error, train_s, prediction_ms) in quick.items()
        ),
        **changes,
    )


def test_the_fronts_of_error_and_time_are_those_of_each_task():
    (shown,) = models.figures([three_models(), kinds()])
    by_model = {row["model"]: row for row in shown.table.rows}
    assert [row["error"] for row in by_model.values()] == [1 / 8, 2 / 8, 4 / 8]
    assert [by_model["cnn"][key] for key in ("train_cpu_s", "prediction_ms")] == [10, 0.1]
    training = {name for name, row in by_model.items() if row["on_training_front"]}
    prediction = {name for name, row in by_model.items() if row["on_prediction_front"]}
    assert training == {"cnn", "linear"}  # the forest is less accurate and slower than linear
    assert prediction == {"cnn", "forest"}  # linear is less accurate and slower than the network
    assert shown.title.startswith("Lowest error: cnn (1 of 1 tasks); on the Pareto front")
    marks = [line for line in shown.draw().axes[0].get_lines() if line.get_marker() != "None"]
    assert {tuple(np.ravel(line.get_data())) for line in marks} == {
        (10, 1 / 8),
        (1, 2 / 8),
        (5, 4 / 8),
    }


def test_equal_questions_are_shown_once_and_single_models_not_at_all():
    small = three_models(task="small", results=three_models().results[:2])
    assert [len(task.results) for task in models.compared_tasks([small, three_models()])] == [3]
    assert page_figures("baselines", [kinds()]) == ()


def placed(placements: int, real, one_object):
    """Return materials of objects and placebo: accuracy on held-out grasps and sessions."""

    def parts(dataset, values):
        names = {"grouped": GROUPED, "session": SESSIONS}
        return {
            (placebo(dataset, split) if dataset else part): ({"accuracy": Score(value, 0.1)}, 0.25)
            for (split, part), value in zip(names.items(), values, strict=True)
        }

    dataset = f"stones{placements}"
    scores = {**parts("", real), **parts("nothing", one_object)}
    result = kind_result(parts=scores, dataset=dataset)
    result.about["design"] = {"sessions": 4, "placements": placements, "fewest_recordings": 9}
    settings = Settings(placebo="nothing")
    return kinds(result, settings=settings, page="placement", dataset=dataset)


def test_the_placebo_stands_next_to_the_objects_by_number_of_placements():
    tasks = [placed(5, (0.7, 0.6), (0.3, 0.26)), placed(1, (0.8, 0.6), (0.6, 0.29))]
    (shown,) = page_figures("placement", tasks)
    values = {
        (row["order"], row["split"], row["recordings"]): row["value"] for row in shown.table.rows
    }
    assert values["1 placement", "held-out grasps", "placebo"] == 60
    assert values["5 placements", "held-out sessions", "objects"] == 60
    assert len(values) == 8
    assert shown.title == (
        "Identical objects are “recognised”: 60 % with 1 placement, 30 % with 5 placements "
        "(chance 25 %)"
    )
    drawn = [text.get_text() for axes in shown.draw().axes for text in axes.get_yticklabels()]
    assert "held-out sessions" in drawn
    assert page_figures("placement", [kinds(page="placement")]) == ()


def test_a_page_without_results_has_no_figure():
    for page in PAGE_FIGURES:
        assert page_figures(page, [sizes(page="elsewhere")]) == ()


# Granulate


def media_task(**changes):
    """Return energies of three media: 16, 13 and 4 % of that of the empty gripper."""
    energies = {"air": 1.0, "coffee": 0.04, "metal": 0.13, "plastic": 0.16}
    rows = [
        {"label": name, "grasps": 4, "mean": mean, "sd": 0.01, "low": mean - 0.01}
        | {"high": mean + 0.01}
        for name, mean in energies.items()
    ]
    fields = {
        "experiment": "reflected_energy",
        "dataset": "media",
        "page": "media",
        "settings": ReflectedEnergySettings(reference="air", band_hz=(100, 12000)),
        "results": (Result("", "", {}, {"classes": stored("classes", rows)}, {}),),
        "papers": {"reflected_energy": paper_figure("media", 80, short="coffee loses > 80 %")},
    }
    return kinds(**(fields | changes))


def test_the_energy_of_each_medium_is_drawn_with_the_published_limit():
    shown = one_figure("media", media_task())
    assert shown.title == (
        "Energy lost: coffee 96 %, metal 87 %, plastic 84 % (published: coffee loses > 80 %)"
    )
    assert [row["medium"] for row in shown.table.rows] == ["plastic", "metal", "coffee"]
    assert shown.table.column("energy") == pytest.approx([16, 13, 4])
    figure = shown.draw()
    widths = [patch.get_width() for patch in figure.axes[0].patches]
    assert widths == pytest.approx([100, 16, 13, 4])
    assert "published: below 20 %" in drawn_texts(figure)  # a loss of more than 80 %
    assert any(x == 20 for x, _ in drawn_points(figure))


def test_without_a_published_value_no_limit_is_drawn():
    (shown,) = page_figures("media", [media_task(papers={})])
    assert shown.title == "Energy lost: coffee 96 %, metal 87 %, plastic 84 %"
    assert not [text for text in drawn_texts(shown.draw()) if "published" in text]


def test_a_medium_with_too_few_grasps_has_no_interval():
    rows = [
        {"label": name, "grasps": 1, "mean": mean, "sd": None, "low": None, "high": None}
        for name, mean in (("air", 1.0), ("coffee", 0.04))
    ]
    few = Result("", "", {}, {"classes": stored("classes", rows)}, {})
    shown = one_figure("media", media_task(results=(few,)))
    assert shown.table.column("low") == [None]
    assert "4 %" in drawn_texts(shown.draw())
    alone = Result("", "", {}, {"classes": stored("classes", rows[:1])}, {})
    assert page_figures("media", [media_task(results=(alone,))]) == ()


# Cube size


def withheld_sizes() -> Result:
    """Return training sizes 10, 20 and 30 mm and a withheld size of 25 mm, predicted as 26 mm."""
    parts = {"withheld": ({"rmse": Score(1.0, 0.1)}, 8.0)}
    predictions = {
        "grouped": (SIZES, SIZES + np.tile([-1.0, 1.0, -3.0, 3.0], 3)),
        "withheld": (np.full(4, 25.0), np.full(4, 26.0)),
    }
    return size_result(parts=parts, predictions=predictions)


def test_training_and_withheld_sizes_are_drawn_with_their_errors():
    papers = {
        "known": paper_figure("size-known", 2.7),
        "unknown": paper_figure("size-unknown", 2.4),
    }
    papers["overall"] = paper_figure("size", 2.6)
    shown = one_figure("size", sizes(withheld_sizes(), papers=papers, page="size"))
    assert shown.title == (
        "CNN: RMSE 2.2 mm (training sizes), 1 mm (withheld sizes); published 2.7, 2.4 mm"
    )
    rows = {row["true"]: row for row in shown.table.rows}
    assert rows[25.0]["values"] == "withheld sizes" and rows[25.0]["mean"] == 26.0
    # errors of -1, 1, -3 and 3 mm: mean 0, root of the mean square √5
    assert rows[10.0]["mean"] == 10.0 and rows[10.0]["rmse"] == pytest.approx(math.sqrt(5))
    figure = shown.draw()
    points = drawn_points(figure)
    assert {(10.0, 10.0), (25.0, 26.0), (25.0, 1.0)} <= points
    levels = {line.get_ydata()[0] for line in figure.axes[1].get_lines()}
    assert {2.7, 2.4} <= levels
    assert "band: published RMSE\n± 2.6 mm" in drawn_texts(figure)


def test_the_task_that_is_compared_with_the_paper_is_drawn():
    other = sizes(size_result(parts=random_split()), papers={}, page="size", task="first")
    compared = sizes(withheld_sizes(), page="size")
    (shown,) = page_figures("size", [other, compared])
    assert "withheld" in shown.title


# Materials and household objects


def stones(name: str, paper: str, value: float | None, row: str, *models: Result) -> TaskResults:
    """Return stones of a shape: basalt 3 of 4, granite 4 of 6 correct."""
    papers = {"known": paper_figure(paper, value, row=row, unit="%", short="near chance")}
    models = models or (kind_result(dataset=name),)
    return kinds(*models, dataset=name, papers=papers, page="materials")


def with_placebo(dataset: str, accuracy: float) -> Result:
    """Return results of a model with the accuracy of its placebo."""
    parts = {placebo(dataset, GROUPED): ({"accuracy": Score(accuracy, 0.02)}, 0.6)}
    return kind_result(dataset=dataset, parts=parts)


def test_materials_are_in_the_order_of_the_paper_with_their_placebo():
    spheres = stones("big", "materials-sphere80", 90, "big spheres")
    plates = stones("plate", "materials-plate", 100, "plates", with_placebo("plate", 0.6))
    small = stones("small", "materials-sphere30", None, "small spheres")
    shown = one_figure("materials", plates, small, spheres)
    assert shown.title == (
        "CNN: 70 % for big spheres, 70 % for plates, 70 % for small spheres (chance 60 %)"
    )
    figure = shown.draw()
    titles = [axes.get_title() for axes in figure.axes]
    assert titles == [
        "big spheres\naccuracy 70 %\npublished 90 %",
        "plates\naccuracy 70 %\npublished 100 %\nplacebo 60 %",
        "small spheres\naccuracy 70 %\npublished near chance",
    ]
    assert {"75", "25", "33", "67"} <= drawn_texts(figure)  # 3 and 1 of 4, 2 and 4 of 6
    assert "real chance level" in shown.caption.text
    placebos = {row["shape"]: row["placebo"] for row in shown.table.rows}
    assert placebos == {"big spheres": None, "plates": 60, "small spheres": None}
    assert shown.replaces == tuple(task.named("predictions") for task in (spheres, plates, small))
    assert materials.compared_tasks([kinds(page="materials")]) == []


def household() -> TaskResults:
    """Return baseballs of which 3 of 10 are predicted as oranges, and a lock."""
    true = np.repeat(["baseball", "orange", "lock"], 10)
    predicted = true.copy()
    predicted[:3] = "orange"
    model = kind_result(
        predictions={"grouped": (true, predicted)},
        classes=("baseball", "lock", "orange"),
        score=Score(0.9, 0.01),
    )
    papers = {"known": paper_figure("ycb", 85.6, unit="%")}
    return kinds(model, papers=papers, page="ycb")


def test_the_confusions_that_the_paper_names_are_outlined():
    shown = one_figure("ycb", household())
    assert shown.title == "CNN: accuracy 90 % (published 85.6 %); 2 of 3 objects at 90 % or more"
    named = [
        (row["true"], row["predicted"]) for row in shown.table.rows if row["published_confusion"]
    ]
    assert named == [("orange", "baseball"), ("baseball", "orange")]
    assert ycb.ordered_classes(household()) == ["orange", "baseball", "lock"]
    assert "baseball–orange: 15 %" in shown.caption.alt  # the mean of 30 and 0 %
    outlined = [patch.get_xy() for patch in shown.draw().axes[0].patches]
    assert sorted(outlined) == [(-0.5, 0.5), (0.5, -0.5)]


# Training grasps


def curves(**accuracies: list[float]) -> TaskResults:
    """Return learning curves for 1, 2 and 4 grasps: two draws, 1 % below and above the accuracy."""
    curve_results = []
    for label, values in accuracies.items():
        rows = [
            {"groups": groups, "draw": draw, "recordings": groups, "metric": "accuracy"}
            | {"value": value + shift, "chance": 0.25}
            for groups, value in zip((1, 2, 4), values, strict=True)
            for draw, shift in enumerate((-0.01, 0.01))
        ]
        curve_results.append(Result(label, label, {}, {"curve": stored("curve", rows)}, {}))
    paper = paper_figure("data-size", 2, reached=80, unit="poses")
    return kinds(
        *curve_results,
        experiment="learning_curve",
        page="datasize",
        settings=LearningCurveSettings(groups=(1, 2, 4)),
        papers={"learning_curve": paper},
    )


def test_learning_curves_of_all_models_are_drawn_with_the_published_point():
    shown = one_figure("datasize", curves(cnn=[0.5, 0.7, 0.85], knn=[0.4, 0.5, 0.6]))
    assert shown.title == "cnn: 80 % requires 4 grasps (published 2 poses); 70 % with 2"
    assert [row["value"] for row in shown.table.rows] == pytest.approx([50, 70, 85, 40, 50, 60])
    # two draws, 1 % below and above the mean: deviation √2 %
    assert shown.table.column("sd") == pytest.approx([math.sqrt(2)] * 6)
    figure = shown.draw()
    assert (2.0, 80.0) in drawn_points(figure)
    assert {"cnn", "knn", "chance"} <= drawn_texts(figure)


def test_an_accuracy_that_is_never_reached_needs_more_grasps_than_were_tried():
    shown = one_figure("datasize", curves(cnn=[0.5, 0.6, 0.7]))
    assert shown.title == ("cnn: 80 % requires more than 4 grasps (published 2 poses); 60 % with 2")
    reached = one_figure("datasize", curves(cnn=[0.5, 0.8, 0.9]))
    assert reached.title == "cnn: 80 % requires 2 grasps (published 2 poses)"


# Model comparison


def test_models_are_sorted_by_accuracy_with_the_published_values():
    ranked = kinds(
        kind_result("knn_plain", "k-NN, plain", score=Score(0.5, 0.02), cost=(0.01, 0.5, 9.0)),
        kind_result("cnn", "CNN", score=Score(0.8, 0.02), cost=COST),
        kind_result("forest", "random forest", score=Score(0.7, 0.02), cost=(5.0, 0.5, 9.0)),
        page="baselines",
        papers={"known": paper_figure("baselines", 47.5, unit="%")},
    )
    objects = kinds(page="ycb", papers={"known": paper_figure("ycb", 85.6, unit="%")})
    first, _ = page_figures("baselines", [ranked, objects])
    assert first.title == (
        "Best of 3: CNN 80 % (published 85.6 %), k-NN, plain 50 % (published 47.5 %)"
    )
    rows = first.table.rows
    assert [row["model"] for row in rows] == ["CNN", "random forest", "k-NN, plain"]
    assert [row["published"] for row in rows] == [85.6, None, 47.5]
    assert [row["train_cpu_s"] for row in rows] == [3.2, 5.0, 0.01]
    assert (rows[0]["low"], rows[0]["high"]) == pytest.approx((77, 83))  # 1.5 sd of the samples
    left, right = first.draw().axes
    assert {(85.6, 0.0), (47.5, 2.0), (80.0, 0.0)} <= drawn_points(left.figure)
    assert [label.get_text() for label in left.get_yticklabels()] == [row["model"] for row in rows]
    assert {"3.2 s", "5 s", "0.01 s"} == {text.get_text() for text in right.texts}


# Sorting


def sorting_runs(**lengths: list[int]) -> TaskResults:
    """Return runs of sorting by kind of probabilities; the paper reports 39 sorts."""
    rows = [
        {"part": part, "run": run, "sorts": sorts}
        for part, values in lengths.items()
        for run, sorts in enumerate(values)
    ]
    return kinds(
        Result("cnn", "CNN", {}, {"runs": stored("runs", rows)}, {}),
        experiment="sorting",
        page="sorting",
        settings=SortingSettings(),
        papers={"sorting": paper_figure("sorting", 97.5, unit="%", correct=39, trials=40)},
    )


def test_the_lengths_of_runs_until_a_refusal_are_drawn_with_the_published_number():
    shown = one_figure("sorting", sorting_runs(plain=[0, 2, 2, 5], calibrated=[4, 8, 8, 50]))
    assert shown.title == (
        "CNN, calibrated: median 8 sorts until the first refusal (plain 2); published 39"
    )
    rows = [(row["sorts"], row["share"]) for row in shown.table.rows]
    assert rows == [(0, 1.0), (2, 0.75), (5, 0.25), (4, 1.0), (8, 0.75), (50, 0.25)]
    figure = shown.draw()
    assert {"published: 39", "calibrated probabilities: median 8"} <= drawn_texts(figure)
    assert {(2.0, 75.0), (50.0, 25.0), (2.0, 50.0)} <= drawn_points(figure)
    counts, shares = sorting.share_of_runs(np.array([3.0, 3.0]))
    assert (counts.tolist(), shares.tolist()) == ([3.0], [1.0])


# Embeddings


def embedding(name: str, about=None, **tables: list[dict]) -> TaskResults:
    """Return results of an experiment on an embedding of 4 dimensions."""
    own = Result("", "", about or {}, {key: stored(key, rows) for key, rows in tables.items()}, {})
    return kinds(
        own,
        experiment=name,
        page=name,
        task="grasps",
        settings=Embedding.model_validate(SETTINGS),
        papers={name: paper_figure("latent-knn", 25, unit="%")},
    )


def test_an_ellipse_has_the_axes_of_the_covariance():
    # x has the variance 4 and y the variance 1, turned by 30 degrees
    x = np.array([-2, 2, 0, 0])
    y = np.array([0, 0, -1, 1])
    points = np.stack([x, y], 1) * math.sqrt(3 / 2)  # sample variances: 4 and 1
    turn = np.radians(30)
    matrix = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    ellipse = embedding_projections.ellipse_of(points @ matrix.T + [5, 6])
    assert ellipse == pytest.approx((5, 6, 4, 2, 30))  # two standard deviations
    box = embedding_projections.box_of(ellipse)
    assert box.right - 5 == pytest.approx(math.hypot(4 * math.cos(turn), 2 * math.sin(turn)))
    assert box.overlaps(box) and not box.overlaps(box._replace(left=20, right=21))


def test_ellipses_are_of_the_training_recordings_in_the_colour_of_the_category():
    kind = {"ball": "round", "cube": "flat"}
    recordings = [
        {"recording": f"{name}{n}", "training": n < 4, "object": name, "category": kind[name]}
        for name in kind
        for n in range(6)
    ]
    places = [(0, 0), (2, 0), (0, 2), (2, 2), (90, 90), (80, 90)]
    points = [
        {"space": "latent", "method": "plane", "x": float(x + shift), "y": float(y)}
        for shift in (0, 10)
        for x, y in places
    ]
    silhouettes = [
        {"space": space, "label": "object", "run": run, "silhouette": value + 0.01 * run}
        for space, value in (("latent", 0.5), ("raw", 0.1))
        for run in (0, 1)
    ]
    shown = one_figure(
        "embedding_projections",
        embedding(
            "embedding_projections",
            recordings=recordings,
            points=points,
            silhouettes=silhouettes,
        ),
    )
    assert shown.title == (
        "Silhouette of objects: 0.5050 ± 0.0071 in the 4-D latent, 0.1050 ± 0.0071 in raw features"
    )
    rows = {row["object"]: row for row in shown.table.rows}
    assert (rows["ball"]["x"], rows["ball"]["y"], rows["cube"]["x"]) == (1, 1, 11)
    assert rows["ball"]["points"] == 4  # validation recordings are not drawn
    figure = shown.draw()
    assert {"ball", "cube"} <= drawn_texts(figure)
    colours = {patch.get_edgecolor() for patch in figure.axes[0].patches}
    assert len(colours) == 2
    assert max(x for x, _ in drawn_points(figure)) == 12


def test_the_accuracy_on_the_latent_is_drawn_with_raw_features_and_the_published_gain():
    knn = [
        {"space": space, "dimension": dimension, "run": run, "accuracy": value}
        for space, dimension, value in (("raw", None, 0.4), ("latent", 2, 0.44), ("latent", 4, 0.6))
        for run in (0, 1)
    ]
    shown = one_figure("embedding_knn", embedding("embedding_knn", {"chance": 0.25}, knn=knn))
    assert shown.title == (
        "k-NN: 60 % with 4 dimensions, 40 % on raw features (+50 %; published +25 %)"
    )
    assert shown.table.column("accuracy") == pytest.approx([40, 44, 60])
    figure = shown.draw()
    points = drawn_points(figure)
    assert any(point == pytest.approx((8, 50)) for point in points)  # 25 % more than 40 %
    assert {(2.0, 44.0), (4.0, 60.0)} <= points
    assert {"raw features", "latent", "chance"} <= drawn_texts(figure)


def category_distances(other: float) -> TaskResults:
    """Return distances 1 within and 3 between categories; within `other` as given."""
    names = ("cylindrical", "other", "spherical")
    rows = [
        {"space": space, "first": first, "second": second, "run": run}
        | {"distance": ((other if first == "other" else 1.0) if first == second else 3.0) + shift}
        for space in ("latent", "raw")
        for i, first in enumerate(names)
        for second in names[i:]
        for run, shift in enumerate((-0.05, 0.05))
    ]
    return embedding("embedding_distances", categories=rows)


def test_distances_of_categories_are_drawn_and_the_title_has_what_does_not_agree():
    shown = one_figure("embedding_distances", category_distances(0.5))
    assert shown.title == (
        "2 of 3 published statements agree; “other has the largest distance within”: disagrees"
    )
    cells = {(row["space"], row["first"], row["second"]): row for row in shown.table.rows}
    assert cells["latent", "other", "other"]["distance"] == pytest.approx(0.5)
    assert cells["latent", "cylindrical", "other"]["ratio"] == pytest.approx(1)
    assert {"0.5\n± 0.071", "3\n± 0.071"} <= drawn_texts(shown.draw())
    agreeing = one_figure("embedding_distances", category_distances(2.0))
    assert agreeing.title == "3 of 3 published statements agree"


def test_one_category_and_one_run_are_drawn_without_a_verdict():
    rows = [
        {"space": space, "first": "all", "second": "all", "run": 0, "distance": 1.0}
        for space in ("latent", "raw")
    ]
    shown = one_figure("embedding_distances", embedding("embedding_distances", categories=rows))
    assert shown.title.startswith("Distance within categories smaller")
    assert shown.table.column("ratio") == [None, None]
    assert "1\n± —" in drawn_texts(shown.draw())


# Labels


def test_labels_are_moved_apart_as_little_as_possible():
    assert direct_labels.spread_out([5.0, 1.0, 1.0], 2.0).tolist() == [5.0, 0.0, 2.0]
    assert direct_labels.spread_out([1.0, 9.0], 2.0).tolist() == [1.0, 9.0]


# Bar angle


def angles(predicted: np.ndarray, **changes):
    """Return a task whose withheld angles have the predictions `predicted`."""
    rmse = float(np.sqrt(np.mean(np.square(predicted - WITHHELD_DEG))))
    withheld = {"withheld": ({"rmse": Score(rmse, 1.0, (rmse, rmse))}, 41.0)}
    tested = {"grouped": (SIZES, SIZES), "withheld": (WITHHELD_DEG, predicted)}
    given = {
        "page": "orientation",
        "mirror_deg": 80.0,
        "unit": "°",
        "papers": {"unknown": paper_figure("orientation", 8.0, unit="°", text="8° withheld")},
    }
    return sizes(size_result(parts=withheld, predictions=tested), **(given | changes))


WITHHELD_DEG = np.repeat(np.arange(9.0, 180.0, 18.0), 4)


def test_predictions_at_the_mirror_image_are_a_cause_without_variants():
    mirrored = angles(mirror_image(WITHHELD_DEG, 80.0))
    (reason,) = page_causes([mirrored])
    (test,) = reason.tests
    assert reason.of == ("orientation",) and reason.split == ""
    assert (test.model, test.supported) == ("CNN", True)
    assert test.after == 0 and test.before > 50
    (shown,) = page_figures("orientation", [mirrored])
    assert reason.link == f"experiments/orientation.html#{shown.name}"
    assert shown.title.startswith("An angle and its mirror image give the same sound (CNN ")
    assert "test" not in shown.title and "8° withheld" in shown.caption.text
    lines = shown.draw().axes[0].get_lines()
    marks = {tuple(point) for point in np.transpose(lines[1].get_data()).tolist()}
    assert marks == set(zip(WITHHELD_DEG, mirror_image(WITHHELD_DEG, 80.0), strict=True))


def test_other_errors_are_no_mirror_image_and_other_tasks_are_not_tested():
    far = angles(WITHHELD_DEG + 20.0)
    (reason,) = page_causes([far])
    assert not reason.tests[0].supported
    (shown,) = page_figures("orientation", [far])
    assert shown.title.startswith("CNN: RMSE 20°")
    for other in (angles(WITHHELD_DEG, mirror_deg=None), angles(WITHHELD_DEG, papers={})):
        assert list(page_causes([other])) == [] and page_figures("orientation", [other]) == ()
