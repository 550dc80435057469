"""Models that take the dimensions of a feature, and models with covariates: known answers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import soundfile as sf
from sklearn.linear_model import LinearRegression

from ajgdata.evaluate.crossval import cross_validate
from ajgdata.evaluate.task_data import TrainingCopies, training_data, training_part
from ajgdata.experiments.requests import requested_experiments
from ajgdata.export import Deployed
from ajgdata.features.compute import FeatureComputer
from ajgdata.live.predictor import Predictor
from ajgdata.loading import read_predictor
from ajgdata.models import make_model
from ajgdata.models.inputs import WithCovariates
from ajgdata.paths import Paths
from ajgdata.pipeline.train import train_model
from ajgdata.report.model_card import render_model_card
from ajgdata.store.feature_array import frequency_axis
from ajgdata.store.features import FeatureColumn, FeatureRows, text_column
from ajgdata.store.models import read_about
from ajgdata.types import (
    MODELS,
    AudioSettings,
    DataError,
    DatasetSpec,
    FeatureSettings,
    Model,
    NotPossibleError,
    TrainingSettings,
)
from ajgdata.types.features import MelSettings
from ajgdata.types.input_layout import InputLayout
from ajgdata.types.registry import TRUSTED_TYPES

OWN_PACKAGE = Path(__file__).resolve().parents[2] / "docs" / "examples" / "own_dimensions_package"
RATE_HZ = 8_000
AUDIO = AudioSettings(sample_rate_hz=RATE_HZ)
MEL = MelSettings(window=256, hop=256, bands=16, over_time="frames", length_s=0.5)
SETTINGS = f'{{"audio": {{"sample_rate_hz": {RATE_HZ}}}, "features": {MEL.model_dump_json()}}}'


def cyclic_chirp(direction: str, begin: float) -> np.ndarray:
    """0.5 s of a tone that rises, or falls, through all frequencies, from any one of them."""
    turns = (np.arange(RATE_HZ // 2) / (RATE_HZ // 2) + begin) % 1
    if direction == "falling":
        turns = 1 - turns
    frequency_hz = 300 + 3_000 * turns
    return np.sin(2 * np.pi * np.cumsum(frequency_hz) / RATE_HZ).astype(np.float32)


@pytest.fixture(scope="module")
def chirps() -> tuple[np.ndarray, FeatureRows]:
    """Samples of 60 chirps, and their features.

    A window and a band have the same levels in both classes: only their arrangement differs.
    """
    generator = np.random.default_rng(0)
    labels = np.tile(["rising", "falling"], 30)
    sounds = np.array([cyclic_chirp(label, generator.uniform()) for label in labels])
    compute = FeatureComputer(AUDIO, MEL)
    names = [f"s/{number}" for number in range(len(labels))]
    columns = {
        "recording": text_column(names),
        "grasp_id": text_column(names),
        "object": text_column(labels),
        "direction": text_column(labels),
    }
    values = np.array([compute(samples).values for samples in sounds])
    return sounds, FeatureRows(values, compute.axes, columns, {"settings": SETTINGS}, "mel")


@pytest.fixture
def own_model(monkeypatch) -> str:
    """The name of the model of the example package, as if it were installed."""
    monkeypatch.syspath_prepend(str(OWN_PACKAGE))
    monkeypatch.setitem(
        MODELS, "modulations", Model("own_dimensions:modulations", "modulations", several=False)
    )
    trusted = (*TRUSTED_TYPES, "own_dimensions.Modulations")
    monkeypatch.setattr("ajgdata.loading.TRUSTED_TYPES", trusted)
    return "modulations"


def layout_of(table: FeatureRows, *covariates: str) -> InputLayout:
    return InputLayout({axis.name: axis.values for axis in table.axes}, covariates)


# Dimensions


@pytest.mark.parametrize(("model", "low", "high"), [("modulations", 0.95, 1), ("linear", 0, 0.7)])
def test_a_model_with_dimensions_sees_what_exists_only_in_their_arrangement(
    own_model, chirps, model, low, high
):
    _, table = chirps
    label = table.columns["direction"].values
    result = cross_validate(
        table.flat,
        label,
        np.arange(len(label)),
        kind="classification",
        model=model,
        layout=layout_of(table),
    )
    # 60 recordings: chance is 0.5, with a standard error of 0.065
    assert low <= result.scores.mean["accuracy"] <= high


def test_a_model_with_dimensions_is_stored_and_predicts_a_file(own_model, chirps, tmp_path):
    sounds, table = chirps
    settings = TrainingSettings(
        target="direction", kind="classification", unit="", groups="grasp_id"
    )
    folder = tmp_path / "model"
    train_model(table, settings, model=own_model, seed=0, folder=folder)
    predictor = read_predictor(folder, "d", "direction")
    sf.write(tmp_path / "new.wav", cyclic_chirp("falling", 0.123), RATE_HZ, subtype="FLOAT")
    prediction = predictor.predict_file(tmp_path / "new.wav")
    assert (prediction.value, prediction.probability["falling"] > 0.9) == ("falling", True)
    assert prediction.novelty is not None and prediction.novelty <= 1
    assert predictor.predict(sounds[0], RATE_HZ).value == "rising"
    # the loaded model accepts features with their dimensions, and flat ones
    estimator = predictor.estimator
    assert estimator.predict(table.feature).tolist() == estimator.predict(table.flat).tolist()
    with pytest.raises(NotPossibleError, match="feature mel cannot be exported"):
        Deployed(predictor)


def test_a_model_with_dimensions_gets_their_names_and_coordinates(own_model, chirps):
    _, table = chirps
    model = make_model(own_model, "regression", layout=layout_of(table))
    assert model.shape == table.feature.shape[1:] == (15, 16)
    assert model.estimator[0].frame_s == pytest.approx(256 / RATE_HZ)


def test_a_model_with_dimensions_refuses_other_inputs(own_model, chirps):
    _, table = chirps
    with pytest.raises(NotPossibleError, match="modulations takes the dimensions of the feature"):
        make_model(own_model, "regression")
    flat = InputLayout({"frequency": np.arange(240)})
    with pytest.raises(NotPossibleError, match="modulations needs a feature with the dimensions"):
        make_model(own_model, "regression", layout=flat)
    model = make_model(own_model, "regression", layout=layout_of(table))
    with pytest.raises(NotPossibleError, match="a feature has 239 values, but its dimensions"):
        model.fit(table.flat[:, :-1], np.arange(60.0))


# Covariates

NOISE_G = 0.1


def planted(count: int = 80) -> FeatureRows:
    """Recordings whose mass is the sum of a size, which is in the feature, and of the force.

    The force also shifts the values of the feature that contain the size.
    """
    generator = np.random.default_rng(0)
    size = generator.uniform(-2, 2, count)
    force = generator.uniform(3, 9, count)
    mass = 50 + 3 * size + 2 * force + generator.normal(0, NOISE_G, count)
    feature = generator.normal(1, 0.01, (count, 12))
    feature[:, :6] += (size - 0.5 * force)[:, np.newaxis]
    names = [f"s/{number}" for number in range(count)]
    heavy = np.where(3 * size + 2 * (force - 6) > 0, "heavy", "light")
    columns = {
        "recording": text_column(names),
        "grasp_id": text_column(names),
        "object": text_column(heavy),
        "weight": text_column(heavy),
        "mass_g": FeatureColumn(mass, {"units": "g"}),
        "robot_force_n": FeatureColumn(force, {"units": "N"}),
        "unrelated": FeatureColumn(generator.normal(0, 1, count), {"units": "1"}),
    }
    axes = (frequency_axis(np.arange(12.0)),)
    return FeatureRows(feature.astype(np.float32), axes, columns, {"settings": SETTINGS})


def task(kind: str, *covariates: str) -> TrainingSettings:
    target = {"regression": "mass_g", "classification": "weight"}[kind]
    settings = {"target": target, "kind": kind, "unit": "", "groups": "grasp_id"}
    return TrainingSettings.model_validate(settings | {"covariates": covariates})


def score(model: str, kind: str, *covariates: str) -> float:
    """The RMSE, or the accuracy, of held-out recordings."""
    table = planted()
    data = training_data(table, task(kind, *covariates))
    result = cross_validate(
        data.feature,
        data.value,
        data.group,
        kind=kind,
        model=model,
        layout=layout_of(table, *covariates),
    )
    return result.scores.mean["rmse" if kind == "regression" else "accuracy"]


def test_a_linear_model_with_covariates_is_least_squares_on_both():
    """The theorem of Frisch, Waugh and Lovell."""
    data = training_data(planted(), task("regression", "robot_force_n"))
    known, new = data.where(np.arange(50)), data.where(np.arange(50, 80))
    model = WithCovariates(LinearRegression(), 1).fit(known.feature, known.value)
    joint = LinearRegression().fit(known.feature, known.value)
    # features are float32, and their columns are nearly equal
    assert model.predict(new.feature) == pytest.approx(joint.predict(new.feature), abs=1e-3)


@pytest.mark.parametrize(("model", "own_error"), [("ridge", 0.1), ("knn_plain", 0.3)])
def test_with_the_covariate_the_error_is_that_of_the_model_and_the_planted_noise(model, own_error):
    """`own_error` is that of the model for the size alone, in g: k-NN has few neighbours."""
    assert score(model, "regression", "robot_force_n") < np.hypot(NOISE_G, own_error)


def test_without_the_covariate_the_error_is_that_of_the_force():
    # the feature has size - force / 2, which differs little for a large mass and for a small one
    assert score("knn_plain", "regression") > 3


def test_the_covariate_alone_has_the_error_of_the_rest():
    # a uniform size in [-2, 2] has the standard deviation 4 / sqrt(12), times 3 g
    error = score("covariates_alone", "regression", "robot_force_n")
    assert error == pytest.approx(3 * 4 / np.sqrt(12), rel=0.15)


@pytest.mark.parametrize("model", ["linear_plain", "knn_plain"])
def test_an_unrelated_covariate_changes_nothing(model):
    # the effect of the covariate has a standard error of 1 / sqrt(64) of the target
    without = score(model, "regression")
    assert score(model, "regression", "unrelated") == pytest.approx(without, rel=0.1)
    accuracy = score(model, "classification")
    assert score(model, "classification", "unrelated") == pytest.approx(accuracy, abs=0.06)


def one_force_per_session(kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Return inputs (120, 13) and targets (120,) of two sessions, of 60 recordings each.

    The covariate, the last column, is 0.3 in the first session and 0.7 in the second one.
    """
    table = planted(120)
    force = np.repeat([0.3, 0.7], 60)
    assert 0 < np.std(force[:60]) < 1e-15  # of rounding
    value = table.columns["mass_g" if kind == "regression" else "weight"].values
    return np.column_stack([table.flat, force]), value


