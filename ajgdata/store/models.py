"""Trained models on disk, without pickle: safetensors for networks, skops for scikit-learn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile

import numpy as np

from ajgdata.store.files import read_json, replacing
from ajgdata.types import DataError

if TYPE_CHECKING:
    from sklearn.base import BaseEstimator

ABOUT_FILE = "model.json"
NETWORK_FILE = "model.safetensors"
ESTIMATOR_FILE = "model.skops"


def write_network(folder: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write the weights of a network by name, arrays of any shape."""
    from safetensors.numpy import save_file

    with replacing(folder / NETWORK_FILE) as temporary:
        save_file(dict(arrays), temporary)


def read_network(folder: Path) -> dict[str, np.ndarray]:
    """Return the arrays that `write_network` wrote, by name, of the same shapes."""
    from safetensors import SafetensorError
    from safetensors.numpy import load_file

    try:
        return load_file(folder / NETWORK_FILE)
    except (OSError, SafetensorError) as error:
        raise _unreadable(folder / NETWORK_FILE, error) from None


def write_estimator(folder: Path, estimator: BaseEstimator) -> None:
    """Write a fitted scikit-learn estimator."""
    from skops.io import dump

    with replacing(folder / ESTIMATOR_FILE) as temporary:
        dump(estimator, temporary)


def read_estimator(folder: Path, trusted: Sequence[str]) -> BaseEstimator:
    """Return the estimator that `write_estimator` wrote. Types that are neither scikit-learn's nor
    numpy's nor `trusted` are refused with DataError."""
    from skops.io import load
    from skops.io.exceptions import UntrustedTypesFoundException

    try:
        return load(folder / ESTIMATOR_FILE, trusted=list(trusted))
    except (OSError, ValueError, BadZipFile, UntrustedTypesFoundException) as error:
        raise _unreadable(folder / ESTIMATOR_FILE, error) from None


def read_about(folder: Path) -> dict[str, Any]:
    """Return what is known of a trained model. Raises DataError when it could not be trained."""
    about = read_json(folder / ABOUT_FILE)
    if "skipped" in about:
        raise DataError(folder, f"was not trained: {about['skipped']}", "mend the task first")
    return about


def _unreadable(path: Path, error: Exception) -> DataError:
    first = (str(error).splitlines() or [type(error).__name__])[0]
    return DataError(path, f"not a readable model ({first})", "delete its folder and run again")
