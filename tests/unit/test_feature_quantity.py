"""Quantities of the feature on recordings with and without noise: errors, distances, words."""

import shutil

import numpy as np
import pytest
from drawn_figures import fits
from worlds import AUDIO, RATE_HZ, Project

from ajgdata.acquire.excitation import excitation_samples
from ajgdata.evaluate.crossval import cross_validate
from ajgdata.evaluate.task_data import task_data
from ajgdata.experiments import EXPERIMENTS
from ajgdata.experiments.base import Inputs, Other, Result, TaskResults
from ajgdata.experiments.feature_quantity import Settings, label_of, measure, variants
from ajgdata.experiments.feature_quantity.shown import lines_of, tables
from ajgdata.features.maker import feature_maker
from ajgdata.models import model_label
from ajgdata.paths import Paths
from ajgdata.pipeline.recordings import RecordingReader
from ajgdata.report.canvas import draw
from ajgdata.store.audio import write_pcm24
from ajgdata.store.features import Column, Shard, text_column
from ajgdata.types import (
    FeatureSettings,
    Level,
    LinearSweep,
    MaximumLengthSequence,
    NotPossibleError,
)

FEATURES = FeatureSettings(window=256, hop=64)
SWEEP = LinearSweep(length_s=0.5, low_hz=100, high_hz=3_500, amplitude=0.4)
CHANGES = ({"quantity": "power"}, {"kind": "sweep_tracking", "decay_s": 0.02},
           {"kind": "transfer_function"})  # fmt: skip
EXPERIMENT = EXPERIMENTS["feature_quantity"]
NAMES = [f"s1/r{n:02d}" for n in range(24)]


def heard(number: int, played: np.ndarray) -> np.ndarray:
    """An echo whose delay is the size that is to be read: 1 to 12 samples."""
    late = 1 + number // 2
    sound = played.copy()
    sound[late:] += 0.5 * played[:-late]
    return sound + 1e-4 * np.random.default_rng(number).standard_normal(len(played))


def recorded(root, name: str, noise: float, declared=SWEEP) -> Shard:
    """Twelve grasps of two recordings each; returns a store of one feature of them."""
    project = Project(Paths(root))
    played = excitation_samples(declared, RATE_HZ)
    rows = project.session("s1", {one.partition("/")[2]: 500.0 for one in NAMES})
    for n, row in enumerate(rows):
        loud = noise * np.random.default_rng(100 + n).standard_normal(len(played))
        path = project.folder() / row.file
        write_pcm24(path, heard(n, played) / 2 + loud, RATE_HZ)
    rows = [row.model_copy(update={"sha256": ""}) for row in rows]
    project.write(rows, excitation=project.excitation("s1", played))
    project.declare()
    grasp = np.arange(24) // 2
    columns = {
        "recording": text_column(NAMES),
        "grasp_id": text_column([f"s1/g{n}" for n in grasp]),
        "edge_mm": Column(1.0 + grasp, {"units": "mm"}),
    }
    attrs = {"data_set": name, "source": "simulated", "settings": "{}"}
    return Shard(np.ones((24, 129), np.float32), np.arange(129.0), columns, attrs)


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    """Inputs of a quiet data set `d` and a loud one, each a project of its own."""
    root = tmp_path_factory.mktemp("quantities")
    quiet, loud = recorded(root / "q", "d", 0), recorded(root / "l", "loud", 0.05)
    for name, project in (("d", "q"), ("loud", "l")):
        shutil.copytree(Paths(root / project).sessions("d"), Paths(root).sessions(name))
    recordings = RecordingReader(Paths(root), {"d": AUDIO, "loud": AUDIO})
    return Inputs(
        "d", "t", "edge_mm", "regression", "mm", "grasp_id", 3, 0, quiet, {"loud": loud},
        audio=AUDIO, features=FEATURES, recordings=recordings,
    )  # fmt: skip


SETTINGS = Settings(features=CHANGES, models=("ridge_plain",), test_on=("loud",))


@pytest.fixture(scope="module")
def outcome(world):
    return measure(world, SETTINGS, "")


def tables_of(outcome):
    return {table.name: table for table in outcome.tables}


def results_of(outcome, settings=SETTINGS):
    result = Result("", "", {}, tables_of(outcome), {table.name: table for table in outcome.cost})
    level = {"unit": "dBA", "quantity": "sound outside"}
    return TaskResults(
        "feature_quantity", "d", "Echoes", "t", "regression", "edge_mm", "mm", "grasp_id",
        "simulated", settings, (result,), others={"loud": Other("Loud", Level(value=80, **level))},
        level=Level(value=45, **level),
    )  # fmt: skip


def mean(outcome, part):
    scores = tables_of(outcome)["scores"].where(part=part, metric="rmse", statistic="mean")
    return scores.numbers("value")[0]