@pytest.mark.parametrize("kind", ["regression", "classification"])
@pytest.mark.parametrize("model", ["linear_plain", "knn_plain"])
def test_one_force_per_session_changes_nothing_in_a_held_out_session(model, kind):
    inputs, value = one_force_per_session(kind)
    layout = layout_of(planted(), "force_n")
    with_force = make_model(model, kind, layout=layout).fit(inputs[:60], value[:60])
    without = make_model(model, kind).fit(inputs[:60, :-1], value[:60])
    expected = without.predict(inputs[60:, :-1])
    if kind == "regression":
        assert with_force.predict(inputs[60:]) == pytest.approx(expected)
    else:
        assert with_force.predict(inputs[60:]).tolist() == expected.tolist()


def test_one_force_per_session_alone_predicts_as_in_the_training_session():
    inputs, mass = one_force_per_session("regression")
    inputs[:60, -1] += 1e-12 * np.arange(60)  # more than the rounding of one value
    layout = layout_of(planted(), "force_n")
    model = make_model("covariates_alone", "regression", layout=layout).fit(inputs[:60], mass[:60])
    predicted = model.predict(inputs)
    assert predicted == pytest.approx(np.full(120, predicted[0]))


def test_one_force_per_class_leaves_the_feature_unchanged():
    """Within classes, the force has no effect that can be measured."""
    inputs, heavy = one_force_per_session("classification")
    inputs[:, -1] = np.where(heavy == "heavy", 0.3, 0.7)
    layout = layout_of(planted(), "force_n")
    model = make_model("knn_plain", "classification", layout=layout).fit(inputs[:60], heavy[:60])
    assert np.all(model.effect_on_feature_ == 0)
    assert (model.predict(inputs[60:]) == heavy[60:]).mean() > 0.95


