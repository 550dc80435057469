"""A fitted estimator as a torch module, which torch can then export.

Modules map features (n, n_features), float32, to (n, n_classes) probabilities, or scores whose
largest is the class, or to (n, 1) numbers in the target's unit, all float64. Arithmetic is in the
precision of the model: float32 for networks, float64 for the models of scikit-learn.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn


class CannotExportError(ValueError):
    """A model, or a part of a model, that has no torch module."""


def torch_model(estimator: Any) -> nn.Module:
    """Return the module of a fitted model of `models.make_model`.

    Raises CannotExportError for another estimator, and for unknown parts or settings of one.
    """
    name = type(estimator).__name__
    if name == "Tuned":
        return torch_model(estimator.best_estimator_)
    if name == "CnnClassifier":
        return nn.Sequential(estimator.module_, ToDouble(), nn.Softmax(1))
    if name == "CnnRegressor":
        return nn.Sequential(estimator.module_, ToDouble())
    if name == "Circular":
        return nn.Sequential(torch_model(estimator.estimator_), Turn(estimator.period))
    if name == "MultiOutputRegressor":
        return SideBySide([torch_model(each) for each in estimator.estimators_])
    if name != "Pipeline":
        raise CannotExportError(f"{name} cannot be exported: it is not a model of ajgdata")
    return nn.Sequential(ToDouble(), *(_module(step) for _, step in estimator.steps))


def _module(fitted: Any) -> nn.Module:
    name, package = type(fitted).__name__, type(fitted).__module__.partition(".")[0]
    if name not in _MODULES or package not in ("sklearn", "ajgdata"):
        known = ", ".join(sorted(_MODULES))
        raise CannotExportError(f"{name} cannot be exported: known are {known}")
    return _MODULES[name](fitted)


def _require(fitted: Any, **settings: Any) -> None:
    """Raise CannotExportError unless the settings of a fitted estimator are these."""
    for key, value in settings.items():
        if getattr(fitted, key) != value:
            name = type(fitted).__name__
            raise CannotExportError(f"{name} cannot be exported: only {key} = {value!r} is known")


def _double(array: Any) -> Tensor:
    return torch.tensor(np.asarray(array, np.float64))


class ToDouble(nn.Module):
    """float32 -> float64."""

    def forward(self, x: Tensor) -> Tensor:
        """Return x, float64."""
        return x.double()


class Compress(nn.Module):
    """asinh(x / scale) for x >= 0: ONNX Runtime has asinh for float32 only."""

    def __init__(self, scale: float) -> None:
        super().__init__()
        self.scale = float(scale)

    def forward(self, x: Tensor) -> Tensor:
        """Return compressed features of the shape of x."""
        x = x / self.scale
        return torch.log(x + torch.sqrt(x * x + 1))


class Standardise(nn.Module):
    """(x - mean) / std, per feature."""

    mean: Tensor
    std: Tensor

    def __init__(self, mean: np.ndarray, std: np.ndarray) -> None:
        super().__init__()
        self.register_buffer("mean", _double(mean))
        self.register_buffer("std", _double(std))

    def forward(self, x: Tensor) -> Tensor:
        """Return standardised features of the shape of x."""
        return (x - self.mean) / self.std


class Normalise(nn.Module):
    """x / |x|; 0 stays 0."""

    def forward(self, x: Tensor) -> Tensor:
        """Return rows of length 1, of the shape of x."""
        norm = x.square().sum(1, keepdim=True).sqrt()
        return x / torch.where(norm > 0, norm, 1.0)


class Turn(nn.Module):
    """The target that the point (sine, cosine) stands for, see `models.circular`."""

    def __init__(self, period: float) -> None:
        super().__init__()
        self.period = period

    def forward(self, x: Tensor) -> Tensor:
        """Return targets (n, 1) in [0, period) for points (n, 2)."""
        point = x.float()  # ONNX Runtime has the arc tangent for float32 only
        turns = torch.atan2(point[:, :1], point[:, 1:]).double() / (2 * np.pi)
        return (turns - torch.floor(turns)) * self.period


class SideBySide(nn.Module):
    """The outputs of several modules as columns."""

    def __init__(self, modules: list[nn.Module]) -> None:
        super().__init__()
        self.columns = nn.ModuleList(modules)

    def forward(self, x: Tensor) -> Tensor:
        """Return (n, columns)."""
        return torch.cat([module(x) for module in self.columns], dim=1)


def squared_distances(x: Tensor, rows: Tensor) -> Tensor:
    """Return |x - row|^2 (n, rows) of x (n, f) and rows (rows, f), float64."""
    rows = rows.double()
    squares = x.square().sum(1, keepdim=True) + rows.square().sum(1)
    return (squares - 2 * x @ rows.T).clamp(min=0)


class Neighbours(nn.Module):
    """Mean of the values (rows, outputs) of the `count` nearest rows (rows, f)."""

    rows: Tensor
    values: Tensor

    def __init__(self, rows: np.ndarray, values: np.ndarray, count: int, manhattan: bool) -> None:
        super().__init__()
        self.register_buffer("rows", torch.tensor(rows))
        self.register_buffer("values", _double(values))
        self.count, self.manhattan = count, manhattan

    def forward(self, x: Tensor) -> Tensor:
        """Return (n, outputs)."""
        if self.manhattan:
            distances = (x.unsqueeze(1) - self.rows.double()).abs().sum(2)
        else:
            distances = squared_distances(x, self.rows)
        nearest = distances.topk(self.count, dim=1, largest=False).indices
        return self.values[nearest].mean(1)


class Kernel(nn.Module):
    """exp(-gamma |x - row|^2) for each support vector."""

    rows: Tensor

    def __init__(self, rows: np.ndarray, gamma: float) -> None:
        super().__init__()
        self.register_buffer("rows", _double(rows))
        self.gamma = float(gamma)

    def forward(self, x: Tensor) -> Tensor:
        """Return (n, rows)."""
        return torch.exp(-self.gamma * squared_distances(x, self.rows))


class Votes(nn.Module):
    """One vote per pair of classes (a < b): for a if the margin is positive, else for b."""

    first: Tensor
    second: Tensor

    def __init__(self, classes: int) -> None:
        super().__init__()
        first, second = np.triu_indices(classes, 1)
        self.register_buffer("first", _double(np.eye(classes)[first]))
        self.register_buffer("second", _double(np.eye(classes)[second]))

    def forward(self, x: Tensor) -> Tensor:
        """Return votes (n, classes) of margins (n, pairs)."""
        wins = (x > 0).double()
        return wins @ self.first + (1 - wins) @ self.second


class Trees(nn.Module):
    """The sum over trees of the value of the leaf; left where x[feature] <= threshold.

    `trees` are (feature, threshold, left, right, value) per tree; children < 0 mark leaves, which
    then lead to themselves, so that every walk has `depth` steps.
    """

    feature: Tensor
    threshold: Tensor
    left: Tensor
    right: Tensor
    value: Tensor
    root: Tensor

    def __init__(self, trees: list[tuple], depth: int, outputs: int) -> None:
        super().__init__()
        starts = np.cumsum([0, *(len(tree[0]) for tree in trees)])
        columns: list[list[np.ndarray]] = [[] for _ in range(5)]
        for start, (feature, threshold, left, right, value) in zip(starts, trees, strict=False):
            here = np.arange(len(feature))
            children = [np.where(side < 0, here, side) + start for side in (left, right)]
            table = (np.where(left < 0, 0, feature), threshold, *children, value)
            for column, part in zip(columns, table, strict=True):
                column.append(part)
        names = ("feature", "threshold", "left", "right", "value")
        for name, parts in zip(names, columns, strict=True):
            kind = np.float64 if name in ("threshold", "value") else np.int64
            self.register_buffer(name, torch.tensor(np.concatenate(parts).astype(kind)))
        self.register_buffer("root", torch.tensor(starts[:-1]))
        self.depth, self.outputs = depth, outputs

    def forward(self, x: Tensor) -> Tensor:
        """Return (n, outputs)."""
        node = self.root.unsqueeze(0).expand(x.shape[0], -1)  # -> (n, trees)
        for _ in range(self.depth):
            goes_left = x.gather(1, self.feature[node]) <= self.threshold[node]
            node = torch.where(goes_left, self.left[node], self.right[node])
        return self.value[node].reshape(x.shape[0], -1, self.outputs).sum(1)


class Single(nn.Module):
    """Round to float32, as scikit-learn's forests do with their input."""

    def forward(self, x: Tensor) -> Tensor:
        """Return x, rounded, float64."""
        return x.float().double()


