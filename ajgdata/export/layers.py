"""A fitted estimator as a list of plain steps, which ONNX and NumPy can both do.

Both files are written from this one list, so that what one can do the other can. Each step takes
the output of the one before, beginning with features (n, n_features), float32:

    cast        to float32 or float64 (`bits`)
    compress    asinh(x / scale)
    standardise (x - mean) / std; mean (c, n_features) makes c channels of x
    normalise   x / |x|, 0 where x is
    convolve    weight (c_out, c_in, k), bias (c_out,); `stride`, zeros for k // 2 beyond the ends
    relu        max(x, 0)
    dense       x weight^T + bias, of all that x holds; weight (outputs, inputs)
    neighbours  mean of `value` (rows, outputs) over the `k` nearest of `row` (rows, inputs), by the
                sum of |x - row|^`power`: 1 or 2
    kernel      exp(-gamma |x - row|^2) for each row
    vote        a pair of classes a step: columns `first` and `second` of what wins if x > 0, or not
    trees       sum over trees of the `value` of the leaf; left where x[feature] <= threshold
    softmax     over the outputs
    turn        atan2(x0, x1) / (2 pi), in [0, 1), times `period`
    join        the outputs of several lists side by side

Arithmetic is in the precision of the model: float32 for networks, float64 for scikit-learn's.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

_BATCH_NORM_EPSILON = 1e-5  # torch's default, which the network uses


class CannotExportError(ValueError):
    """A model that has no such list of steps; says which and why."""


@dataclass(frozen=True, eq=False)
class Layer:
    """One step: its name, its arrays and numbers, and the lists that a `join` joins."""

    op: str
    arrays: Mapping[str, np.ndarray] = field(default_factory=dict)
    numbers: Mapping[str, float] = field(default_factory=dict)
    branches: Sequence[Sequence[Layer]] = ()


def layers_of(estimator: Any) -> list[Layer]:
    """Return the steps of a fitted model of `models.make_model`.

    Their output is (n, n_classes) for classification: probabilities where the model has them, else
    scores whose largest is the class; (n, 1) for regression, in the target's unit. Raises
    CannotExportError for an estimator, or a part of one, that has no such steps.
    """
    name = type(estimator).__name__
    if name == "Tuned":
        return layers_of(estimator.best_estimator_)
    if name in ("CnnClassifier", "CnnRegressor"):
        return _network(estimator)
    if name == "Circular":
        steps = layers_of(estimator.estimator_)
        return [*steps, Layer("turn", numbers={"period": estimator.period})]
    if name == "MultiOutputRegressor":
        return [Layer("join", branches=[layers_of(each) for each in estimator.estimators_])]
    if name != "Pipeline":
        raise _refused(estimator, "of the estimators only the package's own are known")
    *before, (_, last) = estimator.steps
    steps = [Layer("cast", numbers={"bits": 64})]
    for _, transformer in before:
        steps += _transformer(transformer)
    return steps + _known(_MODELS, last)(last)


def _refused(part: Any, why: str) -> CannotExportError:
    return CannotExportError(f"{type(part).__name__} cannot be exported: {why}")


def _known(table: Mapping[str, Callable], part: Any) -> Callable[[Any], list[Layer]]:
    name, package = type(part).__name__, type(part).__module__.partition(".")[0]
    if name not in table or package not in ("sklearn", "ajgdata"):
        raise _refused(part, f"known are {', '.join(sorted(table))}")
    return table[name]


def _transformer(fitted: Any) -> list[Layer]:
    return _known(_TRANSFORMERS, fitted)(fitted)


def _network(estimator: Any) -> list[Layer]:
    """Return the CNN; batch normalisation and the target's scale are in the weights."""
    arrays, about = estimator.state()
    exact = {name: value.astype(np.float64) for name, value in arrays.items()}
    steps = [_of("compress", scale=arrays["scale"])]
    steps.append(_of("standardise", mean=arrays["mean"], std=arrays["std"]))
    for number in range(len(about["params"]["channels"])):
        conv, norm = f"convolutions.{3 * number}", f"convolutions.{3 * number + 1}"
        variance = exact[f"{norm}.running_var"] + _BATCH_NORM_EPSILON
        gain = exact[f"{norm}.weight"] / np.sqrt(variance)
        weight = exact[f"{conv}.weight"] * gain[:, np.newaxis, np.newaxis]
        bias = exact[f"{conv}.bias"] - exact[f"{norm}.running_mean"]
        bias = bias * gain + exact[f"{norm}.bias"]
        single = {"weight": weight.astype(np.float32), "bias": bias.astype(np.float32)}
        steps.append(Layer("convolve", single, {"stride": about["params"]["stride"]}))
        steps.append(Layer("relu"))
    gain, offset = exact["target_std"], exact["target_mean"]
    weight = exact["dense.weight"] * gain[:, np.newaxis]
    bias = exact["dense.bias"] * gain + offset
    steps.append(_of("dense", weight=weight.astype(np.float32), bias=bias.astype(np.float32)))
    steps.append(Layer("cast", numbers={"bits": 64}))
    return [*steps, Layer("softmax")] if "classes" in about else steps


