"""The CNN: scikit-learn's own checks, known answers, exact invariances."""

import numpy as np
import pytest
import skops.io
import torch

from ajgdata.models import make_model
from ajgdata.models.cnn import CnnClassifier, CnnRegressor
from ajgdata.types.registry import TRUSTED_TYPES

QUICK = {"epochs": 1, "min_steps": 60}


def peaks(n: int, n_features: int = 64, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Positive spectra, each with one peak at a random place in 0..1; L1-normalised."""
    rng = np.random.default_rng(seed)
    place = rng.uniform(0.2, 0.8, n)
    axis = np.linspace(0, 1, n_features)
    spectra = 0.1 + np.exp(-(((axis - place[:, None]) / 0.08) ** 2))
    spectra *= rng.uniform(0.95, 1.05, spectra.shape)
    return (spectra / spectra.sum(axis=1, keepdims=True)).astype(np.float32), place


@pytest.mark.parametrize("model", [CnnClassifier(**QUICK), CnnRegressor(**QUICK)])
def test_a_prediction_does_not_depend_on_the_other_rows(model):
    """Alone, in small batches, and in another order: up to the rounding of float32."""
    x, place = peaks(300)  # more than one chunk
    model.fit(x[:50], place[:50] > 0.5 if isinstance(model, CnnClassifier) else place[:50])
    outputs = getattr(model, "predict_proba", model.predict)
    together = outputs(x)
    order = np.random.default_rng(0).permutation(300)
    for parts in (np.split(order, 300), np.split(order, 30), [order]):
        for rows in parts:
            np.testing.assert_allclose(outputs(x[rows]), together[rows], atol=1e-5)


def test_learns_classes_that_a_peak_separates():
    x, place = peaks(120)
    keep = abs(place - 0.5) > 0.05
    x, y = x[keep], np.where(place > 0.5, "high", "low")[keep]
    model = CnnClassifier().fit(x[:60], y[:60])
    assert (model.predict(x[60:]) == y[60:]).all()
    probability = model.predict_proba(x[60:])
    np.testing.assert_allclose(probability.sum(axis=1), 1, atol=1e-12)
    assert list(model.classes_) == ["high", "low"]
    assert (model.classes_[probability.argmax(axis=1)] == model.predict(x[60:])).all()


def test_learns_where_a_peak_is():
    x, place = peaks(240)
    model = CnnRegressor().fit(x[:160], 10 * place[:160])
    error = model.predict(x[160:]) - 10 * place[160:]
    # the spread of the targets is 6 / sqrt(12) = 1.7; one bin is 10 / 63 = 0.16
    assert np.sqrt(np.mean(error**2)) < 2 * 0.16


def standardised(model: str, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The input of the first layer, (n, n_features), of a registered network that learned x, y."""
    network = make_model(model, "classification").set_params(**QUICK).fit(x, y)
    bins = network.module_.compress(torch.from_numpy(x))
    return network.module_.standardise(bins).double().numpy()


def test_cnn_changes_the_feature_by_one_offset_and_one_factor():
    """The paper names one normalisation, of the feature: loud bins stay louder than quiet ones."""
    deviation = np.linspace(0.1, 2, 16)
    x = np.random.default_rng(0).normal(5, deviation, (200, 16)).astype(np.float32)
    z = standardised("cnn", x, np.arange(200) % 2)
    assert (z.mean(), z.std()) == pytest.approx((0, 1), abs=1e-4)
    offset = x.mean(dtype=np.float64)
    factor = x.std(dtype=np.float64)
    np.testing.assert_allclose(z, (x - offset) / factor, atol=1e-4)


def test_cnn_per_bin_gives_each_bin_mean_0_and_deviation_1_after_compression():
    deviation = np.linspace(0.1, 2, 16)
    x = np.random.default_rng(0).normal(5, deviation, (200, 16)).astype(np.float32)
    z = standardised("cnn_per_bin", x, np.arange(200) % 2)
    # Levels are 5 / 0.1 deviations: float32 keeps seven digits of them.
    np.testing.assert_allclose(z.mean(axis=0), 0, atol=1e-4)
    np.testing.assert_allclose(z.std(axis=0), 1, atol=1e-4)
    compressed = np.arcsinh(x.astype(np.float64) / np.abs(x).mean(dtype=np.float64))
    by_hand = (compressed - compressed.mean(axis=0)) / compressed.std(axis=0)
    np.testing.assert_allclose(z, by_hand, atol=1e-4)


def test_louder_noise_leaves_the_range_of_training_only_with_a_scale_per_bin():
    """Two bins hold the class, two hold noise only, which is 30 times louder when it is used."""
    generator = np.random.default_rng(0)
    y = np.arange(200) % 2
    informative = generator.normal(100.0 + 20.0 * y[:, None], 5.0, (200, 2))
    noise = generator.normal(2.0, 0.2, (200, 2))
    quiet = np.hstack([informative, noise]).astype(np.float32)
    loud = np.hstack([informative, 30 * noise]).astype(np.float32)

    def largest(model: str) -> float:
        network = make_model(model, "classification").set_params(**QUICK).fit(quiet, y).module_
        bins = network.standardise(network.compress(torch.from_numpy(loud)))
        return float(bins[:, 2:].abs().max())

    assert largest("cnn") < 2
    assert largest("cnn_per_bin") > 20


def test_the_compression_is_part_of_the_stored_network():
    x, place = peaks(40)
    y = place > 0.5
    for model in ("cnn", "cnn_per_bin"):
        fitted = make_model(model, "classification").set_params(**QUICK).fit(x, y)
        again = skops.io.loads(skops.io.dumps(fitted), trusted=TRUSTED_TYPES)
        assert again.module_.is_compressed is (model == "cnn_per_bin")
        assert np.array_equal(again.predict_proba(x), fitted.predict_proba(x))


def test_same_seed_same_weights_whatever_the_threads_and_no_trace_is_left():
    x, place = peaks(40)
    y = place > 0.5
    threads = torch.get_num_threads()
    torch.manual_seed(5)
    np.random.seed(5)
    before = torch.get_rng_state()
    numpy_before = np.random.get_state()[1].copy()
    first = CnnClassifier(**QUICK).fit(x, y).__getstate__()["module_"]
    assert torch.equal(torch.get_rng_state(), before)
    assert np.array_equal(np.random.get_state()[1], numpy_before)
    try:
        torch.set_num_threads(3)
        torch.manual_seed(6)
        second = CnnClassifier(**QUICK).fit(x, y).__getstate__()["module_"]
        assert torch.get_num_threads() == 3
    finally:
        torch.set_num_threads(threads)
    other = CnnClassifier(**QUICK, random_state=1).fit(x, y).__getstate__()["module_"]
    assert all(first[name].tobytes() == second[name].tobytes() for name in first)
    assert not np.array_equal(first["dense.weight"], other["dense.weight"])


def test_a_stored_classifier_is_whole():
    x, place = peaks(30)
    labels = [3, 7]
    model = CnnClassifier(**QUICK, channels=(4, 4, 4)).fit(x, np.array(labels)[(place > 0.5) * 1])
    again = skops.io.loads(skops.io.dumps(model), trusted=TRUSTED_TYPES)
    assert np.array_equal(again.predict_proba(x), model.predict_proba(x))
    assert np.array_equal(again.predict(x), model.predict(x))
    assert again.get_params() == model.get_params()
    assert again.classes_.dtype == model.classes_.dtype


def test_refuses_what_it_cannot_learn_from():
    x, place = peaks(10)
    with pytest.raises(ValueError, match="one class only, 'wood'"):
        CnnClassifier().fit(x, ["wood"] * 10)
    with pytest.raises(ValueError, match="NaN"):
        CnnRegressor().fit(x, np.where(place > 0.5, np.nan, place))
