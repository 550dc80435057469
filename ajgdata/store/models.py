"""Trained models on disk, without pickle: safetensors for networks, skops for scikit-learn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ajgdata.store.files import json_bytes, read_json, replacing, write_bytes
from ajgdata.types import DataError

if TYPE_CHECKING:
    from sklearn.base import BaseEstimator

ABOUT_FILE = "model.json"
NETWORK_FILE = "model.safetensors"
ESTIMATOR_FILE = "model.skops"
GUARD_FILE = "guard.safetensors"
#: All models of a data set are made by one job, which its folder tells to be done.
_ANEW = "delete the folder of all models of its data set (results/models/NAME) and run again"


def write_network(folder: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write the weights of a network by name, arrays of any shape."""
    _write_arrays(folder / NETWORK_FILE, arrays)


def read_network(folder: Path) -> dict[str, np.ndarray]:
    """Return the arrays that `write_network` wrote, by name, of the same shapes."""
    return _read_arrays(folder / NETWORK_FILE)


def write_guard(folder: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write what tells the unknown and the empty gripper: see `evaluate.novelty.Guard`."""
    _write_arrays(folder / GUARD_FILE, arrays)


def read_guard(folder: Path) -> dict[str, np.ndarray] | None:
    """Return the arrays that `write_guard` wrote, by name; None if the model was stored without."""
    path = folder / GUARD_FILE
    return _read_arrays(path) if path.is_file() else None


def _write_arrays(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    from safetensors.numpy import save

    write_bytes(path, save(dict(arrays)))  # its own writer hides the file from all others


def _read_arrays(path: Path) -> dict[str, np.ndarray]:
    from safetensors import SafetensorError
    from safetensors.numpy import load_file

    try:
        return load_file(path)
    except (OSError, SafetensorError) as error:
        raise _unreadable(path, error) from None


def write_estimator(folder: Path, estimator: BaseEstimator) -> None:
    """Write a fitted scikit-learn estimator."""
    from skops.io import dump

    with replacing(folder / ESTIMATOR_FILE) as temporary:
        dump(estimator, temporary)


def read_estimator(folder: Path, trusted: Sequence[str]) -> BaseEstimator:
    """Return the estimator that `write_estimator` wrote. Types that are neither scikit-learn's nor
    numpy's nor `trusted` are refused with DataError."""
    from skops.io import load

    try:
        return load(folder / ESTIMATOR_FILE, trusted=list(trusted))
    except Exception as error:  # skops does not check its schema: any type can be raised
        raise _unreadable(folder / ESTIMATOR_FILE, error) from None


def write_about(folder: Path, about: Mapping[str, Any]) -> None:
    """Write the description of a trained model; last, since a folder without it has no model."""
    write_bytes(folder / ABOUT_FILE, json_bytes(about))


def read_about(folder: Path) -> dict[str, Any]:
    """Return the description of a trained model. Raises DataError if it could not be trained."""
    about = read_json(folder / ABOUT_FILE)
    if not isinstance(about, dict) or not {"model", "kind"} <= set(about):
        raise DataError(folder / ABOUT_FILE, "is not the description of a model", _ANEW)
    if "skipped" in about:
        raise DataError(folder, f"was not trained: {about['skipped']}", "mend the task first")
    return about


def _unreadable(path: Path, error: Exception) -> DataError:
    first = (str(error).splitlines() or [type(error).__name__])[0]
    return DataError(path, f"not a readable model ({first})", _ANEW)
