"""Files of trained models, without pickle: skops for estimators, safetensors for arrays."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import ZipFile

import numpy as np
from pydantic import ValidationError
from safetensors import SafetensorError
from safetensors.numpy import load_file, save

from ajgdata.paths import command_for
from ajgdata.store.files import json_bytes, read_json, replacing, write_bytes
from ajgdata.types import DataError, describe
from ajgdata.types.extras import optional_packages
from ajgdata.types.formats import FORMAT_KEY, MODEL_FORMAT

if TYPE_CHECKING:
    from sklearn.base import BaseEstimator

ABOUT_FILE = "model.json"
ESTIMATOR_FILE = "model.skops"
GUARD_FILE = "guard.safetensors"
#: Largest ratio of unpacked size and size of a skops file. `write_estimator` does not compress, so
#: a larger ratio is an attack on the memory.
_MAX_EXPANSION = 10


def write_guard(folder: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write the arrays of `evaluate.novelty.Guard`, which detects novel objects, by name."""
    # The writer of safetensors restricts the permissions of the file.
    write_bytes(folder / GUARD_FILE, save(dict(arrays)))


def read_guard(folder: Path) -> dict[str, np.ndarray]:
    """Return the arrays of the guard by name. Raises DataError for a file that is not readable."""
    try:
        return load_file(folder / GUARD_FILE)
    except (OSError, SafetensorError) as error:
        raise _unreadable(folder / GUARD_FILE, error) from None


def write_estimator(folder: Path, estimator: BaseEstimator) -> None:
    """Write a fitted estimator of scikit-learn, or the CNN."""
    from skops.io import dump  # two seconds; most callers only read descriptions

    with replacing(folder / ESTIMATOR_FILE) as temporary:
        dump(estimator, temporary)


def read_estimator(folder: Path, trusted: Sequence[str]) -> BaseEstimator:
    """Return a fitted estimator.

    Raises DataError for a type that is not of scikit-learn or numpy and not `trusted`, for a file
    that is not readable, and for a network if its packages are not installed.
    """
    from skops.io import load  # two seconds; most callers only read descriptions

    try:
        _check_size(folder / ESTIMATOR_FILE)
        with optional_packages(folder):
            return load(folder / ESTIMATOR_FILE, trusted=list(trusted))
    except DataError:
        raise
    except Exception as error:  # skops does not check its schema: any type can be raised
        raise _unreadable(folder / ESTIMATOR_FILE, error) from None


def _check_size(path: Path) -> None:
    """Raise ValueError if a skops file, a ZIP archive, unpacks to far more than its own size."""
    with ZipFile(path) as archive:
        unpacked = sum(entry.file_size for entry in archive.infolist())
    if unpacked > _MAX_EXPANSION * path.stat().st_size:
        raise ValueError(
            f"{path.stat().st_size / 1e6:.1f} MB that unpack to {unpacked / 1e6:.0f} MB"
        )


def write_about(folder: Path, about: Mapping[str, Any]) -> None:
    """Write the description of a trained model, after its other files: without it, a folder has no
    model."""
    content = {**about, FORMAT_KEY: MODEL_FORMAT.version}
    write_bytes(folder / ABOUT_FILE, json_bytes(content))


def read_about(folder: Path) -> dict[str, Any]:
    """Return the description of a trained model, without the version of its format.

    Raises DataError if the model could not be trained, FormatError if it is of another version.
    """
    about = read_description(folder)
    if "skipped" in about:
        raise DataError(folder, f"was not trained: {about['skipped']}", "correct the task first")
    return about


def read_description(folder: Path) -> dict[str, Any]:
    """Return the description of a model; one that was not trained has the reason as `skipped`.

    Raises DataError if it cannot be read, FormatError if it is of another version.
    """
    file = folder / ABOUT_FILE
    about = read_json(file)
    command = command_for(file)
    if not isinstance(about, dict):
        raise DataError(file, "does not describe a model", MODEL_FORMAT.fix(command))
    MODEL_FORMAT.check(file, about.pop(FORMAT_KEY, None), command)
    return about


@contextmanager
def other_version_reported(folder: Path) -> Iterator[None]:
    """Raise DataError if the description of the model in `folder` lacks a setting, or has one that
    is unknown or invalid: another version of ajgdata wrote it."""
    try:
        yield
    except ValidationError as error:
        detail = describe(error, "").problem
    except KeyError as error:
        detail = f"{error.args[0]} is missing"
    except TypeError as error:  # arguments of a dataclass
        detail = str(error).partition("() ")[2]
    else:
        return
    problem = f"was written by another version of ajgdata ({detail})"
    file = folder / ABOUT_FILE
    raise DataError(file, problem, MODEL_FORMAT.fix(command_for(file)))


def _unreadable(path: Path, error: Exception) -> DataError:
    """Return the error of a file that cannot be read, with the first line of `error`."""
    first = (str(error).splitlines() or [type(error).__name__])[0]
    return DataError(path, f"not a readable model ({first})", MODEL_FORMAT.fix(command_for(path)))
