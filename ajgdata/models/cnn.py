"""The network of the paper, and the scikit-learn estimators that train, use and store it.

The paper states the layers, softmax with cross-entropy for a classification, a linear output with
mean squared error for a regression, and one normalisation of the feature. We chose all other
settings on inner folds of the training part of one data set (see docs/models.md). They are the same
for all tasks. The two estimators follow the conventions of scikit-learn (`fit`, `predict`,
`get_params`, `clone`).
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

#: Number of rows per forward pass: it limits the memory, and the data stay in the cache.
FORWARD_ROWS = 256
#: Mean and standard deviation of the standardisation: one for all bins, or one per bin.
Scaling = Literal["global", "per_bin"]


class SpectrumCnn(nn.Module):
    """Network from features as stored (n, n_features) to class scores or targets (n, n_outputs).

    All arrays are float32. The scaling is part of the network, so exported networks contain it.
    Buffers are computed from the training rows without gradients: the `scale` () of the compression
    (1 without compression), `mean` and `std` (n_features,) of the bins, and `target_mean` and
    `target_std` (n_outputs,) of a regression.
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
        length = n_features
        before = 1  # channels of the input of a convolution
        for width in channels:
            layers.append(nn.Conv1d(before, width, kernel, stride, padding=kernel // 2))
            layers.append(nn.BatchNorm1d(width))
            layers.append(nn.ReLU())
            length = (length + 2 * (kernel // 2) - kernel) // stride + 1
            before = width
        self.convolutions = nn.Sequential(*layers)
        self.dropout = nn.Dropout(dropout)
        self.dense = nn.Linear(before * length, n_outputs)
        self.register_buffer("scale", torch.ones(()))
        self.register_buffer("mean", torch.zeros(n_features))
        self.register_buffer("std", torch.ones(n_features))
        self.register_buffer("target_mean", torch.zeros(n_outputs))
        self.register_buffer("target_std", torch.ones(n_outputs))

    def compress(self, x: Tensor) -> Tensor:
        """Return asinh(x / scale) of features x (n, n_features); x without compression.

        The function is logarithmic for x >> scale, linear for x << scale, and defined at 0.
        """
        return torch.asinh(x / self.scale) if self.is_compressed else x

    def standardise(self, z: Tensor) -> Tensor:
        """Return (z - mean) / std of the result z (n, n_features) of `compress`."""
        return (z - self.mean) / self.std

    def trunk(self, z: Tensor) -> Tensor:
        """Return scores (n, n_outputs) of standardised bins (n, n_features)."""
        z = self.convolutions(z.unsqueeze(1))  # -> (n, channels, length)
        z = z.flatten(1)  # -> (n, channels * length)
        return self.dense(self.dropout(z))  # -> (n, n_outputs)

    def forward(self, x: Tensor) -> Tensor:
        """Return the output (n, n_outputs) for features (n, n_features) as stored.

        These are class scores, or targets in their own unit.
        """
        scores = self.trunk(self.standardise(self.compress(x)))
        return scores * self.target_std + self.target_mean


def in_chunks(X: np.ndarray) -> Iterator[Tensor]:
    """Yield copies of up to FORWARD_ROWS rows of float32 features (n, n_features), in order."""
    for start in range(0, len(X), FORWARD_ROWS):
        yield torch.from_numpy(X[start : start + FORWARD_ROWS].copy())


@contextmanager
def reproducible(seed: int) -> Iterator[None]:
    """Use one thread and the random `seed` for torch in a block; then restore the previous state.

    With one thread, the order of additions does not depend on the number of cores.
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
    """Yield batches of row numbers without end, in a new random order for each epoch.

    The sizes of the batches of an epoch differ by at most one. No batch consists of a single row,
    because a single row has no variance.
    """
    parts = math.ceil(rows / batch_size)
    while True:
        order = torch.randperm(rows)
        for part in range(parts):
            yield order[part::parts]


class Descent:
    """Adam optimiser with one cycle of the learning rate up to `peak` (Smith & Topin 2019).

    `weight_decay` is added to the gradient. The cycle ends after `steps` calls of `step`.
    """

    def __init__(self, module: nn.Module, steps: int, peak: float, weight_decay: float) -> None:
        weights = module.parameters()
        self._adam = torch.optim.Adam(weights, lr=peak, weight_decay=weight_decay, fused=True)
        self._cycle = torch.optim.lr_scheduler.OneCycleLR(self._adam, peak, steps)

    def step(self, loss: Tensor) -> None:
        """Change the weights by one step along the gradient of a loss."""
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
        kernel: int = 9,  # 9 bins = 190 Hz; 5 is less accurate, 17 and 31 are slower and no better
        stride: int = 4,  # 2 takes twice the time and is no better; pooling is far less accurate
        dropout: float = 0.0,  # before the dense layer; 0.2 is no better, 0.5 less accurate
        compression: float | None = None,  # scale / mean |feature|; the paper has no compression
        scaling: Scaling = "global",  # the paper has one normalisation of the feature
        epochs: int = 10,  # one cycle of the learning rate; 20 take twice the time, no better
        min_steps: int = 300,  # with 20 recordings, the epochs have only 30 steps
        batch_size: int = 8,  # 16 and 32 are no better
        max_learning_rate: float = 3e-3,  # peak of the cycle; 1e-3 and 1e-2 are less accurate
        weight_decay: float = 0.1,  # in the gradient; 0.03 and 0.3 are less accurate
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
        """Train on features (n, n_features) of any scale, and on targets (n,).

        The same data and `random_state` give identical weights on the same computer. The random
        state and the number of threads of torch are unchanged afterwards. Raises ValueError for
        NaN or infinity, and for a single recording or class.
        """
        X, y = self._validated(X, y)
        with reproducible(self.random_state):
            module = self._module(X.shape[1])
            if self.compression is not None:
                mean = np.abs(X).mean(dtype=np.float64)
                module.scale.fill_(float(mean * self.compression) or 1.0)
            bins = torch.cat([module.compress(x) for x in in_chunks(X)])
            self._set_standardisation(module, bins.numpy())
            target = self._encoded(module, y)
            self._train(module, module.standardise(bins), target)
        self.module_ = module.eval()
        return self

    def _set_standardisation(self, module: SpectrumCnn, bins: np.ndarray) -> None:
        """Set `mean` and `std` of a network from bins (n, n_features) after the compression."""
        if self.scaling == "per_bin":
            scaler = StandardScaler().fit(bins)
            module.mean.copy_(torch.from_numpy(scaler.mean_))
            module.std.copy_(torch.from_numpy(scaler.scale_))
        else:
            module.mean.fill_(float(bins.mean(dtype=np.float64)))
            module.std.fill_(float(bins.std(dtype=np.float64)) or 1.0)

    def _module(self, n_features: int) -> SpectrumCnn:
        """Return a new network with the settings of the estimator."""
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
        """Train on standardised bins (n, n_features) and encoded targets (n,) or (n, n_outputs).

        The network is on the CPU before and after the training, also if the training uses a GPU.
        """
        device = training_device()
        module = module.to(device)
        inputs = inputs.to(device)
        target = target.to(device)
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
    """Classifier with softmax and cross-entropy, as in the paper."""

    classes_: np.ndarray

    def _validated(self, X: Any, y: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return features and targets as arrays, and learn the classes."""
        X, y = validate_data(self, X, y, dtype=np.float32)
        check_classification_targets(y)
        self.classes_ = np.unique(y)
        if len(self.classes_) < 2:
            raise NotPossibleError(f"one class only, {self.classes_.tolist()[0]!r}: two are needed")
        return X, y

    def _n_outputs(self) -> int:
        return len(self.classes_)

    def _encoded(self, module: SpectrumCnn, y: np.ndarray) -> Tensor:
        """Return the numbers of the classes y (n,)."""
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
    """Regressor with a linear output and mean squared error, as in the paper.

    The network is trained on standardised targets. Targets are (n,), or (n, k) for k outputs.
    """

    n_outputs_: int
    flat_: bool  #: whether targets and predictions are (n,), not (n, k)

    def _validated(self, X: Any, y: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return features and targets (n, k) as arrays, and learn the shape of the targets."""
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
        """Set `target_mean` and `target_std` of a network; return the standardised targets."""
        mean = np.mean(y, axis=0)
        deviation = np.std(y, axis=0)
        std = np.where(deviation > 0, deviation, 1.0)
        module.target_mean.copy_(torch.from_numpy(mean))
        module.target_std.copy_(torch.from_numpy(std))
        return torch.from_numpy((y - mean) / std).float()  # (n, n_outputs)

    _loss = staticmethod(functional.mse_loss)

    def predict(self, X: Any) -> np.ndarray:
        """Return the targets in their own unit, (n,) or (n, k) as in the training."""
        outputs = self._outputs(X)
        return outputs[:, 0] if self.flat_ else outputs


def cnn(kind: Kind, seed: int) -> CnnClassifier | CnnRegressor:
    """Return the unfitted model of the paper: one scale for all bins, and no compression."""
    estimator = CnnClassifier if kind == "classification" else CnnRegressor
    return estimator(random_state=seed)


def cnn_per_bin(kind: Kind, seed: int) -> CnnClassifier | CnnRegressor:
    """Return an unfitted model with the layers of the paper, compression, a scale per bin, dropout.

    Its error in noise is larger than that of `cnn`. In quiet training recordings, bins without
    signal have small standard deviations. Louder noise in use then differs from their mean by many
    standard deviations.
    """
    return cnn(kind, seed).set_params(compression=1.0, scaling="per_bin", dropout=0.5)
