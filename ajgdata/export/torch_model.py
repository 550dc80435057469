"""A network or a linear model as a torch module, which torch can then export.

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

from ajgdata.types import NotPossibleError


def torch_model(estimator: Any) -> nn.Module:
    """Return the module of a fitted model of `models.make_model`.

    Raises NotPossibleError for other models than networks and linear ones: scikit-learn has no
    public attributes for what k-NN, support vectors and trees have learned.
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
    if name != "Pipeline":
        raise NotPossibleError(f"{name} cannot be exported: it is not a model of ajgdata")
    return nn.Sequential(ToDouble(), *(_module(step) for _, step in estimator.steps))


def _module(fitted: Any) -> nn.Module:
    name, package = type(fitted).__name__, type(fitted).__module__.partition(".")[0]
    if name not in _MODULES or package not in ("sklearn", "ajgdata"):
        known = ", ".join(sorted(_MODULES))
        raise NotPossibleError(f"{name} cannot be exported: known are {known}")
    return _MODULES[name](fitted)


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


def squared_distances(x: Tensor, rows: Tensor) -> Tensor:
    """Return |x - row|^2 (n, rows) of x (n, f) and rows (rows, f), float64."""
    rows = rows.double()
    squares = x.square().sum(1, keepdim=True) + rows.square().sum(1)
    return (squares - 2 * x @ rows.T).clamp(min=0)


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
    if fitted.norm != "l2":
        raise NotPossibleError(f"Normalizer cannot be exported: its norm is {fitted.norm}, not l2")
    return Normalise()


def _logistic(fitted: Any) -> nn.Module:
    return nn.Sequential(_class_scores(fitted.coef_, fitted.intercept_, 0.0), nn.Softmax(1))


_MODULES: dict[str, Callable[[Any], nn.Module]] = {
    "Compress": lambda fitted: Compress(fitted.scale_),
    "LogisticRegression": _logistic,
    "Normalizer": _normaliser,
    "OneScale": _scaler,
    "Ridge": lambda fitted: _linear(fitted.coef_, fitted.intercept_),
    "RidgeClassifier": lambda fitted: _class_scores(fitted.coef_, fitted.intercept_, -1.0),
    "StandardScaler": _scaler,
}
