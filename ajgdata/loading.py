"""Load the features, recordings, folds, metrics and models of a project.

`import ajgdata` offers these functions.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ajgdata.acquire.recipe import session_names
from ajgdata.evaluate.task_data import TaskData, split_withheld, training_data
from ajgdata.paths import Paths, Tree, find_project, run_name
from ajgdata.store.audio import file_sha256
from ajgdata.store.features import open_store, read_store
from ajgdata.store.freshness import changes_since_features
from ajgdata.store.metrics import read_metrics
from ajgdata.store.models import other_version_reported, read_about, read_estimator, read_guard
from ajgdata.store.publishing.archive import read_checksums
from ajgdata.store.sessions import (
    check_declared,
    check_one_source,
    how_to_get_sessions,
    read_dataset,
    require_waveforms,
    whole_sessions,
)
from ajgdata.types import (
    MODELS,
    AudioSettings,
    DataError,
    DatasetSpec,
    Finding,
    NotPossibleError,
    checked_name,
)
from ajgdata.types.features import feature_settings
from ajgdata.types.input_layout import Covariate
from ajgdata.types.registry import TRUSTED_TYPES
from ajgdata.types.session import SIMULATED_SOURCES

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from sklearn.base import BaseEstimator

    from ajgdata.live.predictor import Predictor

#: Folder that contains `datasets/`; None: see `find_project`.
Project = str | Path | None


def load_features(name: str, project: Project = None) -> xr.Dataset:
    """Return the features and labels of the data set `name`; the features are read when used.

    Returns an xarray.Dataset with `feature` (recording, frequency), float32, and every label as a
    coordinate along `recording` (numbers: NaN is missing; text: "" is missing). Other features than
    spectra, and several microphones, have other dimensions (docs/features.md). `recording` is
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
    """Return the recordings of the data set `name` as one array; each file is read when used.

    Returns an xarray.Dataset with `waveform` (recording, time), float32, full scale ±1, NaN after
    the end of a shorter recording; `time` is in seconds. If `audio.microphone` lists several
    microphones, the dimensions are (recording, channel, time). Coordinates along `recording` are
    the labels (as in `load_features`), `frames` (samples of each recording) and `file`. A file with
    another rate, or with several channels, is converted if dataset.yaml permits it
    (`audio.other_rate`, `audio.microphone`). No features are needed.

    Rejected and unusable recordings are excluded; a UserWarning gives the number of unusable
    recordings. Another UserWarning reports outdated features. Raises DataError if no recording is
    left, and FileNotFoundError outside a project. Reading a waveform raises DataError if the file
    does not have the checksum of recordings.csv.

    >>> import ajgdata
    >>> recordings = ajgdata.load_recordings("size")
    >>> first = recordings.waveform[0].load()  # one file is read
    >>> first.shape, first.time.values[:2] * 44_100  # seconds times Hz
    ((44100,), array([0., 1.]))
    """
    from ajgdata.store.waveforms import open_recordings

    paths = find_project(project)
    spec = read_dataset(paths, name)
    require_waveforms(spec, "load_recordings")
    sessions = whole_sessions(paths, name, session_names(spec.recipe))
    check_one_source(paths, spec, sessions)
    recordings, issues = open_recordings([paths.session(name, s) for s in sessions], spec)
    if recordings is None:
        fix = how_to_get_sessions(paths, name)
        raise DataError(paths.sessions(name), "holds no recording that can be used", fix)
    excluded = [issue for issue in issues if issue.leaves_out]
    used = [issue for issue in issues if not issue.leaves_out]
    _warn_about(excluded, "excluded", name)
    _warn_about(used, "used with an issue", name)
    _warn_if_outdated(paths, name)
    is_simulated = bool(SIMULATED_SOURCES & set(recordings.source.values))
    attrs = {"data_set": name, "source": "simulated" if is_simulated else "recorded"}
    return recordings.assign_attrs(attrs, sample_rate_hz=spec.audio.sample_rate_hz)


