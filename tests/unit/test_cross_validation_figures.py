"""What figures of cross-validation show, read back from them, and what stands below them."""

import itertools
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from drawn_figures import smallest_pt
from matplotlib.text import Text
from result_samples import (
    CLASSES,
    PREDICTED,
    RMSE,
    SCRIPT,
    SIZES,
    TRUE,
    kind_result,
    kinds,
    random_split,
    size_result,
    sizes,
    two_tasks,
)

from ajgdata.experiments.base import Other
from ajgdata.experiments.cross_validation import EXPERIMENT, Settings, figures, overview
from ajgdata.experiments.cross_validation.findings import level_finding, model_finding
from ajgdata.experiments.cross_validation.predictions import (
    group_by_true_value,
    prediction_caption,
    prediction_figure,
    regression_figure,
)
from ajgdata.experiments.cross_validation.results import models_of
from ajgdata.report.canvas import COLOURS, MAX_VECTOR_POINTS, encode, styled
from ajgdata.report.format import Score
from ajgdata.report.paper import PaperFigure
from ajgdata.types import Level


def texts(figure):
    return [text.get_text() for text in figure.findobj(Text) if text.get_text()]


def title(figure):
    """The head of a figure, its lines joined."""
    bold = [text for text in figure.texts if text.get_fontweight() == "bold"]
    return " ".join(text.get_text() for text in bold if text.get_color() != "white")


def fits(figure):
    """Everything ends within the canvas, give or take half the width of a line."""
    box, size = figure.get_tightbbox(), figure.get_size_inches()
    return box.min.min() >= -0.5 / 72 and np.all(box.max <= size + 0.5 / 72)


def prediction_of(results):
    """The drawn predictions of the first model."""
    return styled(prediction_figure)(models_of(results)[0])


def illustrated(*results):
    """The illustrations of tasks, and of all of them together, by name."""
    listed = [one for task in results for one in EXPERIMENT.figures(task)]
    return {one.name: one for one in (*listed, *EXPERIMENT.across(results))}


@pytest.fixture(scope="module")
def drawn():
    return {name: styled(one.draw)() for name, one in illustrated(*two_tasks()).items()}


def test_every_figure_says_where_its_data_come_from(drawn):
    stated = {name: {"simulated", "recorded"} & set(texts(f)) for name, f in drawn.items()}
    assert stated == {
        "random-against-grouped": {"simulated"},
        "error-against-run-time": {"simulated", "recorded"},
        "error-against-inference-time": {"simulated", "recorded"},
        "cross-validation--size--edge--predictions--cnn": {"simulated"},
        "cross-validation--size--edge--predictions--knn": {"simulated"},
        "cross-validation--stones--kind--predictions--cnn": {"recorded"},
    }


def test_nothing_is_drawn_outside_a_figure(drawn):
    assert {name for name, figure in drawn.items() if not fits(figure)} == set()
    assert {name for name, figure in drawn.items() if smallest_pt(figure) < 7.8} == set()


def test_the_lowest_error_is_shown_first_and_others_on_request():
    worse = size_result("knn", "k-NN", scores={"rmse": Score(4.0, 0.4, (3.6, 4.4))})
    shown = list(EXPERIMENT.figures(sizes(worse, size_result())))
    assert [one.name.rpartition("--")[2] for one in shown] == ["cnn", "knn"]
    assert [one.folded for one in shown] == ["", "k-NN: RMSE 4.00 ± 0.40 mm"]


def test_a_task_without_results_has_no_figures():
    assert list(EXPERIMENT.figures(sizes(results=()))) == []
    assert list(EXPERIMENT.across([sizes(results=())])) == []


def test_many_models_of_a_task_are_drawn_against_their_times_in_its_own_unit():
    scores = {"cnn": (3.0, 50.0), "linear": (4.0, 0.2), "knn": (6.0, 1.0), "svm": (3.5, 1.5)}
    task = sizes(
        *(
            size_result(name, name, scores={"rmse": Score(rmse, 0.5)}, cost=(seconds, 1.0, 100.0))
            for name, (rmse, seconds) in scores.items()
        )
    )
    figure = styled(figures.tradeoff_figure)(task)
    train = figure.axes[0]
    front = next(line for line in train.lines if line.get_label() == "Pareto front")
    # k-NN is slower and worse than ridge; each other model is the best of those as fast
    np.testing.assert_array_equal(front.get_xydata(), [[0.2, 4.0], [1.5, 3.5], [50.0, 3.0]])
    bars = {c.get_label(): c for c in train.containers}
    assert {name: bars[name].lines[0].get_ydata()[0] for name in scores} == {
        name: rmse for name, (rmse, _) in scores.items()
    }
    assert train.get_ylabel() == "RMSE (mm)"
    assert "simulated" in texts(figure)
    assert fits(figure)
    named = illustrated(task)["cross-validation--size--edge--models"]
    assert "linear: 4.00 ± 0.50 mm, training 0.2 s, inference 1 ms" in named.caption.alt
    assert not [name for name in illustrated(*two_tasks()) if name.endswith("--models")]


