"""Data sets of a run of the workflow, with their sessions, and errors of their configs.

The errors are those that only other files show. Light: every process of Snakemake imports this
module and calls it while it parses, so nothing is written.
"""

from __future__ import annotations

import sys
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Any

from ajgdata.acquire.recipe import session_names
from ajgdata.experiments.requests import Request, all_requests
from ajgdata.paths import Paths
from ajgdata.pipeline.planned_grasps import planned_grasps
from ajgdata.report.comparison import parse_paper
from ajgdata.store.report_files import read_paper
from ajgdata.store.sessions import (
    check_one_source,
    dropped_sessions,
    how_to_get_sessions,
    incomplete_sessions,
    list_datasets,
    list_sessions,
    read_dataset,
)
from ajgdata.store.variants import files_without_data
from ajgdata.types import MODELS, DataError, DatasetSpec, one_line
from ajgdata.types.extras import optional_packages, require_extra


@dataclass(frozen=True)
class DatasetPlan:
    """One data set of a run.

    `virtual` are the sessions of its recipe, and `other_sets` the data sets that its experiments
    need in addition.
    """

    spec: DatasetSpec
    virtual: tuple[str, ...]
    sessions: tuple[str, ...]
    other_sets: frozenset[str]


def requested_models(targets: Collection[str]) -> frozenset[str] | None:
    """Return the models that the targets of a run train, or None if a target needs all results.

    `targets` are rules, or files relative to the project. Sessions, features and final models need
    neither experiments nor studies.

    >>> requested_models(["results/models/size/size/knn", "results/features/size.nc"])
    frozenset({'knn'})
    >>> requested_models(["report/index.html"])  # None
    """
    models = set()
    for target in targets:
        match PurePosixPath(target).parts:
            case ("results", "models", _, _, model):
                models.add(model)
            case ("results", "acquired" | "features", *_):
                pass
            case _:
                return None
    return frozenset(models) if targets else None


def plan(
    paths: Paths,
    only: Sequence[str] | None = None,
    *,
    check: bool = False,
    models: Collection[str] | None = None,
) -> dict[str, DatasetPlan]:
    """Return the data sets of a run by name.

    They are those of `only`, or else all with sessions or a recipe, and the other data sets that
    their tasks need before `snakemake everything`. Raises DataError for an invalid config, and if
    there is nothing to run. With `check`, it is also raised for `config_problems`, for simulated
    and recorded sessions in one data set, for scenes that the gripper cannot simulate, and if a
    package is not installed that the run needs; files of variants without a data set are printed.
    `models` are those of `requested_models`.
    """
    names = list(only) if only is not None else list_datasets(paths)
    if check:
        for line in files_without_data(paths):
            print(line, file=sys.stderr)
    plans = {}
    for name in names:  # grows by the data sets that tasks need
        spec = read_dataset(paths, name)
        requests = list(all_requests(spec, paths.dataset(name)))
        others = {other for request in requests for other in request.first_sets}
        others |= set(spec.noise_sets.values())  # also of tasks without models, for `train`
        virtual = tuple(session_names(spec.recipe))
        recorded = set(list_sessions(paths, name)) - dropped_sessions(paths, name, virtual)
        if check:
            check_packages(paths, spec, requests, virtual, models)
            _check(paths, spec, requests, virtual, recorded)
        names += sorted(others - set(names))
        sessions = sorted({*virtual, *recorded})
        if sessions:
            plans[name] = DatasetPlan(spec, virtual, tuple(sessions), frozenset(others))
        elif only is not None:
            fix = how_to_get_sessions(paths, name)
            raise DataError(paths.sessions(name), "holds no sessions", fix)
    for name, planned in plans.items():
        for missing in sorted(planned.other_sets - set(plans)):
            problem = f"needs the data set {missing!r}, which holds no sessions"
            raise DataError(paths.dataset(name), problem, how_to_get_sessions(paths, missing))
    if not plans:
        problem = "no data set here has recordings or a recipe"
        raise DataError(paths.datasets, problem, how_to_get_sessions(paths, "NAME"))
    return plans


def _check(
    paths: Paths,
    spec: DatasetSpec,
    requests: Iterable[Request],
    virtual: Sequence[str],
    recorded: Collection[str],
) -> None:
    """Raise DataError for the first problem of a data set, see `plan`."""
    problems = list(config_problems(paths, spec, requests))
    if problems:
        problem, fix = problems[0]
        suffix = f" (and {len(problems) - 1} more)" if problems[1:] else ""
        raise DataError(paths.dataset(spec.name), problem + suffix, fix)
    to_record = incomplete_sessions(paths, spec.name, virtual)
    if to_record:
        planned_grasps(paths.dataset(spec.name), spec, sorted(to_record))
    check_one_source(paths, spec, recorded)