def _warn_if_outdated(paths: Paths, name: str) -> None:
    """Warn if the features of a data set are outdated, or if a table cannot be read."""
    if not paths.dataset(name).is_file():
        return  # this computer has only the features of the data set
    try:
        spec = read_dataset(paths, name)
        changes = changes_since_features(paths, spec, session_names(spec.recipe))
    except DataError as error:
        warnings.warn(f"features of {name} may be outdated: {error}", stacklevel=3)
        return
    if changes:
        message = f"features of {name} are outdated: {', '.join(changes)}. "
        warnings.warn(f"{message}Run `ajgdata run {name}`.", stacklevel=3)


def _warn_about(issues: Sequence[Finding], outcome: str, name: str) -> None:
    """Warn once about all recordings with issues that have the same outcome."""
    if not issues:
        return
    count = len({(issue.session_id, issue.recording_id) for issue in issues})
    first = issues[0]
    warnings.warn(
        f"recordings of {name}: {count} {outcome}; "
        f"{first.session_id}/{first.recording_id}: {first.problem}; "
        f"`ajgdata check {name}` lists all",
        stacklevel=3,
    )


def load_metrics(*names: str, project: Project = None) -> pd.DataFrame:
    """Return the metrics of a run of the workflow: a table with one number per row.

    Returns a pandas.DataFrame with the columns of `docs/comparing.md`. `value` is float64 (NaN:
    undefined, see `reason`); accuracies are between 0 and 1, errors are in `unit`. After a run of
    selected data sets, `names` are these data sets, for example "mine" after `ajgdata run mine`.

    Raises DataError if the run has no metrics or if another version of ajgdata wrote them,
    FileNotFoundError outside a project.

    >>> import ajgdata
    >>> metrics = ajgdata.load_metrics()
    >>> errors = metrics.query("metric == 'rmse' and statistic == 'mean'")
    >>> errors.pivot_table("value", "dataset", "model").round(2).to_dict()
    {'linear': {'size': 1.05}}
    """
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
    >>> [len(test) for train, test in size.folds("size")]  # held-out recordings of each fold
    [4, 4, 4, 4]
    """
    paths = find_project(project)
    return Dataset(paths, read_dataset(paths, name))


def load_model(name: str, task: str, model: str = "cnn", project: Project = None) -> BaseEstimator:
    """Return the model trained for `task` on all recordings of the data set `name`.

    Returns a fitted scikit-learn estimator for features (n, n_features) as in `load_features`; the
    c covariates of a task follow in further columns, so the input is (n, n_features + c).
    `project` can also be a published folder with models (docs/publishing.md), or the folder
    `data/NAME/published` of a fetched one. Raises DataError if this model has not been trained.

    >>> import ajgdata
    >>> with ajgdata.load_features("size") as features:
    ...     spectra = features.feature.values  # (n, n_features), float32
    >>> edge_mm = ajgdata.load_model("size", "size", "ridge").predict(spectra)
    >>> edge_mm.shape
    (16,)
    """
    folder, _ = _model_folder(project, name, task, model)
    estimator, _ = read_model(folder)
    return estimator


def read_model(folder: Path) -> tuple[BaseEstimator, dict[str, Any]]:
    """Return the trained model in `folder` and the content of its model.json.

    Raises DataError if there is no trained model, or if its file contains a type that is not in
    `types.registry.TRUSTED_TYPES`.
    """
    about = read_about(folder)
    return read_estimator(folder, TRUSTED_TYPES), about


def load_predictor(name: str, task: str, model: str = "cnn", project: Project = None) -> Predictor:
    """Return a predictor for new recordings: the model trained for `task` of the data set `name`.

    The predictor checks a waveform with the checks of the workflow. It predicts calibrated
    probabilities, or a number with an interval, and detects an empty gripper and a novel object
    (`docs/predicting.md`). Raises DataError if this model has not been trained.

    >>> import ajgdata
    >>> predictor = ajgdata.load_predictor("size", "size", "ridge")
    >>> waveform = ajgdata.load_recordings("size").waveform[0].values  # (n,), full scale ±1
    >>> prediction = predictor.predict(waveform, sample_rate_hz=44_100)
    >>> prediction.unit, prediction.novelty <= 1
    ('mm', True)
    """
    folder, dataset_folder = _model_folder(project, name, task, model)
    return read_predictor(folder, name, task, dataset_folder)


def _model_folder(project: Project, name: str, task: str, model: str) -> tuple[Path, Path]:
    """Return the folder of a trained model, and that of its dataset.yaml.

    Raises DataError if there is no such folder.
    """
    checked_name(name)
    checked_name(task, "task")
    checked_name(model, "model")
    if project is not None and (Path(project) / Tree.SUMS).is_file():
        return _published_model(Tree(Path(project)), name, task, model), Path(project)
    paths = find_project(project)
    folder = paths.model(name, task, model)
    if folder.is_dir():
        return folder, paths.dataset(name).parent
    tasks = read_dataset(paths, name).tasks
    if task not in tasks:
        fix = f"use one of {', '.join(tasks)}" if tasks else "add it to dataset.yaml"
        raise DataError(folder, f"there is no task {task!r}", fix)
    if model not in MODELS:
        fix = f"use one of {', '.join(MODELS)}"
        raise DataError(folder, f"there is no model {model!r}", fix)
    fix = f"run `ajgdata train {name} {task} --model {model}`"
    raise DataError(folder, "this model has not been trained", fix)


def _published_model(tree: Tree, name: str, task: str, model: str) -> Path:
    """Return the folder of a model in a published folder.

    Raises DataError for a model that it lacks, for one of another data set, and for a file whose
    bytes are not those of SHA256SUMS.
    """
    hashes = read_checksums(tree / Tree.SUMS)
    prefix = Tree.model(task, model, "")
    files = {file: digest for file, digest in hashes.items() if file.startswith(prefix)}
    if not files:
        fix = "use the names of a folder in `models`, or publish again with --with-models"
        raise DataError(tree.root, f"has no model {task}/{model}", fix)
    for file, digest in files.items():
        if not (tree / file).is_file() or file_sha256(tree / file) != digest:
            problem = f"its bytes are not those of {Tree.SUMS} (sha256 differs)"
            raise DataError(tree / file, problem, "fetch or copy it again")
    folder = tree / prefix
    trained_on = read_about(folder)["provenance"]["data_set"]
    if trained_on != name:
        raise DataError(folder, f"is not a model of {name!r}", f"use the name {trained_on!r}")
    return folder


def read_predictor(
    folder: Path, dataset: str, task: str, dataset_folder: Path = Path()
) -> Predictor:
    """Return the predictor of the trained model in `folder`.

    `dataset` and `task` are the names that its predictions state, and `dataset_folder` is that of
    dataset.yaml. Raises DataError if there is no
    trained model, or if another version of ajgdata wrote it.
    """
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
            axes=tuple(about.get("axes", ())),
            audio=AudioSettings.model_validate(about["audio"]),
            features=feature_settings(about["features"]),
            covariates=tuple(Covariate(**item) for item in about.get("covariates", ())),
            calibration=calibration,
            folder=dataset_folder,
            guard=NoveltyGuard(
                **arrays,
                threshold=calibration.novelty_threshold,
                relative_threshold=calibration.relative_threshold,
            ),
        )


@dataclass(frozen=True, eq=False)
class Part:
    """Features and labels of n recordings for one task; row i of each array is one recording.

    A group, for example a grasp, is never in both parts of a fold.
    """

    X: np.ndarray  #: features (n, n_features), float32
    y: np.ndarray  #: labels (n,), float64 or text; vectors (n, k)
    groups: np.ndarray  #: names of the groups (n,), text
    recordings: np.ndarray  #: names of the recordings (n,), `<session>/<recording_id>`
    classes: tuple[
        str, ...
    ]  #: sorted classes of the task, also if a part lacks one; () for numbers

    def __len__(self) -> int:
        """Return the number of recordings."""
        return len(self.y)

    def __repr__(self) -> str:
        """Return the numbers of recordings, bins and groups."""
        groups = len(np.unique(self.groups))
        return f"<Part: {len(self)} recordings of {groups} groups, {self.X.shape[1]} bins>"


@dataclass(frozen=True)
class Dataset:
    """One data set of a project and the folds of its tasks; see `load_dataset`."""

    paths: Paths
    spec: DatasetSpec  #: content of its dataset.yaml

    @property
    def tasks(self) -> tuple[str, ...]:
        """Names of the tasks, in the order of dataset.yaml."""
        return tuple(self.spec.tasks)

    def all(self, task: str) -> Part:
        """Return every recording that has the target of `task`."""
        rows, classes = self._rows(task)
        return _part(rows, classes)

    def withheld(self, task: str) -> Part:
        """Return the recordings with withheld values: no fold trains on them, and each fold can be
        tested on them."""
        rows, classes = self._rows(task)
        _, withheld = self._split_withheld(task, rows)
        return _part(withheld, classes)

    def folds(self, task: str, seed: int = 0) -> list[tuple[Part, Part]]:
        """Return the training part and the test part of each cross-validation fold.

        No group is in both parts. With the seed of the workflow (default 0), the folds are those of
        the workflow. Withheld values are in neither part, see `withheld`. Raises DataError for an
        unknown task, or if the data are not sufficient for the folds.

        >>> import ajgdata
        >>> train, test = ajgdata.load_dataset("size").folds("size")[0]
        >>> set(train.groups) & set(test.groups)  # grasps in both parts
        set()
        """
        from ajgdata.evaluate.splits import column_folds

        rows, classes = self._rows(task)
        rows, _ = self._split_withheld(task, rows)
        settings = self.spec.tasks[task]
        n_folds = min(settings.folds, len(set(rows.group.tolist())))
        kind = self.spec.targets[settings.target].kind
        with self._insufficient_data_reported(task):
            pairs = column_folds(rows.value, rows.group, settings.groups, kind, n_folds, seed)
        return [
            (_part(rows.where(train), classes), _part(rows.where(test), classes))
            for train, test in pairs
        ]

    def _rows(self, task: str) -> tuple[TaskData, tuple[str, ...]]:
        """Return the recordings that have the target of a task, and the sorted classes."""
        if task not in self.spec.tasks:
            raise self._error(f"there is no task {task!r}", f"use {', '.join(self.spec.tasks)}")
        settings = self.spec.training(task)
        table = read_store(self.paths.features(self.spec.name))
        with self._insufficient_data_reported(task):
            rows = training_data(table, settings)
        if settings.kind == "regression":
            return rows, ()
        return rows, tuple(sorted(set(rows.value.tolist())))

    def _split_withheld(self, task: str, rows: TaskData) -> tuple[TaskData, TaskData]:
        """Return the recordings with training values, and the recordings with withheld values."""
        with self._insufficient_data_reported(task):
            return split_withheld(rows, self.spec.tasks[task].withhold)

    @contextmanager
    def _insufficient_data_reported(self, task: str) -> Iterator[None]:
        """Raise DataError if the block raises NotPossibleError, for data that are insufficient."""
        try:
            yield
        except NotPossibleError as error:
            raise self._error(f"task {task}: {error}", "record more, or change the task") from None

    def _error(self, problem: str, fix: str) -> DataError:
        return DataError(self.paths.dataset(self.spec.name), problem, fix)


def _part(rows: TaskData, classes: tuple[str, ...]) -> Part:
    """Return the public form of recordings of a task."""
    return Part(rows.feature, rows.value, rows.group, rows.name, classes)