def _linear(weight: Any, bias: Any) -> nn.Linear:
    """Return x weight^T + bias; weight (outputs, f) or (f,), bias of any shape."""
    weight = np.atleast_2d(weight)
    layer = nn.Linear(weight.shape[1], len(weight), dtype=torch.float64)
    with torch.no_grad():
        layer.weight.copy_(_double(weight))
        layer.bias.copy_(_double(np.broadcast_to(bias, len(weight))))
    return layer


def _class_scores(weight: Any, bias: Any, first: float) -> nn.Linear:
    """Return the scores of all classes; of two, (`first` * score, score) of the one score."""
    weight = np.atleast_2d(weight)
    sides = np.array([[first], [1.0]]) if len(weight) == 1 else np.eye(len(weight))
    return _linear(sides @ weight, sides @ np.broadcast_to(bias, len(weight)))


def _scaler(fitted: Any) -> nn.Module:
    count = fitted.n_features_in_
    mean = np.zeros(count) if fitted.mean_ is None else fitted.mean_
    return Standardise(mean, np.ones(count) if not fitted.with_std else fitted.scale_)


def _normaliser(fitted: Any) -> nn.Module:
    _require(fitted, norm="l2")
    return Normalise()


def _projection(fitted: Any) -> nn.Module:
    _require(fitted, whiten=False)
    return _linear(fitted.components_, -fitted.components_ @ fitted.mean_)