def test_errors_at_several_levels():
    def at(value):
        return Level(value=value, unit="dBA", quantity="sound level outside")

    levels = (80, 60)
    parts = {f"on:size_{v}": ({"rmse": Score(v / 20, 0.3)}, 9.0) for v in levels}
    others = {f"size_{v}": Other(f"at {v}", at(v)) for v in levels}
    settings = Settings(test_on=tuple(others))
    task = sizes(size_result(parts=parts), level=at(45), others=others, settings=settings)
    named = illustrated(task)["cross-validation--size--edge--levels"]
    figure = styled(named.draw)()
    line = figure.axes[0].containers[0].lines[0]
    np.testing.assert_allclose(line.get_xydata(), [[45, 2.2], [60, 3], [80, 4]])
    assert figure.axes[0].get_xlabel() == "sound level outside (dBA)"
    assert fits(figure)
    assert "CNN: 2.20 ± 0.30 mm at 45 dBA, 3.00 ± 0.30 mm at 60 dBA" in named.caption.alt
    fewer = sizes(size_result(parts=parts), level=None, others=others, settings=settings)
    assert not [name for name in illustrated(fewer) if name.endswith("--levels")]


def test_long_names_and_many_classes_fit():
    classes = tuple(f"household object {i:02d}" for i in range(16))
    y = np.array(classes)
    long = {"dataset_title": "Materials of spheres, eighty millimetres", "task": "material_class"}
    many = kind_result(classes=classes, predictions={"grouped": (y, y)})
    assert fits(prediction_of(kinds(many, **long)))
    assert fits(prediction_of(kinds(**long)))
    assert fits(prediction_of(sizes(**long)))


def test_names_of_sixty_classes_stand_apart_and_cells_without_room_hold_no_numbers():
    classes = tuple(f"household object {i:02d}" for i in range(60))
    y = np.array(classes)
    figure = prediction_of(kinds(kind_result(classes=classes, predictions={"grouped": (y, y)})))
    assert fits(figure)
    axes = figure.axes[0]
    boxes = [label.get_window_extent() for label in axes.get_yticklabels()]
    assert all(above.y0 >= below.y1 - 1 for above, below in itertools.pairwise(boxes))
    assert not [text for text in axes.texts if text.get_text() == "1"]
    assert sum(text.get_text() == "100 %" for text in axes.texts) == 60


def test_a_model_is_better_than_chance_by_its_interval_over_grasps():
    def said(rmse, sd):
        return model_finding(models_of(sizes(size_result(scores={"rmse": Score(rmse, sd)})))[0])

    assert said(4.0, 2.0).startswith("CNN errs by 4.0 ± 2.0 mm where the grasp is new; chance is")
    assert said(7.0, 1.0).startswith("CNN is not better than chance: it errs by 7.0 ± 1.0 mm")
    assert said(12.0, 1.0).startswith("CNN is not better than chance: it errs by 12.0 ± 1.0 mm")


def leveled(*errors):
    """A task at 45, 60 and 80 dBA, and the RMSE of a model at the last two; chance is 8.2 mm."""
    others = {
        f"size_{v}": Other(f"at {v}", Level(value=v, unit="dBA", quantity="sound"))
        for v in (60, 80)
    }
    parts = {
        f"on:{name}": ({"rmse": Score(e, 0.3)}, 9.0) for name, e in zip(others, errors, strict=True)
    }
    level = Level(value=45, unit="dBA", quantity="sound")
    settings = Settings(test_on=tuple(others))
    return sizes(size_result(parts=parts), level=level, others=others, settings=settings)


def test_the_level_from_which_on_no_model_beats_chance_is_the_title():
    assert level_finding(leveled(3.0, 9.0)) == (
        "From 80 dBA on no model beats chance (CNN: 2.20 ± 0.30 mm at 45 dBA)"
    )
    assert level_finding(leveled(9.0, 9.0)).startswith("From 60 dBA on no model beats chance")
    # better again above: nothing is lost from a level on
    assert level_finding(leveled(9.0, 4.0)) == (
        "CNN: 2.20 ± 0.30 mm at 45 dBA, 4.00 ± 0.30 mm at 80 dBA; chance is 8.2 mm"
    )


