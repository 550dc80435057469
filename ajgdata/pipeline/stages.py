"""Benchmark files -> what each stage of a run took."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence

import numpy as np

from ajgdata.evaluate.cost import memory_mb
from ajgdata.experiments import EXPERIMENTS
from ajgdata.paths import Paths
from ajgdata.report.job_times import JobTime, Stages
from ajgdata.store.benchmarks import Job, read_benchmarks, used_s
from ajgdata.store.sessions import list_datasets

#: Rules whose jobs every report on a data set rests on.
OF_DATASETS = ("acquire", "features", "merge")
#: Rules whose jobs are of a data set's task.
OF_TASKS = ("experiment",)
#: What rules make; of others (a report itself, or what an older version made) nothing is told.
STAGES = {
    "acquire": "recording",
    "features": "features",
    "merge": "features",
    "embed": "embeddings",
    "explorer": "embeddings",
    "train": "final models",
    "opening": "opening picture",
    "study": "studies of the virtual gripper",
    "ablate": "ablations",
    "page": "pages beside the report",
    "publish": "publishing",
    "collect": "table of results",
}


class Stopwatch:
    """The time that this process, and those it waited for, have taken since this was made."""

    def __init__(self) -> None:
        self.wall_s, self.cpu_s = time.perf_counter(), used_s()

    def so_far(self) -> JobTime:
        """Return it as the job of the report."""
        wall, cpu = time.perf_counter() - self.wall_s, used_s() - self.cpu_s
        return JobTime("report", (), wall, cpu, memory_mb("VmHWM"))


def stages_of(
    paths: Paths,
    *,
    datasets: Collection[str],
    tasks: Collection[tuple[str, str]],
    whole: bool,
    report: JobTime,
) -> Stages:
    """Time of the jobs that a report rests on, each as it was when it last ran; `report` is what
    the report itself took so far. With `whole` also jobs that are of no task: embeddings, what is
    published, studies. Raises DataError for a benchmark file that is none.
    """
    others = set(list_datasets(paths)) - set(datasets)
    jobs = [
        job
        for job in read_benchmarks(paths.benchmarks, paths.logs)
        if _known(job) and _belongs(job, datasets, tasks, others, whole)
    ]
    timed = (_timed(job, datasets) for job in jobs)
    return Stages((*timed, report), busy_s(jobs) + report.wall_s)


def _belongs(
    job: Job,
    datasets: Collection[str],
    tasks: Collection[tuple[str, str]],
    others: Collection[str],
    whole: bool,
) -> bool:
    if job.parts and job.parts[0] in datasets:
        if job.rule in OF_TASKS:
            return job.parts[:2] in tasks
        return whole or job.rule in OF_DATASETS  # final models are trained for no report
    return whole and not (job.parts and job.parts[0] in others)


def _known(job: Job) -> bool:
    """Return whether the job is of a rule and an experiment that there still are."""
    if job.rule in OF_TASKS:
        return len(job.parts) == 3 and job.parts[2].partition("-")[0] in EXPERIMENTS.names()
    return job.rule in STAGES


def _timed(job: Job, datasets: Collection[str]) -> JobTime:
    of_task = job.rule in OF_TASKS
    stage = EXPERIMENTS[job.parts[2].partition("-")[0]].title if of_task else STAGES[job.rule]
    parts = job.parts if job.parts and job.parts[0] in datasets else ()
    return JobTime(stage, parts, job.wall_s, job.cpu_s, job.peak_mb, of_task)


def busy_s(jobs: Sequence[Job]) -> float:
    """Return how long at least one job was running: the union of their times."""
    if not jobs:
        return 0.0
    spans = sorted((job.ended_s - job.wall_s, job.ended_s) for job in jobs)
    starts, ends = np.array(spans).T
    reached = np.maximum.accumulate(ends)
    begins = np.maximum(starts, np.concatenate([starts[:1], reached[:-1]]))
    return float(np.maximum(ends - begins, 0).sum())
