"""The paper's network, and the scikit-learn estimators that train, use and store it.

The paper gives the layers, softmax with cross-entropy for classes, a linear output with mean
squared error for numbers, and one normalisation, of the feature. Everything else below is ours:
chosen on the inner folds of one data set's training part, see docs/models.md, and the same for all
tasks.
The two estimators follow scikit-learn's conventions (`fit`, `predict`, `get_params`, `clone`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import islice
from typing import Any, Literal, Self

import numpy as np
import torch
from sklearn.base import BaseEstimator, ClassifierMixin, MultiOutputMixin, RegressorMixin
from sklearn.preprocessing import StandardScaler
from sklearn.utils.multiclass import check_classification_targets
from sklearn.utils.validation import check_is_fitted, validate_data
from torch import Tensor, nn
from torch.nn import functional

from ajgdata.models.device import CPU, CUDA, training_device
from ajgdata.types import Kind, NotPossibleError

FORWARD_ROWS = 256  # rows per forward pass: bounds memory, and stays in cache
#: All bins have one mean and one deviation, or each bin has its own.
Scaling = Literal["global", "per_bin"]


class SpectrumCnn(nn.Module):
    """From a feature as stored to class scores or a number; scaling included, so it exports whole.

    Input (n, n_features), output (n, n_outputs), float32. Buffers hold what is learned from the
    training rows by counting, not by gradient: `scale` () of the compression, which is 1 without
    one, `mean` and `std` (n_features,) of the bins; `target_mean` and `target_std` (n_outputs,) of
    regression.
    """

    scale: Tensor
    mean: Tensor
    std: Tensor
    target_mean: Tensor
    target_std: Tensor

    def __init__(
        self,
        n_features: int,
        n_outputs: int,
        channels: Sequence[int],
        kernel: int,
        stride: int,
        dropout: float,
        is_compressed: bool = False,
    ) -> None:
        super().__init__()
        self.is_compressed = is_compressed
        layers: list[nn.Module] = []
        length, before = n_features, 1
        for width in channels:
            layers.append(nn.Conv1d(before, width, kernel, stride, padding=kernel // 2))
            layers += [nn.BatchNorm1d(width), nn.ReLU()]
            length, before = (length + 2 * (kernel // 2) - kernel) // stride + 1, width
        self.convolutions = nn.Sequential(*layers)
        self.dropout = nn.Dropout(dropout)
        self.dense = nn.Linear(before * length, n_outputs)
        self.register_buffer("scale", torch.ones(()))
        self.register_buffer("mean", torch.zeros(n_features))
        self.register_buffer("std", torch.ones(n_features))
        self.register_buffer("target_mean", torch.zeros(n_outputs))
        self.register_buffer("target_std", torch.ones(n_outputs))

    def compress(self, x: Tensor) -> Tensor:
        """Return features (n, n_features) as asinh(x / scale), or unchanged without compression.

        The function is logarithmic for loud bins, linear for quiet ones, and defined at 0.
        """
        return torch.asinh(x / self.scale) if self.is_compressed else x

    def standardise(self, z: Tensor) -> Tensor:
        """Return bins (n, n_features), compressed or not, standardised."""
        return (z - self.mean) / self.std

    def trunk(self, z: Tensor) -> Tensor:
        """Return scores (n, n_outputs) of standardised bins (n, n_features)."""
        z = self.convolutions(z.unsqueeze(1))  # -> (n, channels, length)
        z = z.flatten(1)  # -> (n, channels * length)
        return self.dense(self.dropout(z))  # -> (n, n_outputs)

    def forward(self, x: Tensor) -> Tensor:
        """Return class scores, or the target in its own unit, (n, n_outputs), of features
        (n, n_features) as stored."""
        scores = self.trunk(self.standardise(self.compress(x)))
        return scores * self.target_std + self.target_mean


def in_chunks(X: np.ndarray) -> Iterator[Tensor]:
    """Yield float32 rows (n, n_features) in turn, FORWARD_ROWS of them at a time, as copies."""
    for start in range(0, len(X), FORWARD_ROWS):
        yield torch.from_numpy(X[start : start + FORWARD_ROWS].copy())


@contextmanager
def reproducible(seed: int) -> Iterator[None]:
    """Give torch one thread and a random state of `seed`; the caller's are restored.

    With one thread sums are added up in one order, whatever the number of cores.
    """
    threads = torch.get_num_threads()
    gpus = [torch.cuda.current_device()] if training_device() == CUDA else []
    with torch.random.fork_rng(devices=gpus):
        torch.set_num_threads(1)
        torch.default_generator.manual_seed(seed)
        if gpus:
            torch.cuda.manual_seed(seed)
        try:
            yield
        finally:
            torch.set_num_threads(threads)


def batches(rows: int, batch_size: int) -> Iterator[Tensor]:
    """Yield row numbers in a new random order per epoch, without end.

    The batches of an epoch differ by at most one row, so that no batch consists of a single row,
    which would have no variance.
    """
    parts = math.ceil(rows / batch_size)
    while True:
        order = torch.randperm(rows)
        yield from (order[part::parts] for part in range(parts))


class Descent:
    """Adam with `weight_decay` in the gradient, over one cycle of the learning rate up to `peak`
    (Smith, Topin 2019), which `step` can be called `steps` times for."""

    def __init__(self, module: nn.Module, steps: int, peak: float, weight_decay: float) -> None:
        weights = module.parameters()
        self._adam = torch.optim.Adam(weights, lr=peak, weight_decay=weight_decay, fused=True)
        self._cycle = torch.optim.lr_scheduler.OneCycleLR(self._adam, peak, steps)

    def step(self, loss: Tensor) -> None:
        """Change the weights by the gradient of a loss."""
        self._adam.zero_grad()
        loss.backward()
        self._adam.step()
        self._cycle.step()


class _Cnn(BaseEstimator):
    """Settings, training, prediction and stored state that classifier and regressor share."""

    module_: SpectrumCnn
    n_features_in_: int

    def __init__(
        self,
        *,
        # 1025 bins -> 32 x 257 -> 32 x 65 -> 32 x 17; 64 channels are slower and no better
        channels: tuple[int, ...] = (32, 32, 32),
        kernel: int = 9,  # 9 bins = 190 Hz; 5 is less accurate, 17 and 31 are slower, no better
        stride: int = 4,  # 2 is no better in twice the time; pooling is far less accurate
        dropout: float = 0.0,  # before the dense layer; 0.2 is no better, 0.5 less accurate
        compression: float | None = None,  # times the mean; the paper names no compression
        scaling: Scaling = "global",  # the paper names one normalisation only, of the feature
        epochs: int = 10,  # one cycle of the learning rate; 20 are no better in twice the time
        min_steps: int = 300,  # so that 20 recordings are not left with 30 updates
        batch_size: int = 8,  # 16 and 32 are no better
        max_learning_rate: float = 3e-3,  # peak of the cycle; 1e-3 and 1e-2 are less accurate
        weight_decay: float = 0.1,  # Adam's, in the gradient; 0.03 and 0.3 are less accurate
        random_state: int = 0,
    ) -> None:
        self.channels = channels
        self.kernel = kernel
        self.stride = stride
        self.dropout = dropout
        self.compression = compression
        self.scaling = scaling
        self.epochs = epochs
        self.min_steps = min_steps
        self.batch_size = batch_size
        self.max_learning_rate = max_learning_rate
        self.weight_decay = weight_decay
        self.random_state = random_state

    def fit(self, X: Any, y: Any) -> Self:
        """Train on features (n, n_features), any scale, and targets (n,).

        The same data and `random_state` give the same weights bit for bit on one machine; torch's
        global random state and thread count are left alone. Raises ValueError for NaN, infinity,
        and for a single recording or class.
        """
        X, y = self._validated(X, y)
        with reproducible(self.random_state):
            module = self._module(X.shape[1])
            if self.compression is not None:
                mean = np.abs(X).mean(dtype=np.float64)
                module.scale.fill_(float(mean * self.compression) or 1.0)
            bins = torch.cat([module.compress(x) for x in in_chunks(X)])
            self._learn_scale(module, bins.numpy())
            target = self._encoded(module, y)
            self._train(module, module.standardise(bins), target)
        self.module_ = module.eval()
        return self

    def _learn_scale(self, module: SpectrumCnn, bins: np.ndarray) -> None:
        """Give a network the mean and deviation of bins (n, n_features), compressed or not."""
        if self.scaling == "per_bin":
            each = StandardScaler().fit(bins)
            module.mean.copy_(torch.from_numpy(each.mean_))
            module.std.copy_(torch.from_numpy(each.scale_))
        else:
            module.mean.fill_(float(bins.mean(dtype=np.float64)))
            module.std.fill_(float(bins.std(dtype=np.float64)) or 1.0)

    def _module(self, n_features: int) -> SpectrumCnn:
        return SpectrumCnn(
            n_features,
            self._n_outputs(),
            self.channels,
            self.kernel,
            self.stride,
            self.dropout,
            is_compressed=self.compression is not None,
        )

    def _train(self, module: SpectrumCnn, inputs: Tensor, target: Tensor) -> None:
        """Train on standardised bins (n, n_features) and encoded targets (n, ...).

        The network is on the CPU before and after, whatever the device of the training.
        """
        device = training_device()
        module, inputs, target = module.to(device), inputs.to(device), target.to(device)
        per_epoch = math.ceil(len(inputs) / self.batch_size)
        steps = max(self.epochs * per_epoch, self.min_steps)
        descent = Descent(module, steps, self.max_learning_rate, self.weight_decay)
        for rows in islice(batches(len(inputs), self.batch_size), steps):
            descent.step(self._loss(module.trunk(inputs[rows]), target[rows]))
        module.to(CPU)

    def _outputs(self, X: Any) -> np.ndarray:
        """Return the output of the network (n, n_outputs) for features (n, n_features)."""
        check_is_fitted(self)
        X = validate_data(self, X, reset=False, dtype=np.float32)
        with reproducible(0), torch.inference_mode():
            return np.concatenate([self.module_(x).double().numpy() for x in in_chunks(X)])

    def __getstate__(self) -> dict[str, Any]:
        """Return the attributes of the estimator, with the network as arrays by name."""
        state = dict(vars(self))
        if "module_" in state:
            weights = self.module_.state_dict().items()
            state["module_"] = {name: value.numpy() for name, value in weights}
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the attributes that `__getstate__` returned."""
        self.__dict__.update(state)
        if "module_" in state:
            tensors = {name: torch.from_numpy(array) for name, array in state["module_"].items()}
            with reproducible(0):
                self.module_ = self._module(self.n_features_in_).eval()
            self.module_.load_state_dict(tensors)


