"""Planning: variance components with known answers, half widths, the search, and the command."""

import itertools
import os
import re

import numpy as np
import pytest
from worlds import assert_one_line

from ajgdata.evaluate.planning import (
    Component,
    DesignLevel,
    DesignTimes,
    RecordingPlan,
    cheapest_design,
    design_units,
    half_width,
    pilot_design,
    pilot_half_width,
    recording_scores,
    spread_designs,
    variance_components,
)
from ajgdata.paths import Paths, run_name
from ajgdata.store.feature_array import frequency_axis
from ajgdata.store.features import FeatureRows, text_column, write_store
from ajgdata.store.metrics import PREDICTION_COLUMNS, read_predictions, write_predictions

SESSION = DesignLevel.SESSION
OBJECT = DesignLevel.OBJECT
IN_SESSION = DesignLevel.OBJECT_IN_SESSION
PLACEMENT = DesignLevel.PLACEMENT
GRASP = DesignLevel.GRASP
RECORDING = DesignLevel.RECORDING
#: Standard deviations of the simulated levels.
SD = {SESSION: 3.0, IN_SESSION: 2.0, PLACEMENT: 2.5, GRASP: 1.5, RECORDING: 1.0, OBJECT: 4.0}
TIMES = DesignTimes(session=30, placement=1, grasp=0.5)


def balanced_units(design):
    """Units of the levels of a design without missing recordings."""
    grid = np.indices(design).reshape(len(design), -1)
    session, object_name, placement, grasp, _ = grid
    return design_units(session, object_name, placement, grasp)


def drawn_scores(units, sd, generator):
    """Scores with normal effects of each level."""
    scores = np.full(len(units[RECORDING]), 50.0)
    for level, member in units.items():
        effects = generator.normal(0, sd.get(level, 0), member.max() + 1)
        scores += effects[member]
    return scores


def component(level, sd, units=4):
    """A component of one level."""
    return Component((level,), units, float(units), sd**2)


def test_balanced_components_are_those_of_the_analysis_of_variance():
    design = RecordingPlan(sessions=3, objects=4, placements=2, grasps=5, recordings=2)
    scores = drawn_scores(balanced_units(design), SD, np.random.default_rng(0))
    cells = scores.reshape(design)

    def mean_square(residual, degrees):
        return np.sum(np.broadcast_to(residual, design) ** 2) / degrees

    def mean(*axes):
        return cells.mean(axis=axes, keepdims=True)

    whole = mean(0, 1, 2, 3, 4)
    session = mean(1, 2, 3, 4)
    in_session = mean(2, 3, 4)
    objects = mean(0, 2, 3, 4)
    placement = mean(3, 4)
    grasp = mean(4)
    squares = {
        SESSION: mean_square(session - whole, 2),
        OBJECT: mean_square(objects - whole, 3),
        IN_SESSION: mean_square(in_session - session - objects + whole, 6),
        PLACEMENT: mean_square(placement - in_session, 12),
        GRASP: mean_square(grasp - placement, 96),
        RECORDING: mean_square(cells - grasp, 120),
    }
    expected = {
        SESSION: (squares[SESSION] - squares[IN_SESSION]) / 80,
        OBJECT: (squares[OBJECT] - squares[IN_SESSION]) / 60,
        IN_SESSION: (squares[IN_SESSION] - squares[PLACEMENT]) / 20,
        PLACEMENT: (squares[PLACEMENT] - squares[GRASP]) / 10,
        GRASP: (squares[GRASP] - squares[RECORDING]) / 2,
        RECORDING: squares[RECORDING],
    }
    estimates = variance_components(scores, balanced_units(design))
    assert {item.levels[0]: item.estimate for item in estimates} == pytest.approx(expected)
    assert [item.units for item in estimates] == [3, 12, 24, 120, 240, 4]
    assert [item.effective_units for item in estimates] == pytest.approx([3, 12, 24, 120, 240, 4])


def test_components_of_unbalanced_data_are_unbiased():
    generator = np.random.default_rng(1)
    design = RecordingPlan(sessions=6, objects=5, placements=3, grasps=3, recordings=2)
    present = generator.random(np.prod(design)) < 0.7  # 30 % of the recordings are missing
    labels = np.indices(design).reshape(len(design), -1)[:4, present]
    units = design_units(*labels)
    repeats = [
        [item.estimate for item in variance_components(drawn_scores(units, SD, generator), units)]
        for _ in range(200)
    ]
    levels = [item.levels[0] for item in variance_components(np.arange(present.sum()), units)]
    expected = [SD[level] ** 2 for level in levels]
    standard_error = np.std(repeats, axis=0) / np.sqrt(len(repeats))
    assert np.all(np.abs(np.mean(repeats, axis=0) - expected) < 3 * standard_error)
    assert np.all(standard_error < 0.15 * np.array(expected))


