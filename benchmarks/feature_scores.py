"""Measure the scores and the costs of the four shipped features on recorded and simulated data.

`python benchmarks/feature_scores.py PROJECT` writes `docs/which-feature.json`, from which
`python -m tools.feature_page` writes the tables and the figure of `docs/which-feature.md`. PROJECT
is a folder with the data sets of `EVALUATIONS`; the page lists the commands that import them.

Everything that could favour a feature was fixed before the first score was computed:

- Each feature has its default settings. The only exception is `length_s` of a spectrogram, which is
  the length of the shortest recording if this is less than its default of one second.
- Each feature has the same models and the same folds. `ridge` chooses its scaling and its penalty
  by inner folds, so that 64 and 40,000 values are both possible. `knn_plain` has fixed settings: on
  a spectrogram, the choice among nine settings takes 15 s per fold. Other models take longer.
- The loss of a recording is the mean over both models. No model is selected by its score.
- All features predict the same recordings: the first one of each grasp, if a grasp has several. A
  feature that more than a tenth of the recordings lack is not possible for the data set. A
  recording that lacks another feature is left out.

The features of a recording are computed in turn, so that other programs slow down all of them. Each
feature is the first one equally often, because the first one brings the samples into the cache.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from threadpoolctl import threadpool_limits

import ajgdata
from ajgdata.evaluate.crossval import CrossValidation, Predictions
from ajgdata.evaluate.intervals import mean_interval
from ajgdata.evaluate.metrics import METRICS, perfect_value, wrapped
from ajgdata.evaluate.splits import column_folds
from ajgdata.evaluate.task_data import TaskData
from ajgdata.features.compute import FeatureComputer
from ajgdata.paths import Paths
from ajgdata.store.audio import read_audio
from ajgdata.store.files import write_if_changed
from ajgdata.store.sessions import read_dataset
from ajgdata.types import DatasetSpec, FeatureKind, Kind
from ajgdata.types.features import SpectrogramSettings, feature_settings

RESULTS = Path(__file__).resolve().parents[1] / "docs" / "which-feature.json"
KINDS = ("spectrum", "spectrogram", "mel", "transfer_function")
MODELS = ("ridge", "knn_plain")
FOLDS = 5
#: Largest share of recordings that may lack a feature.
LACKING_SHARE = 0.1


class Evaluation(NamedTuple):
    """A data set, the predicted column, and the column whose groups are held out.

    `unit` is the column of the groups that intervals count. The models of each fold also predict
    the data sets `tests`.
    """

    dataset: str
    target: str
    held_out: str
    unit: str = "grasp_id"
    period: float | None = None
    tests: tuple[str, ...] = ()


EVALUATIONS = (
    Evaluation("active_rp", "label", "grasp_id"),
    Evaluation("active_rp", "label", "session_id"),
    Evaluation("knock_material", "material", "grasp_id"),
    Evaluation("stone_impact", "form", "sample_name", "sample_name"),
    Evaluation("stone_impact", "mass_ini", "sample_name", "sample_name"),
    Evaluation("esc10", "label", "fold"),
    Evaluation("mini_tapsense", "tap", "session_id"),
    Evaluation("sound_folders", "folder", "grasp_id"),
    Evaluation("sphere80", "material", "grasp_id"),
    Evaluation("sphere80", "material", "session_id"),
    Evaluation("sphere30", "material", "grasp_id"),
    Evaluation("sphere30", "material", "session_id"),
    Evaluation("plate", "material", "grasp_id"),
    Evaluation("plate", "material", "session_id"),
    Evaluation("orientation", "angle_deg", "grasp_id", period=180),
    Evaluation("orientation", "angle_deg", "session_id", period=180),
    Evaluation("size", "edge_mm", "grasp_id", tests=("size_80dba", "size_moved_transducers")),
    Evaluation("size", "edge_mm", "session_id"),
    Evaluation("ycb", "object", "grasp_id", tests=("ycb_moved_transducers", "ycb_other_membrane")),
    Evaluation("ycb", "object", "session_id"),
)


class FeatureTable(NamedTuple):
    """Features of the recordings of a data set, and their columns.

    `feature` has (n, values) by kind, `cpu_s` the median CPU time of one recording, and `columns`
    the labels (n,) by name. `lacking` has the number of recordings without each possible feature.
    """

    feature: dict[str, np.ndarray]
    cpu_s: dict[str, float]
    columns: dict[str, np.ndarray]
    lacking: dict[str, int]
    left_out: int
    source: str

    def rows(self, evaluation: Evaluation, kind: str) -> TaskData:
        """Return the recordings of an evaluation with the features of a kind."""
        columns = self.columns
        target = columns[evaluation.target]
        group = columns[evaluation.held_out].astype(str)
        data = TaskData(self.feature[kind], target, group, columns["recording"])
        return data.where(_has_value(target))


def _has_value(target: np.ndarray) -> np.ndarray:
    """Return which recordings (n,) have a value of a target."""
    is_number = np.issubdtype(target.dtype, np.floating)
    return np.isfinite(target) if is_number else target.astype(str) != ""


@cache
def feature_table(project: Path, name: str) -> FeatureTable:
    """Return all shipped features of the first recording of each grasp of a data set."""
    spec = read_dataset(Paths(project), name)
    recordings = ajgdata.load_recordings(name, project)
    first = np.unique(recordings["grasp_id"].values, return_index=True)[1]
    recordings = recordings.isel(recording=np.sort(first))
    played = played_sounds(Paths(project), spec, recordings)
    has_played = all(sound is not None for sound in played.values())
    computers = {
        kind: FeatureComputer(spec.audio, settings)
        for kind, settings in kinds_of(spec, recordings, has_played=has_played)
    }
    count = recordings.sizes["recording"]
    values: dict[str, list[np.ndarray | None]] = {kind: [] for kind in computers}
    seconds: dict[str, list[float]] = {kind: [] for kind in computers}
    with threadpool_limits(limits=1):
        for row, session in enumerate(recordings["session_id"].values):
            samples = recordings["waveform"][row].values[: int(recordings["frames"][row])]
            for kind in rotated(list(computers), row):
                start = time.process_time()
                try:
                    values[kind].append(computers[kind](samples, played[session]).values.ravel())
                except ValueError:
                    values[kind].append(None)
                seconds[kind].append(time.process_time() - start)
    lacking = {kind: np.array([row is None for row in values[kind]]) for kind in computers}
    possible = [kind for kind in computers if lacking[kind].mean() <= LACKING_SHARE]
    used = ~np.any([lacking[kind] for kind in possible], axis=0)
    labels = recordings.isel(recording=used)
    return FeatureTable(
        feature={
            kind: np.stack([values[kind][row] for row in np.flatnonzero(used)]) for kind in possible
        },
        cpu_s={kind: float(np.median(seconds[kind])) for kind in possible},
        columns={str(c): labels[c].values for c in labels.coords if c != "time"},
        lacking={kind: int(rows.sum()) for kind, rows in lacking.items()},
        left_out=count - int(used.sum()),
        source=recordings.attrs["source"],
    )


def rotated(names: list[str], places: int) -> list[str]:
    """Return names in the same order, but with another first name.

    >>> from benchmarks.feature_scores import rotated
    >>> rotated(["a", "b", "c"], 4)
    ['b', 'c', 'a']
    """
    first = places % len(names)
    return [*names[first:], *names[:first]]


def played_sounds(
    paths: Paths, spec: DatasetSpec, recordings: xr.Dataset
) -> dict[str, np.ndarray | None]:
    """Return the samples (m,) of the played sound of each session; None if it is not known."""
    played = {}
    for session in np.unique(recordings["session_id"].values).tolist():
        file = paths.session(spec.name, session) / "excitation.wav"
        played[session] = read_audio(file, spec.audio).samples if file.is_file() else None
    return played


def kinds_of(
    spec: DatasetSpec, recordings: xr.Dataset, *, has_played: bool
) -> list[tuple[str, FeatureKind]]:
    """Return the kinds of features that are possible for a data set, with their settings."""
    rate = spec.audio.sample_rate_hz
    chosen = []
    for kind in KINDS:
        settings = feature_settings({"kind": kind})
        if settings.needs_played and not has_played:
            continue
        if isinstance(settings, SpectrogramSettings):
            frames = recordings["frames"].values
            usable = frames[frames >= feature_settings({}).least_samples(rate)]
            shortest_s = float(usable.min()) / rate
            settings = settings.model_copy(update={"length_s": min(settings.length_s, shortest_s)})
        chosen.append((kind, settings))
    return chosen


def evaluated(project: Path, evaluation: Evaluation) -> list[dict[str, Any]]:
    """Return the scores of all features: on held-out groups, and on each data set of `tests`."""
    table = feature_table(project, evaluation.dataset)
    tests = {name: feature_table(project, name) for name in evaluation.tests}
    kind: Kind = "classification"
    if np.issubdtype(table.columns[evaluation.target].dtype, np.floating):
        kind = "regression"
    results: dict[str, dict[str, CrossValidation]] = {}
    for feature in table.feature:
        rows = table.rows(evaluation, feature)
        count = min(FOLDS, len(np.unique(rows.group)))
        folds = column_folds(rows.value, rows.group, evaluation.held_out, kind, count, 0)
        extra = {name: test.rows(evaluation, feature) for name, test in tests.items()}
        results[feature] = {
            model: ajgdata.cross_validate(
                *rows[:3],
                kind=kind,
                model=model,
                folds=folds,
                period=evaluation.period,
                extra_tests=extra,
                grasps=rows.name,
            )
            for model in MODELS
        }
    parts = [score_rows(evaluation, table, results, kind, "")]
    parts += [score_rows(evaluation, tests[name], results, kind, name) for name in tests]
    return parts


def score_rows(
    evaluation: Evaluation,
    tested: FeatureTable,
    results: Mapping[str, Mapping[str, CrossValidation]],
    kind: Kind,
    test_set: str,
) -> dict[str, Any]:
    """Return the scores of all features on the recordings `tested`.

    They are held-out recordings of the data set itself, or those of the data set `test_set`.
    """
    metric = METRICS[kind][0]
    known = _has_value(tested.columns[evaluation.target])
    unit = tested.columns[evaluation.unit][known].astype(str)
    by_feature = {}
    for feature, by_model in results.items():
        parts = {
            model: result.extra_tests[test_set] if test_set else result
            for model, result in by_model.items()
        }
        scores = next(iter(parts.values())).scores
        losses = np.mean(
            [loss(part.predictions, kind, evaluation.period) for part in parts.values()], axis=0
        )
        predictions = next(iter(parts.values())).predictions
        low, high = mean_interval(
            losses,
            unit[predictions.row],
            predictions.fold,
            root=kind == "regression",
            is_share=kind == "classification",
        )
        per_fold = fold_values(losses, predictions.fold, kind)
        by_feature[feature] = {
            "value": float(np.mean(per_fold)),
            "low": low,
            "high": high,
            "per_fold": per_fold,
            "per_model": {model: part.scores.mean[metric] for model, part in parts.items()},
            "train_cpu_s": sum(result.cost.train_cpu_s for result in by_model.values()),
        }
    return {
        "dataset": evaluation.dataset,
        "source": tested.source,
        "target": evaluation.target,
        "held_out": evaluation.held_out,
        "test_set": test_set,
        "metric": metric,
        "chance": scores.chance[metric],
        "perfect": perfect_value(metric),
        "recordings": scores.recordings,
        "units": len(np.unique(unit)),
        "features": by_feature,
    }


def loss(predictions: Predictions, kind: Kind, period: float | None) -> np.ndarray:
    """Return the squared error (n,) of each prediction; for classes 1 if it is correct, else 0."""
    if kind == "regression":
        return np.square(wrapped(predictions.y_pred - predictions.y_true, period))
    return np.asarray(predictions.y_pred == predictions.y_true, float)


def fold_values(losses: np.ndarray, fold: np.ndarray, kind: Kind) -> list[float]:
    """Return the accuracy of each fold, or its root mean square error, from losses (n,)."""
    means = [float(losses[fold == number].mean()) for number in np.unique(fold)]
    return [value**0.5 for value in means] if kind == "regression" else means


def costs(name: str, table: FeatureTable) -> dict[str, Any]:
    """Return the CPU time and the number of values of each feature of a data set."""
    features = {
        kind: {"values": values.shape[1], "cpu_s": table.cpu_s[kind]}
        for kind, values in table.feature.items()
    }
    recordings = len(table.columns["recording"])
    return {
        "dataset": name,
        "source": table.source,
        "recordings": recordings,
        "left_out": table.left_out,
        "lacking": table.lacking,
        "features": features,
    }


def without(rows: Sequence[dict[str, Any]], name: str) -> list[dict[str, Any]]:
    """Return the rows of other data sets."""
    return [row for row in rows if row["dataset"] != name]


def main() -> None:
    """Measure the chosen data sets, and keep the results of the other data sets."""
    names = list(dict.fromkeys(evaluation.dataset for evaluation in EVALUATIONS))
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("project", type=Path)
    parser.add_argument("--only", nargs="+", choices=names, default=names, metavar="DATASET")
    parser.add_argument("--results", type=Path, default=RESULTS)
    parser.add_argument("--costs", action="store_true", help="measure the costs, keep all scores")
    arguments = parser.parse_args()
    results: dict[str, Any] = {"scores": [], "costs": []}
    if arguments.results.is_file():
        results = json.loads(arguments.results.read_text(encoding="utf-8"))
    for name in arguments.only:
        start = time.perf_counter()
        if not arguments.costs:
            scores = without(results["scores"], name)
            for evaluation in EVALUATIONS:
                if evaluation.dataset == name:
                    scores += evaluated(arguments.project, evaluation)
            results["scores"] = scores
        cost = costs(name, feature_table(arguments.project, name))
        results["costs"] = [*without(results["costs"], name), cost]
        text = json.dumps(results, indent=1, ensure_ascii=False) + "\n"
        write_if_changed(arguments.results, text.encode())
        print(f"{name}: {time.perf_counter() - start:.0f} s", flush=True)


if __name__ == "__main__":
    main()
