"""Figures of pages: functions of all results of a page."""

import numpy as np
from result_samples import RMSE, SIZES, kind_result, kinds, paper_figure, size_result, sizes

from ajgdata.evaluate.mirror import mirror_image
from ajgdata.evaluate.parts import GROUPED, SESSIONS, placebo
from ajgdata.experiments.base import Other
from ajgdata.experiments.cross_validation import Settings
from ajgdata.pages import models, noise, page_causes, page_figures
from ajgdata.report.format import Score
from ajgdata.types import Level

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
    finding = noise.conclusion(model)
    assert finding == "CNN: RMSE 2.2 mm at 45 dB(A), 9 mm at 80 dB(A) (chance 8.2 mm)"


def test_the_published_value_is_drawn_at_its_level():
    figure = paper_figure("noise", 3.5)
    fits = in_noise(experiment="repeated_fits", papers={"repeated_fits": figure})
    assert noise.published_values([in_noise(), fits]) == (80, 3.5)
    (shown,) = page_figures("noise", [in_noise(), fits])
    assert shown.name == "size--against-noise"
    assert "The paper, on its real gripper: as told." in shown.caption.text
    assert "shows the median of several fits" in shown.caption.text
    assert [(row["level"], row["value"]) for row in shown.table.rows] == [(45, 2.2), (80, 9.0)]
    assert shown.table.columns[2].unit == "mm"
    drawn = shown.draw()
    lines = [line for axes in drawn.axes for line in axes.get_lines()]
    values = {(x, y) for line in lines for x, y in np.transpose(line.get_data()).tolist()}
    assert (80, 3.5) in values


def test_tasks_without_levels_and_pages_without_a_figure_have_none():
    assert page_figures("noise", [sizes(page="noise")]) == ()
    assert page_figures("noise", [in_noise(page="size")]) == ()
    assert page_figures("size", [in_noise()]) == ()
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
    (shown,) = page_figures("baselines", [three_models(), kinds()])
    by_model = {row["model"]: row for row in shown.table.rows}
    assert [row["error"] for row in by_model.values()] == [1 / 8, 2 / 8, 4 / 8]
    assert [by_model["cnn"][key] for key in ("train_cpu_s", "prediction_ms")] == [10, 0.1]
    training = {name for name, row in by_model.items() if row["on_training_front"]}
    prediction = {name for name, row in by_model.items() if row["on_prediction_front"]}
    assert training == {"cnn", "linear"}  # the forest is less accurate and slower than linear
    assert prediction == {"cnn", "forest"}  # linear is less accurate and slower than the network
    assert shown.title.startswith("cnn: lowest error in 1 of 1 tasks")
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
    assert values["1 placement per session", "held-out grasps", "placebo"] == 60
    assert values["5 placements per session", "held-out sessions", "objects"] == 60
    assert len(values) == 8
    assert shown.title == (
        "Identical objects are “recognised”: 60 % with 1 placement per session, "
        "30 % with 5 placements per session (chance 25 %)"
    )
    drawn = [text.get_text() for axes in shown.draw().axes for text in axes.get_yticklabels()]
    assert "held-out sessions" in drawn
    assert page_figures("placement", [kinds(page="placement")]) == ()


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


def test_predictions_at_the_mirror_image_are_a_cause_without_an_ablation():
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