def test_a_negative_estimate_counts_as_zero():
    # both recordings of a grasp differ by 2, and all grasps have the same mean
    units = design_units(np.zeros(8, int), np.zeros(8, int), np.zeros(8, int), np.arange(8) // 2)
    grasp, recording = variance_components(np.tile([0.0, 2.0], 4), units)
    assert (grasp.levels, grasp.estimate, grasp.variance) == ((GRASP,), -1.0, 0.0)
    assert (recording.levels, recording.variance) == ((RECORDING,), 2.0)


def test_rounding_is_no_variance():
    design = RecordingPlan(sessions=3, objects=4, placements=2, grasps=2, recordings=2)
    units = balanced_units(design)
    scores = np.array([0.1, 0.7, 1.3, 2.9])[units[OBJECT]]  # equal in all recordings of an object
    estimates = variance_components(scores, units)
    assert [item.estimate for item in estimates[:-1]] == [0, 0, 0, 0, 0]
    assert estimates[-1].variance == pytest.approx(np.var([0.1, 0.7, 1.3, 2.9], ddof=1))


def test_levels_that_the_data_cannot_separate_have_one_component():
    design = RecordingPlan(sessions=3, objects=2, placements=1, grasps=4, recordings=1)
    units = balanced_units(design)
    estimates = variance_components(np.arange(24.0), units)
    levels = [item.levels for item in estimates]
    assert levels == [(SESSION,), (IN_SESSION, PLACEMENT), (GRASP, RECORDING), (OBJECT,)]
    single = design_units(*(np.zeros(24, int) if i == 1 else units[SESSION] for i in range(4)))
    joined, _ = variance_components(np.arange(24.0), single)
    assert joined.name == "session = object in session = placement = grasp"


def test_the_half_width_is_analytic():
    components = [component(level, sd) for level, sd in SD.items()]
    design = RecordingPlan(sessions=5, objects=4, placements=3, grasps=2, recordings=2)
    variance = 9 / 5 + 4 / 20 + 6.25 / 60 + 2.25 / 120 + 1 / 240
    assert half_width(components, design) == pytest.approx(2.776445 * variance**0.5)
    with_objects = half_width(components, design, new_objects=True)
    assert with_objects == pytest.approx(3.182446 * (variance + 16 / 4) ** 0.5)  # 3 degrees
    assert half_width(components, design._replace(sessions=1)) == np.inf


def test_joined_levels_count_for_the_first_and_at_best_for_the_last():
    joined = [Component((IN_SESSION, PLACEMENT), 8, 8.0, 4.0)]
    design = RecordingPlan(sessions=2, objects=4, placements=5, grasps=1, recordings=1)
    quantile = 12.706205
    assert half_width(joined, design) == pytest.approx(quantile * (4 / 8) ** 0.5)
    assert half_width(joined, design, at_best=True) == pytest.approx(quantile * (4 / 40) ** 0.5)


def test_intervals_of_sessions_contain_the_mean_as_often_as_stated():
    generator = np.random.default_rng(2)
    design = RecordingPlan(sessions=4, objects=3, placements=2, grasps=2, recordings=2)
    units = balanced_units(design)
    sd = SD | {OBJECT: 0.0}
    inside = 0
    for _ in range(400):
        scores = drawn_scores(units, sd, generator)
        width = pilot_half_width(variance_components(scores, units), pilot_design(units))
        inside += abs(scores.mean() - 50) <= width
    assert 0.92 < inside / 400 < 0.98


def test_the_pilot_counts_as_many_units_as_unbalanced_data_are_worth():
    session = np.repeat([0, 1], [3, 1])
    units = design_units(session, np.zeros(4, int), np.zeros(4, int), np.arange(4))
    sessions = variance_components(np.array([0.0, 1, 2, 9]), units)[0]
    assert sessions.units == 2
    assert sessions.effective_units == pytest.approx(16 / (9 + 1))
    assert pilot_design(units) == RecordingPlan(2, 1, 1, 2, 1)


def test_the_search_returns_the_fastest_design():
    components = [component(level, sd) for level, sd in SD.items()]
    pilot = RecordingPlan(sessions=4, objects=3, placements=1, grasps=5, recordings=2)
    best = cheapest_design(components, 2.5, pilot, TIMES)
    numbers = itertools.product(range(2, 21), [3], range(1, 11), range(1, 11), [2])
    designs = [RecordingPlan(*row) for row in numbers]
    sufficient = [design for design in designs if half_width(components, design) <= 2.5]
    fastest = min(
        sufficient, key=lambda item: (TIMES.total(item), item.total_placements, item.total_grasps)
    )
    assert best == fastest
    assert half_width(components, best) <= 2.5


def test_only_sessions_help_against_variance_between_sessions():
    # t(8) * 3 / 3 = 2.306, and t(7) * 3 / 8**0.5 = 2.508
    best = cheapest_design([component(SESSION, 3)], 2.4, RecordingPlan(4, 3, 2, 5, 2), TIMES)
    assert best == RecordingPlan(9, 3, 1, 1, 2)


def test_only_objects_help_against_variance_between_objects():
    # with 12 sessions and 12 objects: t(11) * 4 / 12**0.5 = 2.541, with 11: t(10) gives 2.687
    best = cheapest_design(
        [component(OBJECT, 4)], 2.6, RecordingPlan(4, 3, 2, 5, 2), TIMES, new_objects=True
    )
    assert best.objects >= 12 and best.placements == best.grasps == 1
    many = cheapest_design([component(OBJECT, 4)], 0.1, RecordingPlan(4, 3, 2, 5, 2), TIMES)
    assert many.sessions == 2


def test_a_goal_that_no_design_reaches_has_no_design():
    pilot = RecordingPlan(4, 3, 1, 5, 2)
    assert cheapest_design([component(SESSION, 3)], 0.1, pilot, TIMES) is None


def test_spread_designs_have_as_many_grasps():
    design = RecordingPlan(sessions=4, objects=3, placements=2, grasps=5, recordings=2)
    own_placements, own_sessions = spread_designs(design)
    assert own_placements == RecordingPlan(4, 3, 10, 1, 2)
    assert own_sessions == RecordingPlan(40, 3, 1, 1, 2)
    assert own_placements.total_grasps == own_sessions.total_grasps == design.total_grasps


def test_scores_are_percent_correct_or_a_linear_rmse():
    accuracy = recording_scores(np.array(["a", "b"]), np.array(["a", "a"]), "classification")
    assert accuracy.tolist() == [100.0, 0.0]
    angles = recording_scores(np.array([1.0, 5]), np.array([178.0, 9]), "regression", period=180)
    assert angles == pytest.approx(np.array([9, 16]) / (2 * 12.5**0.5))
    assert recording_scores(np.ones(2), np.ones(2), "regression").tolist() == [0, 0]


def write_run(project, *, sessions=3, is_correct=None, placements=True, **target):
    """A data set with two objects, two placements, two grasps and two recordings in each session,
    and the predictions of its last run; `is_correct` of the numbers of a recording."""
    target = target or {"kind": "classification"}
    project.declare(targets={"label": target}, tasks={"label": {"target": "label"}})
    design = RecordingPlan(sessions, objects=2, placements=2, grasps=2, recordings=2)
    numbers = list(np.ndindex(design))
    names = [f"s{s}/o{o}_{p}_{g}_{r}" for s, o, p, g, r in numbers]
    columns = {
        "recording": text_column(names),
        "session_id": text_column([f"s{s}" for s, *_ in numbers]),
        "object": text_column([f"o{o}" for _, o, *_ in numbers]),
        "grasp_id": text_column([f"s{s}/o{o}_{p}_{g}" for s, o, p, g, _ in numbers]),
    }
    if placements:
        columns["placement_id"] = text_column([f"s{s}/o{o}_{p}" for s, o, p, *_ in numbers])
    features = np.zeros((len(names), 2), np.float32)
    file = project.paths.features("d")
    file.parent.mkdir(parents=True, exist_ok=True)
    write_store(
        file,
        FeatureRows(features, (frequency_axis(np.arange(2.0)),), columns, {"source": "recorded"}),
    )
    common = dict.fromkeys(PREDICTION_COLUMNS[:-1], "") | {
        "dataset": "d",
        "task": "label",
        "model": "knn",
        "split": "grouped",
        "test_set": "d",
        "target_values": "training",
    }
    rows = []
    for name, (session, held, placement, grasp, recording) in zip(names, numbers, strict=True):
        if target["kind"] == "regression":
            y_true = 10 * held
            y_pred = 10 * held + (1 if placement else 3)
        else:
            is_right = is_correct(session, held, placement, grasp, recording)
            y_true = f"o{held}"
            y_pred = f"o{held if is_right else 1 - held}"
        rows.append(common | {"recording": name, "y_true": y_true, "y_pred": y_pred})
    withheld = common | {"recording": names[0], "target_values": "withheld", "y_true": "x"}
    elsewhere = common | {"recording": "t1/x", "test_set": "e", "y_true": "x", "y_pred": "y"}
    write_predictions(project.paths.predictions, [*rows, withheld, elsewhere])


PLAN = ("plan", "d", "--task", "label", "--model", "knn", "--half-width")


def rows_of_tables(output):
    """The cells of each row of the printed tables, by the first cell."""
    lines = [re.split(r"\s{2,}", line) for line in output.splitlines()]
    return {first: cells for first, *cells in lines}


def is_second_placement_wrong(session, held, placement, grasp, recording):
    """The second placement of object 1 is wrong in all sessions: 75 % of all are correct."""
    return not (held == 1 and placement == 1)


def test_the_command_prints_components_and_designs(ajgdata, project, snapshot):
    write_run(project, is_correct=is_second_placement_wrong)
    before = snapshot(project.root)
    code, out, err = ajgdata(*PLAN, 20)
    assert snapshot(project.root) == before
    assert (code, err) == (0, "")
    assert out.startswith("accuracy 75.0 % (recorded; 48 held-out recordings, ")
    assert "split: grouped by grasp_id" in out
    rows = rows_of_tables(out)
    # mean squares: 10000 between placements, 30000 between objects, 0 in all else
    assert rows["session"] == ["3", "0"]
    assert rows["object in session"] == ["6", "0", "negative estimate, set to 0"]
    assert rows["placement"] == ["12", "50"]
    assert rows["recording"] == ["48", "0"]
    assert rows["object"] == ["2", "35.4", "not in the interval"]
    # t(2) * 50 / 12**0.5, t(3) * 50 / 64**0.5, t(2) * 50 / 24**0.5, t(11) * 50 / 24**0.5
    assert rows["present"] == ["3", "2", "2", "2", "2", "1.9", "±62.1"]
    assert rows["fastest for ±20"] == ["4", "2", "8", "1", "2", "3.6", "±19.9"]
    assert rows["one grasp per placement"] == ["3", "2", "4", "1", "2", "2.1", "±43.9"]
    assert rows["one grasp per session"] == ["12", "2", "1", "1", "2", "6.6", "±22.5"]
    assert "placement_id" not in out and "joined" not in out
    assert "3 sessions determine the variance between sessions poorly." in out


def test_stated_times_change_the_fastest_design(ajgdata, project):
    write_run(project, is_correct=is_second_placement_wrong)
    out = ajgdata(*PLAN, 20, "--session-minutes", 300)[1]
    assert rows_of_tables(out)["fastest for ±20"][:3] == ["3", "2", "20"]
    assert "Assumed times: 300 min per session, 1 min per placement, 0.5 min per grasp." in out


def test_without_placement_ids_an_object_in_a_session_is_one_placement(ajgdata, project):
    write_run(project, is_correct=is_second_placement_wrong, placements=False)
    code, out, _ = ajgdata(*PLAN, 50)
    assert code == 0
    rows = rows_of_tables(out)
    assert rows["object in session = placement"][0] == "6"
    assert "Without placement_id, the grasps of an object in a session" in out
    assert "The data cannot separate levels that are joined by =." in out


def test_errors_are_planned_in_the_unit_of_the_target(ajgdata, project):
    write_run(project, kind="regression", unit="mm")
    code, out, _ = ajgdata(*PLAN, 1)
    # squared errors of 1 and 9 for two placements, divided by twice the RMSE
    assert out.startswith(f"RMSE {5**0.5:.3g} mm (recorded; ")
    assert rows_of_tables(out)["level"] == ["units", "sd [mm]"]
    assert rows_of_tables(out)["placement"] == ["12", f"{(32 / 20) ** 0.5:.3g}"]
    assert code == 0


@pytest.mark.parametrize(
    ("run", "arguments", "message"),
    [
        ({"sessions": 1}, (20,), "one session: the variance between sessions cannot be estimated"),
        ({"is_correct": lambda *_: True}, (20,), "all scores of an object are equal"),
        ({"is_correct": lambda _, held, *__: held}, (20,), "all scores of an object are equal"),
        ({}, (0.1,), "no design of the search reaches ±0.1"),
    ],
)
def test_data_without_a_plan_need_attention(ajgdata, project, run, arguments, message):
    write_run(project, **{"is_correct": is_second_placement_wrong} | run)
    code, out, err = ajgdata(*PLAN, *arguments)
    assert code == 3
    assert out.startswith("accuracy ")
    assert err.startswith(message)
    assert err.count("\n") == 1


def test_mistakes_are_one_line(ajgdata, project):
    project.declare(
        targets={"label": {"kind": "classification"}}, tasks={"label": {"target": "label"}}
    )
    code, out, err = ajgdata(*PLAN, 5)
    assert (code, out) == (1, "")
    assert_one_line(err, "there are no predictions for d. Run `ajgdata run d` first.")
    write_run(project, is_correct=is_second_placement_wrong)
    for arguments, message in (
        (["--task", "x"], "there is no task 'x'. Use label."),
        (["--model", "cnn"], "'label cnn grouped'. Use one of: label knn grouped."),
        (["--new-objects"], "each class of label has one object."),
    ):
        code, out, err = ajgdata(*PLAN, 5, *arguments)
        assert (code, out) == (1, "")
        assert_one_line(err, message)


def write_predicted_correctly(project, *datasets):
    """Write the predictions of a run of selected data sets. They are those of the run of all data
    sets, but each of them is correct; return the file."""
    rows = [
        {**{k: v for k, v in row.items() if k != "format"}, "y_pred": row["y_true"]}
        for row in read_predictions(project.paths.predictions)
    ]
    file = Paths(project.root, run_name(datasets)).predictions
    write_predictions(file, rows)
    return file


def test_the_run_of_all_data_sets_counts_first_whatever_its_time(ajgdata, project):
    write_run(project, is_correct=is_second_placement_wrong)
    selected = write_predicted_correctly(project, "d")
    for number, file in enumerate((project.paths.predictions, selected)):
        os.utime(file, (number, number))
    out = ajgdata(*PLAN, 5)[1]
    assert out.startswith("accuracy 75.0 %") and str(project.paths.predictions) in out


def test_the_only_run_of_the_data_set_counts_without_one_of_all(ajgdata, project):
    write_run(project, is_correct=is_second_placement_wrong)
    selected = write_predicted_correctly(project, "d")
    write_predictions(project.paths.predictions, [])
    write_predictions(Paths(project.root, "e").predictions, [])
    out = ajgdata(*PLAN, 5)[1]
    assert out.startswith("accuracy 100.0 %") and str(selected) in out


def test_several_runs_of_the_data_set_are_ambiguous(ajgdata, project):
    write_run(project, is_correct=is_second_placement_wrong)
    write_predicted_correctly(project, "d")
    write_predicted_correctly(project, "d", "e")
    project.paths.predictions.unlink()
    code, out, err = ajgdata(*PLAN, 5)
    assert (code, out) == (1, "")
    assert_one_line(err, "several runs have predictions for d: d, d+e. ")


def test_predictions_without_a_label_are_outdated(ajgdata, project):
    write_run(project, sessions=2, is_correct=is_second_placement_wrong)
    predictions = project.paths.predictions.read_bytes()
    write_run(project, sessions=1, is_correct=is_second_placement_wrong)
    project.paths.predictions.write_bytes(predictions)
    code, _, err = ajgdata(*PLAN, 5)
    assert code == 1
    assert_one_line(err, "has no recording 's1/o0_0_0_0', which the run predicted.")


def test_held_out_sessions_are_planned_if_they_were_tested(ajgdata, project):
    write_run(project, is_correct=is_second_placement_wrong)
    rows = [
        {k: v for k, v in row.items() if k != "format"}
        for row in read_predictions(project.paths.predictions)
    ]
    own = [row for row in rows if (row["test_set"], row["target_values"]) == ("d", "training")]
    in_sessions = [{**row, "split": "session", "y_pred": row["y_true"]} for row in own[:-1]]
    wrong = {**own[-1], "split": "session", "y_pred": "o0"}
    write_predictions(project.paths.predictions, [*rows, *in_sessions, wrong])
    _, out, _ = ajgdata(*PLAN, 20)
    assert "split: session" in out
    assert out.startswith("accuracy 97.9 %")  # 47 of 48
    assert "--split session plans for" not in out
    _, out, _ = ajgdata(*PLAN, 20, "--split", "grouped")
    assert "split: grouped by grasp_id" in out and "--split session plans for" in out