def check_packages(
    paths: Paths,
    spec: DatasetSpec,
    requests: Iterable[Request],
    virtual: Sequence[str],
    models: Collection[str] | None = None,
) -> None:
    """Raise DataError if a package is not installed that the first results of a data set need.

    A model or an embedding of `requests` may need an extra, and missing recordings of a recipe need
    the virtual gripper. `virtual` are the sessions of the recipe. If the run only trains `models`,
    the other models and the embeddings are not checked.
    """
    file = paths.dataset(spec.name)
    if incomplete_sessions(paths, spec.name, virtual):
        require_extra("simulate", f"{file}: recipe")
    if models is None:
        if spec.embeddings:
            require_extra("cnn", f"{file}: embeddings")
        models = [part.name for request in requests for part in request.parts if not part.is_late]
    for name in dict.fromkeys(models):
        if name in MODELS and MODELS[name].extra:
            require_extra(MODELS[name].extra, f"{file}: model {name}")


def config_problems(
    paths: Paths, spec: DatasetSpec, requests: Iterable[Request]
) -> Iterator[tuple[str, str]]:
    """Yield the problems of a config, whose experiments are `requests`, each with its fix.

    They are test sets that do not exist or lack the target, noise that is not a data set or is
    tested, unknown published values, and missing files of the feature.
    """
    yield from _missing_files(paths, spec)
    known = list_datasets(paths)
    figures = parse_paper(read_paper(paths))
    # Each task with each other data set that its experiments need, once.
    tested = list(dict.fromkeys((r.task, other) for r in requests for other in r.other_sets))
    for name, other in tested:
        target = spec.tasks[name].target
        if other == spec.name or other not in known:
            problem = "the data set itself" if other == spec.name else "no such data set"
            fix = f"correct the name; declared here: {', '.join(known)}"
            yield f"task {name}: needs {other!r}, {problem}", fix
        elif read_dataset(paths, other).targets.get(target) != spec.targets[target]:
            problem = f"task {name}: needs {other!r}, which has no target {target!r} like this"
            yield problem, "declare it there, or drop it"
    for name, noise_set in spec.noise_sets.items():
        if noise_set not in known:
            fix = f"use white, pink, or a data set declared here: {', '.join(known)}"
            yield f"task {name}: augment.noise.source: no such data set {noise_set!r}", fix
        elif noise_set == spec.name or (name, noise_set) in tested:
            problem = f"task {name}: augment.noise.source {noise_set!r} is also tested"
            yield problem, "use other recordings as noise"
    for name, task in spec.tasks.items():
        for figure in sorted(set(task.papers.values()) - set(figures)):
            yield (
                f"task {name}: the paper has no figure {figure!r}",
                f"use one of {', '.join(figures)}",
            )


def _missing_files(paths: Paths, spec: DatasetSpec) -> Iterator[tuple[str, str]]:
    """Yield a problem and its fix for each file that the feature needs and that does not exist."""
    for file, sha256 in spec.features.files.items():
        if not (paths.dataset(spec.name).parent / file).is_file():
            fix = (
                f"copy the file with the sha256 {sha256} into the folder of dataset.yaml; a "
                "published data set does not contain it"
            )
            yield f"features.file: {file} does not exist", fix


class Declared(dict[Any, Any]):
    """Values that the data sets of a run declare, by key.

    An undeclared key ends the run with one line. Snakemake ignores any other error if the requested
    file exists, and reports that there is nothing to do.
    """

    def __missing__(self, key: str | tuple[str, ...]) -> None:
        """End the run."""
        name = key if isinstance(key, str) else " ".join(key)
        raise SystemExit(
            f"{name}: not declared in the data sets of this run; remove its results, or declare it"
        )


@contextmanager
def errors_in_one_line() -> Iterator[None]:
    """End the run with one line if data are wrong, or if a file or a package is missing."""
    try:
        with optional_packages("the workflow"):
            yield
    except (DataError, OSError) as error:
        raise SystemExit(one_line(error)) from error


def session_files(paths: Paths, plans: Mapping[str, DatasetPlan]) -> Declared:
    """Return the files from which the features of each data set are computed, by its name.

    Files of imported sessions are listed only if they exist, because the job reports missing files.
    """
    files = Declared()
    for name, plan in plans.items():
        files[name] = []
        for session in plan.sessions:
            tables = [paths.session_file(name, session), paths.recordings_file(name, session)]
            if session in plan.virtual:
                files[name] += [*tables, paths.acquired(name, session)]
            else:
                files[name] += [file for file in tables if file.is_file()]
    return files


def published(plans: Collection[str], only: Sequence[str] | None) -> list[str]:
    """Return the data sets of a run that are published: those of `only`, or else all."""
    unknown = sorted(set(only or ()) - set(plans))
    if unknown:
        problem = f"publish: {unknown[0]!r} is not a data set of this run"
        raise DataError("config", problem, f"use one of {', '.join(plans)}")
    return [name for name in plans if only is None or name in only]
