"""The manifests that the workflow's jobs depend on: a run updates them, a look only compares.

Snakemake tells whether it will execute jobs only when it builds their graph, hence the manifests of
a data set are dealt with when the inputs of its first job are asked for, not while it parses.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Literal

from ajgdata.paths import Paths, Tree
from ajgdata.pipeline.plan import DatasetPlan
from ajgdata.pipeline.planned_scenes import keep_scenes
from ajgdata.pipeline.progress import when_slow
from ajgdata.store import manifest
from ajgdata.store.clock import latest_s, mend_dates
from ajgdata.store.files import link_or_copy, write_bytes
from ajgdata.store.sessions import dropped_sessions, incomplete_sessions
from ajgdata.store.trouble import machine_trouble
from ajgdata.types import DataError

#: `run` executes jobs, `look` does not (a dry run, a summary), `job` is the process of one job.
Mode = Literal["run", "look", "job"]


class Inputs:
    """Files that jobs depend on, of the data sets of a run.

    `mode` is asked when the graph of jobs is built. When looking, a manifest that a run would write
    is written below `scratch` instead, and stands for the one in the project: it is newer than
    every result, so the jobs that a run would execute are announced.
    """

    def __init__(
        self,
        paths: Paths,
        plans: Mapping[str, DatasetPlan],
        mode: Callable[[], Mode],
        scratch: Path,
    ) -> None:
        self.paths, self.plans, self.mode, self.scratch = paths, plans, mode, scratch
        self._replaced: dict[str, dict[Path, Path]] = {}

    def of(self, dataset: str, path: Path) -> Path:
        """Return the file that a job depends on: `path`, up to date, or what stands for it."""
        if dataset not in self._replaced:
            with errors_stop_snakemake(dataset):
                self._replaced[dataset] = self._prepared(dataset)
        return self._replaced[dataset].get(path, path)

    def lost_tree(self, dataset: str) -> list[Path]:
        """Return a file if the published tree of `dataset` is gone and a run would publish it
        again."""
        receipt = self.paths.receipt(dataset)
        found = self.of(dataset, receipt)
        return [found] if found != receipt else []

    def _prepared(self, dataset: str) -> dict[Path, Path]:
        mode = self.mode()
        if mode == "run":
            update(self.paths, dataset, self.plans[dataset])
        if mode != "look":
            return {}
        replaced = {}
        for path, content in pending(self.paths, dataset, self.plans[dataset]).items():
            replaced[path] = self.scratch / path.absolute().relative_to(self.paths.root.absolute())
            write_bytes(replaced[path], content)
        latest = latest_s(*_results(self.paths)) if replaced else 0.0
        for path in replaced.values():
            if latest >= path.stat().st_mtime:  # the clock was set back
                os.utime(path, (latest + 1,) * 2)
        return replaced


@contextmanager
def errors_stop_snakemake(where: str) -> Iterator[None]:
    """Turn any error into a SystemExit with one line.

    Snakemake ignores exceptions of an input function if the outputs exist, and then reports that
    nothing is to be done. It does not ignore SystemExit.
    """
    try:
        yield
    except Exception as error:
        known = error if isinstance(error, DataError) else machine_trouble(error)
        problem = f"cannot determine what is out of date ({type(error).__name__}: {error})"
        fix = "correct this error, then run again"
        raise SystemExit(str(known or DataError(where, problem, fix))) from error


def dates_mended(paths: Paths) -> str:
    """Date results that bear dates to come as of now: else no change would make them anew. Return
    what is to be said of it, "" if there are none."""
    if count := mend_dates(*_results(paths)):
        return f"{count} results bore dates to come, as when a clock is set back: now dated today"
    return ""


def _results(paths: Paths) -> tuple[Path, list[Path]]:
    """Return the folder of results, and the one in it whose folders are no results of jobs."""
    return paths.results, [paths.published("")]


def update(paths: Paths, dataset: str, plan: DatasetPlan) -> None:
    """Bring the scenes and the manifests of a data set up to date, each only if it changed.

    What people get is not what Snakemake looks at: a removed link to the features is made again,
    and the receipt of a removed published tree is removed, so that it is published again.
    """
    keep_scenes(paths, plan.spec, plan.scenes)
    without = _unready(paths, dataset, plan)
    manifest.refresh(paths, dataset, incomplete=without, each=_noticed(dataset))
    if paths.merged(dataset).is_file() and not paths.features(dataset).is_file():
        link_or_copy(paths.merged(dataset), paths.features(dataset))
    if _tree_is_lost(paths, dataset):
        paths.receipt(dataset).unlink()


def pending(paths: Paths, dataset: str, plan: DatasetPlan) -> dict[Path, bytes]:
    """Return the content of what `update` would write or remove, by file, and change nothing.

    A session that will be recorded anew keeps its old manifests: the recording replaces them.
    """
    changed, anew = {}, set()
    for session, content in plan.scenes.items():
        scenes = paths.scenes(dataset, session)
        if not (scenes.is_file() and scenes.read_bytes() == content):
            changed[scenes] = content
            anew |= {session} if paths.audio_manifest(dataset, session).is_file() else set()
    without = _unready(paths, dataset, plan) | anew
    changed |= manifest.outdated(paths, dataset, incomplete=without, each=_noticed(dataset))
    if _tree_is_lost(paths, dataset):
        changed[paths.receipt(dataset)] = b""
    return changed


def _unready(paths: Paths, dataset: str, plan: DatasetPlan) -> set[str]:
    dropped = dropped_sessions(paths, dataset, plan.virtual)
    return dropped | incomplete_sessions(paths, dataset, plan.virtual)


def _noticed(dataset: str) -> Callable[[list[str]], Iterable[str]]:
    return partial(when_slow, what=f"reading new recordings of {dataset}")


def _tree_is_lost(paths: Paths, dataset: str) -> bool:
    whole = (paths.published(dataset) / Tree.SUMS).is_file()
    return paths.receipt(dataset).is_file() and not whole