def test_the_paper_s_value_is_named_with_whose_it_is():
    known = PaperFigure(id="size-known", metric="rmse", value=2.7, unit="mm", text="t", where="w")
    named = prediction_of(sizes(papers={"known": known}))
    assert any("the paper's CNN: 2.7 mm" in text for text in texts(named))
    theirs = known.model_copy(update={"id": "baselines"})
    named = prediction_of(sizes(papers={"known": theirs}))
    assert any("the paper's k-NN: 2.7 mm" in text for text in texts(named))
    untold = known.model_copy(update={"value": None})
    assert not any("paper" in t for t in texts(prediction_of(sizes(papers={"known": untold}))))


def test_mean_and_deviation_per_true_value():
    y_true = np.array([2.0, 1.0, 2.0, 1.0, 3.0])
    y_pred = np.array([2.0, 1.0, 4.0, 2.0, 9.0])
    true, mean, sd = group_by_true_value(y_true, y_pred)
    assert true.tolist() == [1, 2, 3] and mean.tolist() == [1.5, 3, 9]
    assert sd == pytest.approx([0.5**0.5, 2**0.5, 0], rel=1e-12)


def test_many_true_values_are_binned_without_losing_any():
    y_true = np.random.default_rng(0).uniform(0, 1, 400)
    true, mean, sd = group_by_true_value(y_true, 2 * y_true, max_groups=8)
    assert len(true) == 8 and np.all(np.diff(true) > 0)
    assert mean == pytest.approx(2 * true, rel=1e-12)
    # Uniform in bins of width 1/8, doubled. The sd of 50 uniform values is itself uncertain by
    # sqrt((1.8 - 1) / (4 * 50)) = 6 %; 0.3 is more than four times that.
    assert sd == pytest.approx(np.full(8, 0.25 / 12**0.5), rel=0.3)


def test_regression_figure_draws_predictions_identity_and_score():
    figure = prediction_of(sizes())
    lines = {line.get_label(): line for line in figure.axes[0].get_lines()}
    assert np.array_equal(lines["one recording"].get_xdata(), SIZES)
    errors = lines["one recording"].get_ydata() - SIZES
    assert np.array_equal(errors, np.tile([-1.0, 1.0, -3.0, 3.0], 3))
    assert np.array_equal(lines["perfect"].get_xdata(), lines["perfect"].get_ydata())
    assert lines["chance"].get_ydata()[0] == 20
    bars = figure.axes[0].containers[0]
    assert bars.lines[0].get_ydata() == pytest.approx([10, 20, 30])
    # Deviations -1, 1, -3, 3: variance 20 / 3 with n - 1.
    ends = bars.lines[2][0].get_segments()[0][:, 1]
    assert ends == pytest.approx(10 + np.array([-1, 1]) * (20 / 3) ** 0.5, rel=1e-12)
    told = "CNN errs by 2.20 ± 0.30 mm where the grasp is new; chance is 8.2 mm"
    assert told in title(figure) and "true edge (mm)" in texts(figure)
    assert not any("withheld" in text for text in texts(figure))


def test_withheld_values_are_drawn_beside():
    unseen = (np.array([15.0, 15.0]), np.array([14.0, 17.0]))
    predictions = {"grouped": (SIZES, SIZES), "withheld": unseen}
    parts = {"withheld": ({"rmse": Score(3.5, 0.4)}, 9.0)}
    task = sizes(size_result(parts=parts, predictions=predictions))
    axes = prediction_of(task).axes[0]
    bars = {c.get_label(): c.lines[0].get_xydata().tolist() for c in axes.containers}
    assert bars["mean ± sd of withheld values"] == [[15, 15.5]]
    assert "Squares: values withheld" in prediction_caption(models_of(task)[0]).text


def test_many_points_do_not_bloat_a_vector_file():
    n = MAX_VECTOR_POINTS + 1
    y = np.linspace(0, 1, n)
    few = encode(prediction_of(sizes()), "svg")
    many = sizes(size_result(predictions={"grouped": (y, y)}))
    assert encode(prediction_of(many), "svg").count(b"<use") < few.count(b"<use") + 200