def _logistic(fitted: Any) -> nn.Module:
    return nn.Sequential(_class_scores(fitted.coef_, fitted.intercept_, 0.0), nn.Softmax(1))


def _neighbours(fitted: Any) -> nn.Module:
    """Return the mean of the labels of the nearest training rows, which scikit-learn keeps in
    private attributes only."""
    _require(fitted, weights="uniform")
    if fitted.effective_metric_ not in ("euclidean", "manhattan"):
        metrics = "the Euclidean and the Manhattan distance"
        raise CannotExportError(f"{type(fitted).__name__} cannot be exported: known are {metrics}")
    labels = fitted._y
    values = np.eye(len(fitted.classes_))[labels] if hasattr(fitted, "classes_") else labels
    manhattan = fitted.effective_metric_ == "manhattan"
    values = values.reshape(len(labels), -1)
    return Neighbours(fitted._fit_X, values, fitted.n_neighbors, manhattan)


def _support_vectors(fitted: Any) -> nn.Module:
    """Return the regressor, or the classifier with one vote per pair of classes as in libsvm."""
    _require(fitted, kernel="rbf")
    kernel = Kernel(fitted.support_vectors_, fitted._gamma)
    if not hasattr(fitted, "classes_"):
        return nn.Sequential(kernel, _linear(fitted.dual_coef_, fitted.intercept_))
    count = len(fitted.classes_)
    if count == 2:  # the sign is then that of the second class
        return nn.Sequential(kernel, _class_scores(fitted.dual_coef_, fitted.intercept_, -1.0))
    ends = np.concatenate([[0], np.cumsum(fitted.n_support_)])
    rows = [slice(ends[one], ends[one + 1]) for one in range(count)]
    pairs = list(zip(*np.triu_indices(count, 1), strict=True))
    weight = np.zeros((len(pairs), ends[-1]))
    for pair, (a, b) in enumerate(pairs):
        weight[pair, rows[a]] = fitted.dual_coef_[b - 1, rows[a]]
        weight[pair, rows[b]] = fitted.dual_coef_[a, rows[b]]
    return nn.Sequential(kernel, _linear(weight, fitted.intercept_), Votes(count))