def _of(op: str, **arrays: Any) -> Layer:
    return Layer(op, {name: np.asarray(value) for name, value in arrays.items()})


def _dense(weight: np.ndarray, bias: np.ndarray) -> Layer:
    """Return x weight^T + bias; weight (outputs, inputs) or (inputs,), bias of any shape."""
    weight = np.atleast_2d(np.asarray(weight, np.float64))
    return _of("dense", weight=weight, bias=np.broadcast_to(bias, len(weight)).astype(np.float64))


def _both(layer: Layer, other: float) -> Layer:
    """Return scores of two classes from the one of the second: that times `other`, and itself."""
    weight, bias = layer.arrays["weight"], layer.arrays["bias"]
    if len(weight) > 1:
        return layer
    sides = np.array([[other], [1.0]])
    return _of("dense", weight=sides * weight, bias=sides[:, 0] * bias)


def _scaler(fitted: Any) -> list[Layer]:
    count = fitted.n_features_in_
    mean = np.zeros(count) if fitted.mean_ is None else fitted.mean_
    return [
        _of("standardise", mean=mean, std=np.ones(count) if not fitted.with_std else fitted.scale_)
    ]


def _normaliser(fitted: Any) -> list[Layer]:
    if fitted.norm != "l2":
        raise _refused(fitted, "only the 2-norm is known")
    return [Layer("normalise")]


def _projection(fitted: Any) -> list[Layer]:
    """Return PCA as one dense step."""
    if fitted.whiten:
        raise _refused(fitted, "whitening is not known")
    weight = fitted.components_
    return [_dense(weight, -weight @ fitted.mean_)]


def _compress(fitted: Any) -> list[Layer]:
    return [_of("compress", scale=np.float64(fitted.scale_))]


def _logistic(fitted: Any) -> list[Layer]:
    return [_both(_dense(fitted.coef_, fitted.intercept_), 0.0), Layer("softmax")]


def _ridge_classifier(fitted: Any) -> list[Layer]:
    return [_both(_dense(fitted.coef_, fitted.intercept_), -1.0)]


def _ridge(fitted: Any) -> list[Layer]:
    return [_dense(fitted.coef_, fitted.intercept_)]


def _neighbours(fitted: Any, value: np.ndarray) -> list[Layer]:
    power = {"euclidean": 2, "manhattan": 1}.get(fitted.effective_metric_)
    if power is None or fitted.weights != "uniform":
        metrics = "the Euclidean and the Manhattan distance"
        raise _refused(fitted, f"only equal weights of {metrics} are known")
    arrays = {"row": np.asarray(fitted._fit_X, np.float64), "value": value.astype(np.float64)}
    return [Layer("neighbours", arrays, {"k": fitted.n_neighbors, "power": power})]


def _knn_classifier(fitted: Any) -> list[Layer]:
    return _neighbours(fitted, np.eye(len(fitted.classes_))[fitted._y])


def _knn_regressor(fitted: Any) -> list[Layer]:
    return _neighbours(fitted, fitted._y.reshape(len(fitted._y), -1))


def _kernel(fitted: Any) -> Layer:
    if fitted.kernel != "rbf":
        raise _refused(fitted, "only the Gaussian kernel is known")
    return Layer("kernel", {"row": fitted.support_vectors_}, {"gamma": float(fitted._gamma)})


def _svm_regressor(fitted: Any) -> list[Layer]:
    return [_kernel(fitted), _dense(fitted.dual_coef_, fitted.intercept_)]


def _svm_classifier(fitted: Any) -> list[Layer]:
    """Return one against one, as libsvm counts: each pair of classes has one vote."""
    count = len(fitted.classes_)
    if count == 2:  # the sign is then that of the second class
        return [_kernel(fitted), _both(_dense(fitted.dual_coef_, fitted.intercept_), -1.0)]
    ends = np.concatenate([[0], np.cumsum(fitted.n_support_)])
    of = [slice(ends[one], ends[one + 1]) for one in range(count)]
    first, second = np.triu_indices(count, 1)
    weight = np.zeros((len(first), ends[-1]))
    for pair, (a, b) in enumerate(zip(first, second, strict=True)):
        weight[pair, of[a]] = fitted.dual_coef_[b - 1, of[a]]
        weight[pair, of[b]] = fitted.dual_coef_[a, of[b]]
    one = np.eye(count)
    votes = _of("vote", first=one[first], second=one[second])
    return [_kernel(fitted), _dense(weight, fitted.intercept_), votes]


def _perceptron(fitted: Any, activation: str) -> list[Layer]:
    if fitted.activation != "relu" or fitted.out_activation_ not in (activation, "logistic"):
        raise _refused(fitted, f"only relu and then {activation} are known")
    steps = []
    for weight, bias in zip(fitted.coefs_, fitted.intercepts_, strict=True):
        steps += [_dense(weight.T, bias), Layer("relu")]
    return steps[:-1]