def test_the_covariate_and_the_feature_decide_a_class_together():
    assert score("linear_plain", "classification", "robot_force_n") > 0.93
    assert score("linear_plain", "classification") < 0.7
    assert score("covariates_alone", "classification", "robot_force_n") < 0.9


def test_classes_need_a_model_with_probabilities():
    with pytest.raises(NotPossibleError, match="has no probabilities, which covariates of a class"):
        score("svm_plain", "classification", "robot_force_n")


def test_covariates_alone_need_covariates():
    with pytest.raises(NotPossibleError, match="covariates_alone needs `covariates` of the task"):
        score("covariates_alone", "regression")


def trained(folder: Path, kind: str) -> Predictor:
    settings = task(kind, "robot_force_n")
    train_model(planted(), settings, model="knn_plain", seed=0, folder=folder)
    return read_predictor(folder, "d", "mass")


def test_a_prediction_needs_the_value_of_the_covariate(tmp_path):
    predictor = trained(tmp_path, "regression")
    table = planted()
    force = table.columns["robot_force_n"].values
    mass = table.columns["mass_g"].values
    predictions = predictor.of_features(table.flat, {"robot_force_n": force})
    assert np.std([p.value for p in predictions] - mass) < 3 * NOISE_G
    middle = table.flat[[np.argmin(np.abs(table.flat[:, 0] + 2))]]  # size 0 and 6 N
    low, high = (predictor.of_features(middle, {"robot_force_n": n})[0] for n in (5, 7))
    # the feature is the same: with 2 N more force, the size is larger by 1
    assert high.value - low.value == pytest.approx(3 * 1 + 2 * 2, rel=0.1)
    assert low.novelty == high.novelty  # the guard compares sounds
    for wrong, problem in (
        (None, "needs a value of the covariate 'robot_force_n'. Give it: covariates={'robot_forc"),
        ({"robot_force_n": np.nan}, "the covariate 'robot_force_n' is nan, not a number"),
        ({"robot_force_n": "strong"}, "the covariate 'robot_force_n' is strong, not a number"),
        ({"robot_force_n": [4, 5]}, "has the shape (2,). Give one number"),
        ({"robot_force_n": [[4], [5, 6]]}, "the covariate 'robot_force_n' is no array"),
        ({"robot_force_n": 4, "x": 1}, "has no covariate 'x'. Remove it: it has robot_force_n"),
    ):
        with pytest.raises(DataError) as caught:
            predictor.of_features(table.flat[:1], wrong)
        assert problem in str(caught.value)
    assert "and robot_force_n" in repr(predictor)