def _perceptron(fitted: Any) -> nn.Module:
    _require(fitted, activation="relu")
    *hidden, (weight, bias) = zip(fitted.coefs_, fitted.intercepts_, strict=True)
    layers: list[nn.Module] = []
    for matrix, offset in hidden:
        layers += [_linear(matrix.T, offset), nn.ReLU()]
    if fitted.out_activation_ == "identity":
        return nn.Sequential(*layers, _linear(weight.T, bias))
    return nn.Sequential(*layers, _class_scores(weight.T, bias, 0.0), nn.Softmax(1))


def _scaled_target(fitted: Any) -> nn.Module:
    scaler = fitted.transformer_
    if type(scaler).__name__ != "StandardScaler":
        raise CannotExportError("TransformedTargetRegressor cannot be exported: unknown scaling")
    return nn.Sequential(_module(fitted.regressor_), _linear(np.diag(scaler.scale_), scaler.mean_))


def _forest(fitted: Any) -> nn.Module:
    """Return trees whose leaves hold shares of the classes, or numbers."""
    trees, share = [each.tree_ for each in fitted.estimators_], 1 / len(fitted.estimators_)
    tables = []
    for tree in trees:
        value = tree.value[:, :, 0] if tree.value.shape[2] == 1 else tree.value[:, 0]
        sides = (tree.children_left, tree.children_right)
        tables.append((tree.feature, tree.threshold, *sides, value * share))
    depth = max(tree.max_depth for tree in trees)
    return nn.Sequential(Single(), Trees(tables, depth, tables[0][-1].shape[1]))


def _boosting(fitted: Any) -> nn.Module:
    """Return trees, one per class and step, whose leaves add to the score; scikit-learn keeps them
    in private attributes only."""
    tables, depth, outputs = [], 0, fitted.n_trees_per_iteration_
    for table in (tree.nodes for step in fitted._predictors for tree in step):
        leaf = table["is_leaf"].astype(bool)
        sides = [np.where(leaf, -1, table[side].astype(int)) for side in ("left", "right")]
        split = (table["feature_idx"].astype(int), table["num_threshold"])
        tables.append((*split, *sides, table["value"][:, np.newaxis]))
        depth = max(depth, int(table["depth"].max()))
    trees, start = Trees(tables, depth, outputs), np.ravel(fitted._baseline_prediction)
    if not hasattr(fitted, "classes_"):
        return nn.Sequential(trees, _linear(np.eye(outputs), start))
    return nn.Sequential(trees, _class_scores(np.eye(outputs), start, 0.0), nn.Softmax(1))


_MODULES: dict[str, Callable[[Any], nn.Module]] = {
    "AtLeast": lambda fitted: nn.Identity(),
    "Compress": lambda fitted: Compress(fitted.scale_),
    "HistGradientBoostingClassifier": _boosting,
    "HistGradientBoostingRegressor": _boosting,
    "KNeighborsClassifier": _neighbours,
    "KNeighborsRegressor": _neighbours,
    "LogisticRegression": _logistic,
    "MLPClassifier": _perceptron,
    "MLPRegressor": _perceptron,
    "Normalizer": _normaliser,
    "OneScale": _scaler,
    "PCA": _projection,
    "RandomForestClassifier": _forest,
    "RandomForestRegressor": _forest,
    "Ridge": lambda fitted: _linear(fitted.coef_, fitted.intercept_),
    "RidgeClassifier": lambda fitted: _class_scores(fitted.coef_, fitted.intercept_, -1.0),
    "SVC": _support_vectors,
    "SVR": _support_vectors,
    "StandardScaler": _scaler,
    "TransformedTargetRegressor": _scaled_target,
}