def test_the_errors_are_those_of_features_made_alone(world, outcome):
    played = excitation_samples(SWEEP, RATE_HZ)
    own = variants(SETTINGS, FEATURES)
    assert own[0] == FEATURES and own[3].kind == "transfer_function"
    for one, part in zip(own, tables_of(outcome)["features"].column("part"), strict=True):
        # the played sound as its session keeps it: 24 bits
        make = feature_maker(one, RATE_HZ, world.recordings.played("d", NAMES[0]))
        assert np.allclose(world.recordings.played("d", NAMES[0]), played, atol=2**-23)
        feature = np.array([make(s) for s in world.recordings.samples("d", NAMES, 256)])
        data = task_data(world.store, "edge_mm", "regression", "grasp_id")
        alone = cross_validate(
            feature, data.value, data.group, kind="regression", model="ridge_plain", folds=3, seed=0
        )
        assert mean(outcome, part) == pytest.approx(alone.scores.mean["rmse"], rel=1e-9)


def test_less_noise_comes_in_where_the_sweep_is(outcome):
    """A pedestal of white noise grows with the frames that count (test_sweep_tracking); distances
    fall with it."""
    moved = tables_of(outcome)["moved"]
    parts = tables_of(outcome)["features"].column("part")
    summed, power, tracked, _ = (moved.where(part=p).numbers("moved")[0] for p in parts)
    assert 0 < tracked < summed / 2 and power < summed / 2
    assert mean(outcome, f"{parts[2]} on:loud") < mean(outcome, f"{parts[0]} on:loud")


def test_times_are_of_each_feature(outcome):
    cost = next(iter(outcome.cost))
    times = cost.where(metric="feature_s_per_recording")
    assert len(times.rows) == 4 and (times.numbers("value") > 0).all()


def test_the_same_twice(world, outcome):
    assert measure(world, SETTINGS, "").tables == outcome.tables


def test_what_is_shown_has_a_line_a_feature_in_rising_order_of_level(outcome):
    results = results_of(outcome)
    lines = lines_of(results, "ridge_plain")
    assert [line.label for line in lines] == [
        "sum of magnitudes", "sum of powers", "magnitudes where the sweep is, + 20 ms",
        "transfer function",
    ]  # fmt: skip
    parts = tables_of(outcome)["features"].column("part")
    assert lines[2].errors[1][0] == mean(outcome, f"{parts[2]} on:loud")
    errors, moved = tables(results)
    assert errors.heads == ("Model", "Feature", "45 dBA|", "80 dBA|", "Run time|")
    assert errors.rows[0][0] == model_label("ridge_plain", "regression")
    assert errors.rows[0][-1] == "1" and len(errors.rows) == len(moved.rows) == 4
    (figure,) = EXPERIMENT.figures(results)
    drawn = draw(figure)
    (axes,) = drawn.axes
    assert axes.get_yscale() == "log" and fits(drawn)
    levels = [line.get_xdata() for line in axes.get_lines() if len(line.get_xdata()) == 2]
    assert len(levels) == 4 and all(list(one) == [45, 80] for one in levels)
    assert "at 80 dBA" in figure.caption.alt


def test_a_sound_that_is_no_sweep_is_told_and_nothing_is_measured(tmp_path):
    sequence = MaximumLengthSequence(length_s=0.5, amplitude=0.4)
    store = recorded(tmp_path, "d", 0, sequence)
    inputs = Inputs(
        "d", "t", "edge_mm", "regression", "mm", "grasp_id", 3, 0, store, audio=AUDIO,
        features=FEATURES, recordings=RecordingReader(Paths(tmp_path), {"d": AUDIO}),
    )  # fmt: skip
    with pytest.raises(NotPossibleError, match=r"session s1: .* no sweep that can be tracked"):
        measure(inputs, Settings(features=CHANGES[1:2]), "")


@pytest.mark.parametrize(
    ("features", "own", "problem"),
    [
        ([{"quantity": "magnitude"}], {}, "tried twice, or is the data set's own"),
        ([{"quantity": "power"}] * 2, {}, "tried twice"),
        ([{"kind": "transfer_function"}], {"window": 16_384}, "too long a response"),
        ([{"quantity": "power"}], {"align": True}, "no features.align"),
    ],
)
def test_what_cannot_be_compared_is_refused_where_it_is_declared(features, own, problem):
    with pytest.raises(ValueError, match=problem):
        EXPERIMENT.check(Settings(features=features), "regression", FeatureSettings(**own))


def test_the_default_list_has_each_kind_and_both_ends_of_the_decay_time():
    tried = variants(Settings(), FeatureSettings())
    EXPERIMENT.check(Settings(), "regression", FeatureSettings())
    assert {one.kind for one in tried} == {"stft", "sweep_tracking", "transfer_function"}
    decays = sorted(one.decay_s for one in tried if one.kind == "sweep_tracking")
    assert decays[1] == pytest.approx(np.sqrt(decays[0] * decays[2]), rel=1e-12)
    assert len(set(map(label_of, tried))) == len(tried) == 7