def test_the_description_of_a_model_names_its_covariates(tmp_path):
    trained(tmp_path, "regression")
    about = read_about(tmp_path)
    about["provenance"] = {
        "data_set": "d",
        "source": "recorded",
        "ajgdata_version": "1",
        "git_commit": "",
        "inputs_sha256": "",
    }
    card = render_model_card(about, [], {}, "k-NN", Paths(tmp_path))
    (fact,) = [line for line in card.splitlines() if line.startswith("| covariates |")]
    assert fact.startswith("| covariates | robot_force_n (3.") and fact.endswith(" N) |")
    assert 'predict_file("recording.wav", covariates={"robot_force_n": …})' in card


def test_a_covariate_outside_of_its_training_values_is_a_remark(tmp_path):
    predictor = trained(tmp_path, "classification")
    (covariate,) = predictor.covariates
    assert (covariate.name, covariate.unit) == ("robot_force_n", "N")
    assert 3 <= covariate.least < 4 and 8 < covariate.largest <= 9
    used = replace(predictor, features=FeatureSettings(window=22, hop=11))
    sound = np.random.default_rng(0).uniform(-0.5, 0.5, RATE_HZ).astype(np.float32)
    inside, outside = (used.predict(sound, RATE_HZ, None, {"robot_force_n": n}) for n in (6, 12))
    assert inside.remarks == []
    (remark,) = outside.remarks
    assert remark.startswith("robot_force_n 12 is outside its training values, 3.")
    rows = planted().flat[:2]
    predictions = predictor.of_features(rows, {"robot_force_n": [6, 12]})
    assert [prediction.remarks for prediction in predictions] == [[], [remark]]
    with pytest.raises(DataError, match=r"has the shape \(3,\). Give one number, or 2 numbers"):
        predictor.of_features(rows, {"robot_force_n": [4, 5, 6]})
    with pytest.raises(DataError, match=r"has the shape \(2,\). Give one number"):
        used.predict(sound, RATE_HZ, None, {"robot_force_n": [4, 5]})


