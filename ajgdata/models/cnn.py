"""The paper's model: three 1-D convolutions and one fully connected layer, in one file.

The paper gives the layers, softmax with cross-entropy for classes and a linear output with mean
squared error for numbers. Everything else below is ours; each default has its reason beside it.
The two estimators follow scikit-learn's conventions (`fit`, `predict`, `get_params`, `clone`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Self

import numpy as np
import torch
from sklearn.base import BaseEstimator, ClassifierMixin, RegressorMixin
from sklearn.utils.multiclass import check_classification_targets
from sklearn.utils.validation import check_is_fitted, validate_data
from torch import Tensor, nn
from torch.nn import functional

CHUNK = 256  # rows per forward pass: bounds memory, and stays in cache


class SpectrumCnn(nn.Module):
    """From a stored feature to class scores or a number; scaling included, so it exports whole.

    Input (n, n_features), output (n, n_outputs). Buffers hold what was learned from the training
    rows by counting rather than by gradient: `scale` () of the compression, `mean` and `std`
    (n_features,) of the compressed bins, `target_mean` and `target_std` () of a regression target.
    """

    scale: Tensor
    mean: Tensor
    std: Tensor
    target_mean: Tensor
    target_std: Tensor

    def __init__(
        self, n_features: int, n_outputs: int, channels: tuple[int, ...], kernel: int, stride: int
    ) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        length, before = n_features, 1
        for width in channels:
            layers += [nn.Conv1d(before, width, kernel, stride, padding=kernel // 2), nn.ReLU()]
            length, before = (length + 2 * (kernel // 2) - kernel) // stride + 1, width
        self.convolutions = nn.Sequential(*layers)
        self.dense = nn.Linear(before * length, n_outputs)
        for name in ("scale", "target_mean", "target_std"):
            self.register_buffer(name, torch.tensor(float(name != "target_mean")))
        self.register_buffer("mean", torch.zeros(n_features))
        self.register_buffer("std", torch.ones(n_features))

    def standardise(self, x: Tensor) -> Tensor:
        """Compress (n, n_features) to asinh(x / scale), then zero mean and unit variance a bin."""
        return (torch.asinh(x / self.scale) - self.mean) / self.std

    def trunk(self, z: Tensor) -> Tensor:
        """Scores (n, n_outputs) of standardised bins (n, n_features)."""
        z = z.unsqueeze(1)  # (n, n_features) -> (n, 1, n_features)
        z = self.convolutions(z)  # -> (n, channels, length)
        return self.dense(z.flatten(1))  # -> (n, channels * length) -> (n, n_outputs)

    def forward(self, x: Tensor) -> Tensor:
        """Scores or target of features as stored."""
        return self.trunk(self.standardise(x)) * self.target_std + self.target_mean


@contextmanager
def _reproducible(seed: int) -> Iterator[None]:
    """One thread and a private random state; the caller's are restored."""
    threads = torch.get_num_threads()
    with torch.random.fork_rng(devices=[]):
        torch.set_num_threads(1)
        torch.default_generator.manual_seed(seed)
        try:
            yield
        finally:
            torch.set_num_threads(threads)