class CnnClassifier(ClassifierMixin, _Cnn):
    """Softmax and cross-entropy (paper)."""

    classes_: np.ndarray

    def _validated(self, X: Any, y: Any) -> tuple[np.ndarray, np.ndarray]:
        X, y = validate_data(self, X, y, dtype=np.float32)
        check_classification_targets(y)
        self.classes_ = np.unique(y)
        if len(self.classes_) < 2:
            raise NotPossibleError(f"one class only, {self.classes_.tolist()[0]!r}: two are needed")
        return X, y

    def _n_outputs(self) -> int:
        return len(self.classes_)

    def _encoded(self, module: SpectrumCnn, y: np.ndarray) -> Tensor:
        return torch.from_numpy(np.searchsorted(self.classes_, y))

    _loss = staticmethod(functional.cross_entropy)

    def predict_proba(self, X: Any) -> np.ndarray:
        """Return the probability (n, n_classes) of each of `classes_`."""
        return torch.from_numpy(self._outputs(X)).softmax(dim=1).numpy()

    def predict(self, X: Any) -> np.ndarray:
        """Return the most probable class (n,)."""
        best = self._outputs(X).argmax(axis=1)
        return self.classes_[best]


class CnnRegressor(MultiOutputMixin, RegressorMixin, _Cnn):
    """Linear output and mean squared error (paper), on the standardised target.

    Targets may be (n,), or (n, k) for k numbers from one network.
    """

    n_outputs_: int
    flat_: bool  #: whether the targets were (n,): predictions then are, too

    def _validated(self, X: Any, y: Any) -> tuple[np.ndarray, np.ndarray]:
        X, y = validate_data(
            self, X, y, dtype=np.float32, y_numeric=True, multi_output=True, ensure_min_samples=2
        )
        self.flat_ = y.ndim == 1
        y = y.reshape(len(y), -1)
        self.n_outputs_ = y.shape[1]
        return X, y

    def _n_outputs(self) -> int:
        return self.n_outputs_

    def _encoded(self, module: SpectrumCnn, y: np.ndarray) -> Tensor:
        mean, std = np.mean(y, axis=0), np.std(y, axis=0)
        std = np.where(std > 0, std, 1.0)
        module.target_mean.copy_(torch.from_numpy(mean))
        module.target_std.copy_(torch.from_numpy(std))
        return torch.from_numpy((y - mean) / std).float()  # (n, n_outputs)

    _loss = staticmethod(functional.mse_loss)

    def predict(self, X: Any) -> np.ndarray:
        """Return the target (n,) or (n, k), as it was given, in its own unit."""
        outputs = self._outputs(X)
        return outputs[:, 0] if self.flat_ else outputs


def cnn(kind: Kind, seed: int) -> CnnClassifier | CnnRegressor:
    """Return the paper's model, unfitted: all bins have one scale, without compression."""
    estimator = CnnClassifier if kind == "classification" else CnnRegressor
    return estimator(random_state=seed)


def cnn_per_bin(kind: Kind, seed: int) -> CnnClassifier | CnnRegressor:
    """Return the paper's layers with compression, a scale per bin and dropout, unfitted.

    Bins that contain mostly noise have small deviations in quiet, so louder noise in use is many
    deviations from their mean. This was `cnn` until its error in noise had been seen.
    """
    return cnn(kind, seed).set_params(compression=1.0, scaling="per_bin", dropout=0.5)