def _mlp_classifier(fitted: Any) -> list[Layer]:
    *steps, last = _perceptron(fitted, "softmax")
    return [*steps, _both(last, 0.0), Layer("softmax")]


def _mlp_regressor(fitted: Any) -> list[Layer]:
    return _perceptron(fitted, "identity")


def _scaled_target(fitted: Any) -> list[Layer]:
    """Return the regressor with the target's scale in its last weights."""
    inner, scaler = fitted.regressor_, fitted.transformer_
    if type(scaler).__name__ != "StandardScaler":
        raise _refused(fitted, "only a StandardScaler of the target is known")
    *steps, last = _known(_MODELS, inner)(inner)
    if last.op != "dense":
        raise _refused(fitted, f"not with {type(inner).__name__}")
    weight = last.arrays["weight"] * scaler.scale_[:, np.newaxis]
    return [*steps, _dense(weight, last.arrays["bias"] * scaler.scale_ + scaler.mean_)]


def _forest(fitted: Any) -> list[Layer]:
    """Return trees whose leaves hold shares of the classes, or numbers."""
    trees = [each.tree_ for each in fitted.estimators_]
    nodes = [
        (
            np.where(one.children_left < 0, 0, one.feature),
            one.threshold,
            one.children_left,
            one.children_right,
            one.value[:, :, 0] if one.value.shape[2] == 1 else one.value[:, 0],
        )
        for one in trees
    ]
    depth = max(one.max_depth for one in trees)
    # scikit-learn's trees compare what they are given as float32
    cast = Layer("cast", numbers={"bits": 32})
    return [cast, _trees(nodes, depth, 1 / len(trees))]


def _boosting(fitted: Any) -> list[Layer]:
    """Return trees, one a class and step, whose leaves add to the score."""
    nodes, depth = [], 0
    for step in fitted._predictors:
        for one in step:
            table = one.nodes
            if table["is_categorical"].any():
                raise _refused(fitted, "categories are not known")
            leaf = table["is_leaf"].astype(bool)
            left, right = (
                np.where(leaf, -1, table[side].astype(int)) for side in ("left", "right")
            )
            feature = np.where(leaf, 0, table["feature_idx"].astype(int))
            nodes.append(
                (feature, table["num_threshold"], left, right, table["value"][:, np.newaxis])
            )
            depth = max(depth, int(table["depth"].max()))
    outputs = fitted.n_trees_per_iteration_
    steps = [
        _trees(nodes, depth, 1.0, outputs),
        _dense(np.eye(outputs), np.ravel(fitted._baseline_prediction)),
    ]
    if hasattr(fitted, "classes_"):
        return [steps[0], _both(steps[1], 0.0), Layer("softmax")]
    return steps


def _trees(nodes: list[tuple], depth: int, share: float, outputs: int = 0) -> Layer:
    """Return all trees as one table; a leaf leads to itself, so that every walk is `depth` long."""
    starts = np.cumsum([0, *(len(one[0]) for one in nodes)])
    columns: list[list[np.ndarray]] = [[] for _ in range(5)]
    for start, (feature, threshold, left, right, value) in zip(starts[:-1], nodes, strict=True):
        here = np.arange(len(feature))
        to = [np.where(side < 0, here, side) + start for side in (left, right)]
        for column, part in zip(columns, (feature, threshold, *to, value * share), strict=True):
            column.append(part)
    feature, threshold, left, right, value = (np.concatenate(column) for column in columns)
    arrays = {
        "root": starts[:-1].astype(np.int64),
        "feature": feature.astype(np.int64),
        "threshold": threshold.astype(np.float64),
        "left": left.astype(np.int64),
        "right": right.astype(np.int64),
        "value": value.astype(np.float64),
    }
    return Layer("trees", arrays, {"depth": depth, "outputs": outputs or value.shape[1]})


_TRANSFORMERS: dict[str, Callable[[Any], list[Layer]]] = {
    "AtLeast": lambda fitted: [],
    "Compress": _compress,
    "Normalizer": _normaliser,
    "OneScale": _scaler,
    "PCA": _projection,
    "StandardScaler": _scaler,
}
_MODELS: dict[str, Callable[[Any], list[Layer]]] = {
    "LogisticRegression": _logistic,
    "RidgeClassifier": _ridge_classifier,
    "KNeighborsClassifier": _knn_classifier,
    "SVC": _svm_classifier,
    "HistGradientBoostingClassifier": _boosting,
    "RandomForestClassifier": _forest,
    "MLPClassifier": _mlp_classifier,
    "Ridge": _ridge,
    "KNeighborsRegressor": _knn_regressor,
    "SVR": _svm_regressor,
    "HistGradientBoostingRegressor": _boosting,
    "RandomForestRegressor": _forest,
    "MLPRegressor": _mlp_regressor,
    "TransformedTargetRegressor": _scaled_target,
}