def test_confusion_figure_shows_counts_and_shares_of_the_true_class():
    figure = prediction_of(kinds())
    shares = np.asarray(figure.axes[0].get_images()[0].get_array())
    assert shares == pytest.approx(np.array([[3 / 4, 1 / 4], [2 / 6, 4 / 6]]), rel=1e-12)
    shown = texts(figure)
    assert {"75 %\n3", "25 %\n1", "33 %\n2", "67 %\n4"} <= set(shown)
    told = "CNN is right in 70.0 ± 5.0 % where the grasp is new"
    assert f"{told}; chance is 60 %" in title(figure)
    assert "most often it takes <b>granite</b> for basalt" in title(figure)
    right = [text for text in shown if text.endswith(" %") and "\n" not in text]
    assert right == ["75 %", "67 %"]  # at the end of each row
    assert [t.get_text() for t in figure.axes[0].get_yticklabels()] == list(CLASSES)


def test_a_class_that_never_occurs_has_an_empty_row():
    never = kinds(kind_result(classes=(*CLASSES, "slate")))
    shares = prediction_of(never).axes[0].get_images()[0].get_array()
    assert shares[2].tolist() == [0, 0, 0] and shares[:2].sum() == pytest.approx(2)


def markers(axes):
    """Places (n, 2) of the models in a panel."""
    return np.array([c.lines[0].get_xydata()[0] for c in axes.containers])


def test_cost_figure_places_every_result_in_the_panel_of_its_task(drawn):
    sizes_, kinds_ = drawn["error-against-run-time"].axes
    np.testing.assert_allclose(markers(sizes_), [(3.2, 2.2 / 8.2), (1e-4, 4 / 8.2)])
    np.testing.assert_allclose(markers(kinds_), [(3.2, 0.3 / 0.4)])
    sizes_, kinds_ = drawn["error-against-inference-time"].axes
    np.testing.assert_allclose(markers(sizes_)[:, 0], [0.21, 0.05])
    assert sizes_.get_xscale() == "log"
    assert sizes_.get_xlim() == kinds_.get_xlim() and sizes_.get_ylim() == kinds_.get_ylim()
    # k-NN is worse but faster: both models of the first task are on its front.
    assert len(sizes_.get_lines()[0].get_xdata()) == 2


def cost_figure(*results):
    return styled(overview.cost_figure)([models_of(task) for task in results])


def test_cost_figure_hollows_what_is_beaten():
    slow = size_result("slow", scores={"rmse": Score(4.0, 0.4)}, cost=(9, 0.21, 512))
    training = cost_figure(sizes(slow, size_result())).axes[0]
    faces = [c.lines[0].get_markerfacecolor() for c in training.containers]
    assert faces == ["white", COLOURS[1]]
    assert training.get_lines()[0].get_xdata().tolist() == [3.2]


def test_the_title_of_costs_counts_the_tasks_on_which_a_model_is_best():
    alone = cost_figure(kinds())
    assert title(alone) == "Error against run time: CNN"
    worse = size_result("knn", "k-NN", scores={"rmse": Score(4.0, 0.4)}, cost=(0.1, 0.2, 1.0))
    two = [sizes(size_result(), worse), sizes(size_result(), worse, task="other")]
    assert title(cost_figure(*two)) == "CNN errs least on 2 of 2 tasks, k-NN trains fastest on 2"
    both = cost_figure(sizes(size_result(), worse), kinds())
    assert title(both) == "CNN errs least, k-NN trains fastest"


def test_many_tasks_share_one_scale_and_nothing_is_drawn_outside():
    worse = size_result("knn", "k-NN", scores={"rmse": Score(4.0, 0.4)}, cost=(0.1, 0.2, 1.0))
    tasks = [sizes(size_result(), worse, task=f"a_task_of_a_long_name_{i}") for i in range(9)]
    figure = cost_figure(*tasks)
    shown = [axes for axes in figure.axes if axes.get_visible()]
    assert len(shown) == 9 and len({axes.get_xlim() for axes in shown}) == 1
    assert fits(figure)


def test_split_figure_pairs_the_two_errors_in_one_unit(drawn):
    figure = drawn["random-against-grouped"]
    places = [float(x) for x in markers(figure.axes[0])[:, 0]]
    assert places == pytest.approx([1.1 / 8.2, 2.2 / 8.2], rel=1e-12)
    assert "1.10 ± 0.20 mm → 2.20 ± 0.30 mm" in texts(figure)
    assert title(figure) == "A split that ignores the groups hides 50 % of the error"
    caption = illustrated(*two_tasks())["random-against-grouped"].caption
    assert "hides: Cube size · edge, CNN: 50%." in caption.text
    assert "CNN: 2.20 ± 0.30 mm grouped, 1.10 ± 0.20 mm random" in caption.alt