class _Cnn(BaseEstimator):
    """What classifier and regressor share: settings, training, prediction, state."""

    def __init__(
        self,
        *,
        channels: tuple[int, ...] = (16, 32, 64),
        kernel: int = 7,
        stride: int = 4,
        compression: float = 1.0,
        epochs: int = 10,
        min_steps: int = 300,
        batch_size: int = 16,
        max_learning_rate: float = 3e-3,
        weight_decay: float = 1e-2,
        label_smoothing: float = 0.1,
        random_state: int = 0,
    ) -> None:
        self.channels = channels
        self.kernel = kernel
        self.stride = stride
        self.compression = compression
        self.epochs = epochs
        self.min_steps = min_steps
        self.batch_size = batch_size
        self.max_learning_rate = max_learning_rate
        self.weight_decay = weight_decay
        self.label_smoothing = label_smoothing
        self.random_state = random_state

    def fit(self, X: Any, y: Any) -> Self:
        """Train on features (n, n_features) and targets (n,)."""
        X, y = self._validated(X, y)
        with _reproducible(self.random_state):
            target, n_outputs = self._encode(y)
            module = SpectrumCnn(X.shape[1], n_outputs, self.channels, self.kernel, self.stride)
            self._learn_scales(module, X, y)
            inputs = torch.cat([module.standardise(x) for x in _chunks(X, module)])
            self._train(module, inputs, target)
        self.module_ = module.eval()
        return self

    def _learn_scales(self, module: SpectrumCnn, X: np.ndarray, y: np.ndarray) -> None:
        """Set the buffers from training rows, in float64: bins may be as small as 1e-20."""
        module.scale.fill_(float(np.abs(X, dtype=np.float64).mean() * self.compression) or 1.0)
        compressed = np.concatenate([torch.asinh(x / module.scale) for x in _chunks(X, module)])
        mean, std = (
            compressed.mean(axis=0, dtype=np.float64),
            compressed.std(axis=0, dtype=np.float64),
        )
        std[std <= 1e-6 * np.abs(mean)] = 1.0  # constant but for rounding
        module.mean.copy_(torch.from_numpy(mean))
        module.std.copy_(torch.from_numpy(np.where(std > 0, std, 1.0)))

    def _train(self, module: SpectrumCnn, inputs: Tensor, target: Tensor) -> None:
        per_epoch = math.ceil(len(inputs) / self.batch_size)
        steps = max(self.epochs * per_epoch, self.min_steps)
        optimiser = torch.optim.AdamW(
            module.parameters(), self.max_learning_rate, weight_decay=self.weight_decay
        )
        schedule = torch.optim.lr_scheduler.OneCycleLR(
            optimiser, self.max_learning_rate, total_steps=steps
        )
        order = torch.empty(0, dtype=torch.long)
        for step in range(steps):
            if step % per_epoch == 0:
                order = torch.randperm(len(inputs))
            rows = order[step % per_epoch * self.batch_size :][: self.batch_size]
            loss = self._loss(module.trunk(inputs[rows]), target[rows])
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            schedule.step()

    def _outputs(self, X: Any) -> np.ndarray:
        """Scores or target (n, n_outputs)."""
        check_is_fitted(self)
        X = validate_data(self, X, reset=False, dtype=[np.float64, np.float32])
        with _reproducible(0), torch.inference_mode():
            return np.concatenate([self.module_(x).numpy() for x in _chunks(X, self.module_)])


def _chunks(X: np.ndarray, module: SpectrumCnn) -> Iterator[Tensor]:
    for start in range(0, len(X), CHUNK):
        yield torch.from_numpy(np.ascontiguousarray(X[start : start + CHUNK], dtype=np.float32))


class CnnClassifier(ClassifierMixin, _Cnn):
    """Softmax and cross-entropy."""

    def _validated(self, X: Any, y: Any) -> tuple[np.ndarray, np.ndarray]:
        X, y = validate_data(self, X, y, dtype=[np.float64, np.float32])
        check_classification_targets(y)
        self.classes_ = np.unique(y)
        if len(self.classes_) < 2:
            raise ValueError(f"one class only ({self.classes_[0]!r}): a classifier needs two")
        return X, y

    def _encode(self, y: np.ndarray) -> tuple[Tensor, int]:
        return torch.from_numpy(np.searchsorted(self.classes_, y)), len(self.classes_)

    def _loss(self, scores: Tensor, target: Tensor) -> Tensor:
        return functional.cross_entropy(scores, target, label_smoothing=self.label_smoothing)

    def predict_proba(self, X: Any) -> np.ndarray:
        """Probability (n, n_classes) of each of `classes_`."""
        return torch.from_numpy(self._outputs(X)).double().softmax(dim=1).numpy()

    def predict(self, X: Any) -> np.ndarray:
        """Most probable class (n,)."""
        return self.classes_[self._outputs(X).argmax(axis=1)]


class CnnRegressor(RegressorMixin, _Cnn):
    """Linear output and mean squared error."""

    def _validated(self, X: Any, y: Any) -> tuple[np.ndarray, np.ndarray]:
        return validate_data(self, X, y, dtype=[np.float64, np.float32], y_numeric=True)

    def _learn_scales(self, module: SpectrumCnn, X: np.ndarray, y: np.ndarray) -> None:
        super()._learn_scales(module, X, y)
        module.target_mean.fill_(float(np.mean(y)))
        module.target_std.fill_(float(np.std(y)) or 1.0)

    def _encode(self, y: np.ndarray) -> tuple[Tensor, int]:
        y = y.astype(np.float64)
        return torch.from_numpy((y - y.mean()) / (y.std() or 1.0)).float().unsqueeze(1), 1

    def _loss(self, scores: Tensor, target: Tensor) -> Tensor:
        return functional.mse_loss(scores, target)

    def predict(self, X: Any) -> np.ndarray:
        """Target (n,)."""
        return self._outputs(X)[:, 0].astype(np.float64)
