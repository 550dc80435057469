"""make_model and the baselines."""

import numpy as np
import pytest
from sklearn.utils.estimator_checks import parametrize_with_checks

from ajgdata.models import make_model
from ajgdata.models.scaling import Compress
from ajgdata.types import MODELS

#: Of the CNN, see test_cnn.py.
NAMES = [name for name in MODELS if not name.startswith(("cnn", "covariates"))]
EVERY = [(name, kind) for name in NAMES for kind in ("classification", "regression")]


def blobs(n: int = 60, n_features: int = 20) -> tuple[np.ndarray, np.ndarray]:
    """Positive features of two classes ten standard deviations apart in every logarithm."""
    rng = np.random.default_rng(0)
    y = np.arange(n) % 2
    return np.exp(y[:, None] + 0.1 * rng.normal(size=(n, n_features))).astype(np.float32), y


@parametrize_with_checks([Compress()])
def test_compress_follows_the_conventions_of_scikit_learn(estimator, check):
    check(estimator)


def test_compress_is_a_logarithm_for_loud_bins_and_linear_for_quiet_ones():
    x = np.array([[1e-9, 1.0, 3.0 - 1e-9, 0.0]])  # mean 1
    z = Compress(relative=1e-3).fit_transform(x)[0]
    # asinh(t) = t - t^3/6 + ...; asinh(t) = log 2t + 1/(4 t^2) - ...
    np.testing.assert_allclose(z[0], 1e-6, rtol=1e-9)
    np.testing.assert_allclose(z[1:3], np.log([2e3, 6e3]), atol=0.25e-6)
    assert z[3] == 0


@pytest.mark.parametrize(("name", "kind"), EVERY)
def test_models_learn_the_obvious(name, kind):
    x, y = blobs()
    model = make_model(name, kind, seed=3)
    target = np.array(["a", "b"])[y] if kind == "classification" else y * 10.0
    predicted = model.fit(x[:40], target[:40]).predict(x[40:])
    if kind == "classification":
        assert (predicted == target[40:]).all()
        assert hasattr(model, "predict_proba") == (name.partition("_")[0] not in ("svm", "ridge"))
        if hasattr(model, "predict_proba"):
            np.testing.assert_allclose(model.predict_proba(x).sum(axis=1), 1)
    else:
        # far nearer to the right one of 0 and 10; ridge shrinks by 1000 / (20 * 40) at most
        assert (abs(predicted - target[40:]) < 5).all()


def test_unknown_names_are_refused():
    with pytest.raises(ValueError, match="unknown model 'tree': choose one of cnn, linear"):
        make_model("tree", "regression", 0)
    with pytest.raises(ValueError, match="unknown kind 'ranking'"):
        make_model("knn", "ranking", 0)