def test_copies_have_the_covariates_of_their_recordings():
    data = training_data(planted(), task("regression", "robot_force_n"))
    copies = TrainingCopies(np.array([1, 0]), np.zeros((2, 12)))
    part = training_part(data, np.array([0, 1]), copies)
    assert part.feature[2:, -1].tolist() == data.feature[[1, 0], -1].tolist()
    assert part.feature.shape == (4, 13)


def test_a_missing_value_names_the_recordings():
    table = planted()
    table.columns["robot_force_n"].values[[3, 7]] = np.nan
    with pytest.raises(NotPossibleError) as caught:
        training_data(table, task("regression", "robot_force_n"))
    assert str(caught.value) == (
        "covariate 'robot_force_n' has no value for 2 of 80 recordings (s/3, s/7): add the values "
        "to recordings.csv, or reject the recordings"
    )
    with pytest.raises(NotPossibleError, match="there is no column 'force' in recordings"):
        training_data(table, task("regression", "force"))
    with pytest.raises(NotPossibleError, match="covariate 'weight' is text: declare it under"):
        training_data(table, task("regression", "weight"))


SPEC = {
    "name": "d",
    "targets": {"mass_g": {"kind": "regression", "unit": "g"}},
    "tasks": {"mass": {"target": "mass_g", "models": ["ridge"], "covariates": ["robot_force_n"]}},
}


def test_a_task_with_covariates_also_has_the_row_of_the_covariates_alone():
    spec = DatasetSpec.model_validate(SPEC)
    (request,) = requested_experiments(spec, "mass")
    assert request.part_names == ["ridge", "covariates_alone"]
    assert request.label(request.parts[1], "regression") == "covariates alone"
    assert spec.trained_models() == [("mass", "ridge")]
    assert spec.training("mass").covariates == ("robot_force_n",)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"covariates": ["mass_g"]}, "covariate mass_g is the target itself"),
        ({"covariates": ["a", "a"]}, "twice"),
        (
            {"experiments": {"conformal_intervals": {}}},
            "experiments.conformal_intervals has no covariates",
        ),
    ],
)
def test_wrong_covariates_are_errors(change, problem):
    content = {**SPEC, "tasks": {"mass": SPEC["tasks"]["mass"] | change}}
    with pytest.raises(ValueError, match=problem):
        requested_experiments(DatasetSpec.model_validate(content), "mass")