def test_splits_are_drawn_where_both_were_measured():
    assert "random-against-grouped" not in illustrated(kinds())
    assert "random-against-grouped" in illustrated(sizes(size_result(parts=random_split())))


def test_sessions_are_drawn_in_the_order_within_as_many_across():
    names = {"within session": 0.7, "across sessions, as many": 0.5, "across sessions": 0.9}
    parts = {name: ({"accuracy": Score(v, 0.02, (v, v))}, 0.6) for name, v in names.items()}
    one = illustrated(kinds(kind_result(parts=parts)))["within-against-across-sessions"]
    figure = styled(one.draw)()
    assert [float(x) for x in markers(figure.axes[0])[:, 0]] == pytest.approx([0.75, 1.25, 0.25])
    assert title(figure) == "A new session is read worse in 1 of 1 cases"
    assert "70.0 ± 2.0 % → 50.0 ± 2.0 % → 90.0 ± 2.0 %" in texts(figure)
    assert {"within", "as many", "across"} <= set(texts(figure))
    assert fits(figure)
    assert one.caption.text.endswith("kind, CNN: 40%.")  # of as many grasps, as the title
    assert "within-against-across-sessions" not in illustrated(kinds())


def test_the_overview_names_the_best_model_of_each_task():
    alt = illustrated(*two_tasks())["error-against-run-time"].caption.alt
    assert "Cube size · edge: CNN, 0.27 of chance error in 3.2 s" in alt
    assert f"{SCRIPT} · kind: CNN, 0.75 of chance error in 3.2 s" in alt


def test_labels_are_text_and_not_formulas():
    svg = encode(prediction_of(sizes(size_result(label="$x^{2$ & <b>"))), "svg")
    ET.fromstring(svg)


def test_the_same_figure_gives_the_same_bytes():
    assert encode(prediction_of(sizes()), "svg") == encode(prediction_of(sizes()), "svg")


def test_times_are_labelled_with_plain_numbers_however_few_decades_they_span():
    for slowest in (0.02, 0.9, 300.0):
        slow = size_result("cnn", cost=(slowest, slowest, 100.0))
        fast = size_result("knn", cost=(0.01, 0.01, 100.0))
        figure = cost_figure(sizes(slow, fast))
        figure.draw_without_rendering()
        for axes in figure.axes[:2]:
            low, high = axes.get_xlim()
            ticks = axes.xaxis.get_major_ticks() + axes.xaxis.get_minor_ticks()
            shown = [t.label1.get_text() for t in ticks if low <= t.get_loc() <= high]
            labels = [text for text in shown if text]
            assert len(labels) >= 1
            assert all(float(text.replace(",", "")) > 0 for text in labels)


def test_the_alternative_text_names_the_commonest_confusion():
    alt = prediction_caption(models_of(kinds())[0]).alt
    assert "Most frequent confusion: <b>granite</b> taken for basalt, 2 times." in alt
    right = kinds(kind_result(predictions={"grouped": (TRUE, TRUE)}))
    assert "There are no confusions." in prediction_caption(models_of(right)[0]).alt
    assert (PREDICTED != TRUE).sum() == 3


def test_the_caption_counts_what_was_held_out_and_says_how():
    text = prediction_caption(models_of(sizes())[0]).text
    assert text.startswith(
        "CNN on Cube size, simulated: RMSE 2.20 ± 0.30 mm (chance 8.2 mm), 2 folds, no grasp id "
        "on both sides of a split. Small dots: 12 held-out predictions"
    )


def test_the_caption_says_where_a_repeating_target_is_drawn():
    text = prediction_caption(models_of(sizes(period_deg=180.0, unit="°"))[0]).text
    assert "The target repeats after 180°: each prediction is drawn at its repetition" in text
    assert "repeats" not in prediction_caption(models_of(sizes())[0]).text


def test_a_repeating_target_is_drawn_at_the_repetition_nearest_to_the_truth():
    true = np.array([5.0, 175.0, 90.0])
    predicted = np.array([178.0, 2.0, 80.0])
    scores = {"rmse": RMSE}
    task = sizes(
        size_result(scores=scores, predictions={"grouped": (true, predicted)}), period_deg=180.0
    )
    line = styled(regression_figure)(models_of(task)[0]).axes[0].get_lines()[2]
    np.testing.assert_allclose(line.get_xydata(), [[5, -2], [175, 182], [90, 80]])
