"""The functions of `import ajgdata`: features, recordings and folds of a data set, ready to use."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ajgdata.acquire.recipe import session_names
from ajgdata.evaluate.task_data import TaskData, frequent_classes, split_withheld, task_data
from ajgdata.paths import Paths, find_project, run_name
from ajgdata.store.features import open_store, read_store
from ajgdata.store.freshness import changes_since_features
from ajgdata.store.models import other_version_reported, read_about, read_estimator, read_guard
from ajgdata.store.sessions import check_declared, check_one_source, read_dataset, whole_sessions
from ajgdata.types import (
    AudioSettings,
    DataError,
    DatasetSpec,
    FeatureSettings,
    Finding,
    NotPossibleError,
    checked_name,
)
from ajgdata.types.session import SIMULATED_SOURCES

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from sklearn.base import BaseEstimator

    from ajgdata.live.predictor import Predictor

Project = str | Path | None


def load_features(name: str, project: Project = None) -> xr.Dataset:
    """Return the features of the data set `name`, lazily, and its labels.

    Returns an xarray.Dataset with `feature` (recording, frequency), float32, and every label as a
    coordinate along `recording` (numbers: NaN is missing; text: "" is missing). `recording` is
    `<session>/<recording_id>`; `sha256` is the hash of its file. Use a `with` block or `.close()`,
    because the file stays open. `project` is the folder that contains `datasets/` (default:
    AJGDATA_ROOT, else the working directory or the nearest folder above it).

    A UserWarning reports features that are outdated, e.g. because a label changed since then.
    Raises DataError if there is no such data set or if it has no features yet, FileNotFoundError
    outside a project.

    >>> import ajgdata
    >>> with ajgdata.load_features("size") as features:
    ...     mean = features.feature.sel(frequency=slice(200, 8000)).groupby("edge_mm").mean()
    >>> mean.sizes["edge_mm"], mean.edge_mm.values
    (4, array([12., 18., 24., 30.]))
    """
    paths = find_project(project)
    file = paths.features(checked_name(name))
    if not file.is_file():
        check_declared(paths, name)
    features = open_store(file)
    _warn_if_outdated(paths, name)
    return features


def load_recordings(name: str, project: Project = None) -> xr.Dataset:
    """Return the recordings of the data set `name` as one array, which is read when it is used.

    Returns an xarray.Dataset with `waveform` (recording, time), float32, full scale ±1, NaN after
    the end of a shorter recording; `time` is in seconds. Coordinates along `recording` are the
    labels (as in `load_features`), `frames` (samples of each recording) and `file`. Each file is
    converted as far as dataset.yaml allows (`audio.other_rate`, `audio.microphone`), and refused if
    its bytes are not the recorded ones. No features are needed.

    Rejected and unusable recordings are excluded; a UserWarning gives the number of unusable
    recordings. Another one reports that the features of the data set are outdated. Raises
    DataError if no recording is left, FileNotFoundError outside a project.

    >>> import ajgdata
    >>> recordings = ajgdata.load_recordings("size")
    >>> first = recordings.waveform[0].load()  # one file is read
    >>> first.shape, first.time.values[:2] * 44_100  # seconds times Hz
    ((44100,), array([0., 1.]))
    """
    from ajgdata.store.waveforms import open_recordings

    paths = find_project(project)
    spec = read_dataset(paths, name)
    sessions = whole_sessions(paths, name, session_names(spec.recipe))
    check_one_source(paths, spec, sessions)
    recordings, issues = open_recordings([paths.session(name, s) for s in sessions], spec)
    if recordings is None:
        fix = f"get some with `ajgdata import FOLDER --dataset {name}` or `ajgdata record`"
        raise DataError(paths.sessions(name), "holds no recording that can be used", fix)
    _warn_of(issues, name)
    _warn_if_outdated(paths, name)
    is_simulated = bool(SIMULATED_SOURCES & set(recordings.source.values))
    attrs = {"data_set": name, "source": "simulated" if is_simulated else "recorded"}
    return recordings.assign_attrs(attrs, sample_rate_hz=spec.audio.sample_rate_hz)


def _warn_if_outdated(paths: Paths, name: str) -> None:
    """Warn of features that are outdated, and of tables that cannot be read."""
    if not paths.dataset(name).is_file():
        return  # only the features are on this machine
    try:
        spec = read_dataset(paths, name)
        changes = changes_since_features(paths, spec, session_names(spec.recipe))
    except DataError as error:
        warnings.warn(f"features of {name} may be outdated: {error}", stacklevel=3)
        return
    if changes:
        message = f"features of {name} are outdated: {', '.join(changes)}. "
        warnings.warn(f"{message}Run `ajgdata run {name}`.", stacklevel=3)


def _warn_of(issues: Sequence[Finding], name: str) -> None:
    """Warn of recordings that are excluded, and of recordings that are used with an issue."""
    for outcome, excluded in (("excluded", True), ("used with an issue", False)):
        if some := [issue for issue in issues if issue.leaves_out == excluded]:
            first = some[0]
            count = len({(issue.session_id, issue.recording_id) for issue in some})
            message = f"recordings of {name}: {count} {outcome}; {first.session_id}/"
            message += f"{first.recording_id}: {first.problem}; `ajgdata check {name}` lists all"
            warnings.warn(message, stacklevel=3)


def load_metrics(*names: str, project: Project = None) -> pd.DataFrame:
    """Return every number of a run of the workflow, one per row.

    Returns a pandas.DataFrame with the columns of `docs/comparing.md`. `value` is float64 (NaN:
    undefined, see `reason`); accuracies are between 0 and 1, errors are in `unit`. `names` are the
    data sets of a run of selected data sets, for example "mine" after `ajgdata run mine`.

    Raises DataError if the run has no metrics or if another version of ajgdata wrote them,
    FileNotFoundError outside a project.

    >>> import ajgdata
    >>> metrics = ajgdata.load_metrics()
    >>> errors = metrics.query("metric == 'rmse' and statistic == 'mean'")
    >>> errors.pivot_table("value", "dataset", "model").round(2).to_dict()
    {'linear': {'size': 1.05}}
    """
    from ajgdata.store.metrics import read_metrics

    paths = Paths(find_project(project).root, run_name(names))
    if not paths.metrics_table.is_file():
        fix = "run `snakemake` first, or name the data sets of an `ajgdata run`"
        if names:
            fix = f"run `ajgdata run {' '.join(names)}` first"
        raise DataError(paths.metrics_table, "does not exist yet", fix)
    return read_metrics(paths.metrics_table)


def load_dataset(name: str, project: Project = None) -> Dataset:
    """Return the data set `name` with its tasks and their folds.

    Raises DataError if it has no dataset.yaml, FileNotFoundError outside a project.

    >>> import ajgdata
    >>> size = ajgdata.load_dataset("size")
    >>> size.tasks
    ('size',)
    >>> [len(test) for train, test in size.folds("size")]  # recordings held out
    [4, 4, 4, 4]
    """
    paths = find_project(project)
    return Dataset(paths, read_dataset(paths, name))


def load_model(name: str, task: str, model: str = "cnn", project: Project = None) -> BaseEstimator:
    """Return the model trained for `task` on all recordings of the data set `name`.

    Returns a fitted scikit-learn estimator for features (n, n_features) as in `load_features`.
    Raises DataError if it has not been, or could not be, trained.

    >>> import ajgdata
    >>> with ajgdata.load_features("size") as features:
    ...     spectra = features.feature.values  # (n, n_features), float32
    >>> edge_mm = ajgdata.load_model("size", "size", "ridge").predict(spectra)
    >>> edge_mm.shape
    (16,)
    """
    return read_model(_model_folder(find_project(project), name, task, model))[0]


def read_model(folder: Path) -> tuple[BaseEstimator, dict[str, Any]]:
    """Return the trained model in `folder`, and its description.

    Raises DataError if there is no trained model, and for a file with types that are not in
    `types.registry.TRUSTED_TYPES`.
    """
    from ajgdata.types.registry import TRUSTED_TYPES

    about = read_about(folder)
    return read_estimator(folder, TRUSTED_TYPES), about


def load_predictor(name: str, task: str, model: str = "cnn", project: Project = None) -> Predictor:
    """Return the model trained for `task` of the data set `name`, ready for new recordings.

    It checks waveforms as the workflow does, and returns calibrated probabilities, or a number with
    an interval, and whether the gripper is empty or the object novel: `docs/predicting.md`. Raises
    DataError if it has not been, or could not be, trained.

    >>> import ajgdata
    >>> predictor = ajgdata.load_predictor("size", "size", "ridge")
    >>> waveform = ajgdata.load_recordings("size").waveform[0].values  # (n,), full scale ±1
    >>> said = predictor.predict(waveform, sample_rate_hz=44_100)
    >>> said.unit, said.novelty <= 1
    ('mm', True)
    """
    return read_predictor(_model_folder(find_project(project), name, task, model), name, task)


def _model_folder(paths: Paths, name: str, task: str, model: str) -> Path:
    """Return the folder of a trained model. Raises DataError, which lists models, if there is
    none."""
    names = checked_name(name), checked_name(task, "task"), checked_name(model, "model")
    if not (folder := paths.model(*names)).is_dir():
        spec = read_dataset(paths, name)
        trained = {key: item.models for key, item in spec.tasks.items() if spec.final_models}
        known = "; ".join(f"{key}: {', '.join(own)}" for key, own in trained.items() if own)
        problem = "there is no such model" if task in spec.tasks else f"there is no task {task!r}"
        raise DataError(folder, problem, f"`ajgdata run {name}` trains {known or 'none'}")
    return folder


def read_predictor(folder: Path, dataset: str, task: str) -> Predictor:
    """Return the predictor in `folder`; raises DataError as `load_predictor` does."""
    from ajgdata.evaluate.in_use import Calibration
    from ajgdata.evaluate.novelty import NoveltyGuard
    from ajgdata.live.predictor import Predictor

    estimator, about = read_model(folder)
    arrays = read_guard(folder)
    with other_version_reported(folder):
        calibration = Calibration(**about["calibration"])
        return Predictor(
            estimator=estimator,
            dataset=dataset,
            task=task,
            model=about["model"],
            kind=about["kind"],
            unit=about["unit"],
            classes=tuple(about["classes"]),
            audio=AudioSettings.model_validate(about["audio"]),
            features=FeatureSettings.model_validate(about["features"]),
            calibration=calibration,
            guard=NoveltyGuard(
                **arrays,
                threshold=calibration.novelty_threshold,
                relative_threshold=calibration.relative_threshold,
            ),
        )


@dataclass(frozen=True, eq=False)
class Part:
    """Recordings with their labels for one task; row i of each array is one recording.

    `X` (n, n_features) float32; `y` (n,) float64 or text; `groups` (n,), never in two parts;
    `recordings` (n,) `<session>/<recording_id>`; `classes` of the whole task, sorted (none for
    regression).
    """

    X: np.ndarray
    y: np.ndarray
    groups: np.ndarray
    recordings: np.ndarray
    classes: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.y)

    def __repr__(self) -> str:
        """Return the numbers of recordings, bins and groups."""
        groups = len(np.unique(self.groups))
        return f"<Part: {len(self)} recordings of {groups} groups, {self.X.shape[1]} bins>"


@dataclass(frozen=True)
class Dataset:
    """One data set of a project; see `load_dataset`."""

    paths: Paths
    spec: DatasetSpec

    @property
    def tasks(self) -> tuple[str, ...]:
        """Names of the tasks, in the order of dataset.yaml."""
        return tuple(self.spec.tasks)

    def all(self, task: str) -> Part:
        """Return every recording that has the target of `task`."""
        return _part(*self._rows(task))

    def withheld(self, task: str) -> Part:
        """Return the recordings whose value no fold trains on: further test data of each fold."""
        rows, classes = self._rows(task)
        return _part(self._split_withheld(task, rows)[1], classes)

    def folds(self, task: str, seed: int = 0) -> list[tuple[Part, Part]]:
        """Return the training and the test part of each fold of the evaluation.

        No group is in both parts. `seed` is that of the workflow. Values that the task withholds
        are in neither part, see `withheld`. Raises DataError for an unknown task, and if the folds
        are not possible.

        >>> import ajgdata
        >>> train, test = ajgdata.load_dataset("size").folds("size")[0]
        >>> set(train.groups) & set(test.groups)  # grasps on both sides
        set()
        """
        from ajgdata.evaluate.splits import column_folds

        rows, classes = self._rows(task)
        known, _ = self._split_withheld(task, rows)
        settings = self.spec.tasks[task]
        number = min(settings.folds, len(set(known.group.tolist())))
        kind = self.spec.targets[settings.target].kind
        with self._possible(task):
            pairs = column_folds(known.value, known.group, settings.groups, kind, number, seed)
        return [
            (_part(known.where(train), classes), _part(known.where(test), classes))
            for train, test in pairs
        ]

    def _rows(self, task: str) -> tuple[TaskData, tuple[str, ...]]:
        """Return the recordings that have the target of a task, and the target's classes."""
        if task not in self.spec.tasks:
            raise self._error(f"there is no task {task!r}", f"use {', '.join(self.spec.tasks)}")
        settings = self.spec.tasks[task]
        target, groups, classes = settings.target, settings.groups, settings.classes
        kind = self.spec.targets[target].kind
        table = read_store(self.paths.features(self.spec.name))
        with self._possible(task):
            if settings.min_groups:
                frequent = frequent_classes(
                    table, target, groups, classes, settings.min_groups, self.spec.placebo
                )
                classes = tuple(frequent[0])
            rows = task_data(table, target, kind, groups, classes, self.spec.placebo)
        present = sorted(set(rows.value.tolist())) if kind == "classification" else []
        return rows, tuple(present)

    def _split_withheld(self, task: str, rows: TaskData) -> tuple[TaskData, TaskData]:
        with self._possible(task):
            return split_withheld(rows, self.spec.tasks[task].withhold)

    @contextmanager
    def _possible(self, task: str) -> Iterator[None]:
        """Raise DataError if the data are not sufficient for a task."""
        try:
            yield
        except NotPossibleError as error:
            raise self._error(f"task {task}: {error}", "record more, or change the task") from None

    def _error(self, problem: str, fix: str) -> DataError:
        return DataError(self.paths.dataset(self.spec.name), problem, fix)


def _part(rows: TaskData, classes: tuple[str, ...]) -> Part:
    return Part(rows.feature, rows.value, rows.group, rows.name, classes)
