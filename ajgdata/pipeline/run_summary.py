"""Summary of a whole run for the console: data, measurements, skipped tasks with reasons, cost."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from ajgdata.paths import Paths
from ajgdata.pipeline.experiments import models_of
from ajgdata.pipeline.run import INCOMPLETE
from ajgdata.report.comparison import tally_text
from ajgdata.store.benchmarks import Job, RuleCost, cost_by_rule, read_benchmarks
from ajgdata.store.features import open_store
from ajgdata.store.files import read_json, write_bytes
from ajgdata.store.findings import read_findings
from ajgdata.store.models import ABOUT_FILE
from ajgdata.store.sessions import list_datasets
from ajgdata.types import DatasetSpec, left_out

Key = tuple[str, str, str]  #: data set, task or embedding, and kind of measurement
#: Lines of one sort that are listed; the report has all of them.
LISTED = 20
TRAINING = "training"
#: Between a part that was skipped, as a point of a curve, and its measurement.
PART_OF = " of "


class Data(NamedTuple):
    """Numbers of used and of excluded recordings of a data set."""

    name: str
    used: int
    left_out: int


class Skipped(NamedTuple):
    """Measurements of one task that the data do not allow, for one reason."""

    task: str
    kinds: tuple[str, ...]
    reason: str
    optional: bool


@dataclass(frozen=True)
class RunSummary:
    """Results of a whole run.

    `rare` are classes that tasks exclude by `min_groups`, with their groups; `agreements` counts
    the rows of the comparison with the paper by verdict; `cost` is the sum over all jobs.
    """

    data: tuple[Data, ...]
    asked: int
    skipped: tuple[Skipped, ...] = ()
    rare: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    agreements: Mapping[str, int] = field(default_factory=dict)
    cost: RuleCost | None = None


def complete(
    paths: Paths, specs: Mapping[str, DatasetSpec], keys: Sequence[Key], out: Path
) -> None:
    """Write the summary of a whole run to `out`; if a task was skipped that is not optional, its
    last line begins with INCOMPLETE."""
    run = summarise(paths, specs, keys)
    told = [*lines(paths, run), *skipped_line(run)]
    write_bytes(out, "".join(f"{line}\n" for line in told).encode())


def summarise(paths: Paths, specs: Mapping[str, DatasetSpec], keys: Sequence[Key]) -> RunSummary:
    """Return the results of the measurements `keys`, and of the models of their tasks."""
    reasons: dict[tuple[str, str, str], list[str]] = {}
    rare = {}
    for name, task, kind, path in _results(paths, specs, keys):
        about = read_json(path)
        if reason := about.get("skipped", ""):
            reasons.setdefault((name, task, str(reason)), []).append(kind)
        for part, reason in about.get("others", {}).items():
            reasons.setdefault((name, task, str(reason)), []).append(f"{part}{PART_OF}{kind}")
        if about.get("left_out"):
            rare[f"{name}/{task}"] = about["left_out"]
    skipped = (
        Skipped(f"{name}/{task}", tuple(kinds), reason, _is_optional(specs[name], task))
        for (name, task, reason), kinds in reasons.items()
    )
    costs = run_cost(paths, list(specs), everything=not paths.run)
    return RunSummary(
        data=tuple(_data(paths, name) for name in specs),
        asked=len(keys),
        skipped=tuple(skipped),
        rare=rare,
        agreements=read_json(paths.runs).get("agreements", {}),
        cost=costs[-1] if costs else None,
    )


def _results(
    paths: Paths, specs: Mapping[str, DatasetSpec], keys: Sequence[Key]
) -> Iterator[tuple[str, str, str, Path]]:
    """Yield data set, task, kind and file of each measurement, then of each model that is there."""
    for key in keys:
        yield *key, paths.experiment(*key)
    for name, task, model in models_of(specs, list(dict.fromkeys(key[:2] for key in keys))):
        about = paths.model(name, task, model) / ABOUT_FILE
        if about.is_file():
            yield name, task, f"{TRAINING}-{model}", about


def _is_optional(spec: DatasetSpec, task: str) -> bool:
    embeddings = spec.embeddings
    return embeddings[task].optional if task in embeddings else spec.tasks[task].optional


def _data(paths: Paths, name: str) -> Data:
    with open_store(paths.features(name)) as store:
        used = store.sizes["recording"]
    return Data(name, used, len(left_out(read_findings(paths.quarantine(name)))))


def run_cost(paths: Paths, datasets: Sequence[str], *, everything: bool) -> list[RuleCost]:
    """Return the cost by rule of all jobs on `datasets`; with `everything` also of jobs that do not
    belong to a data set, such as studies."""
    others = set(list_datasets(paths)) - set(datasets)

    def is_included(job: Job) -> bool:
        name = job.wildcards[0] if job.wildcards else ""
        return name in datasets or (everything and name not in others)

    return cost_by_rule([job for job in read_benchmarks(paths.benchmarks) if is_included(job)])


def lines(paths: Paths, run: RunSummary) -> list[str]:
    """Return the summary for a console."""
    used, out = (sum(getattr(one, key) for one in run.data) for key in ("used", "left_out"))
    told = [f"{many(len(run.data), 'data set')}: {many(used, 'recording')} used, {out} left out"]
    for one in run.data:
        if one.left_out:
            why = f"{paths.quarantine(one.name)} says why"
            told.append(f"left out  {one.left_out} of {one.name}: {why}")
    for task, counts in run.rare.items():
        named = ", ".join(f"{label} ({count})" for label, count in counts.items())
        told.append(f"left out  of {task}, classes of fewer groups than min_groups: {named}")
    whole = [k for one in run.skipped for k in one.kinds if PART_OF not in k]
    skipped = sum(not kind.startswith(TRAINING) for kind in whole)
    told.append(f"{many(run.asked, 'measurement')}: {run.asked - skipped} made, {skipped} skipped")
    for word, optional in (("skipped ", False), ("optional", True)):
        some = [one for one in run.skipped if one.optional is optional]
        told += _listed([f"{word}  {s.task}, {_kinds(s.kinds)}: {s.reason}" for s in some])
    if run.agreements:
        told.append(f"comparison with the paper: {tally_text(run.agreements)}")
    if run.cost:
        told.append(_cost_line(run.cost))
    told.append(f"report: {paths.report}")
    return told


def _cost_line(cost: RuleCost) -> str:
    return (
        f"cost: {many(cost.jobs, 'job')}, {cost.wall_s / 60:.1f} min of run time, "
        f"{cost.cpu_s / 60:.1f} min of CPU time, up to {cost.peak_mb:,.0f} MB per job"
    )


def many(count: int, noun: str) -> str:
    """Return `1 job` or `2,000 jobs`."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


def _kinds(kinds: Sequence[str]) -> str:
    """Return `cross_validation (knn, cnn), reflected_energy` of the names of jobs."""
    grouped: dict[str, list[str]] = {}
    for kind in kinds:
        name, _, model = kind.partition("-")
        grouped.setdefault(name, []).append(model)
    models = {name: ", ".join(filter(None, some)) for name, some in grouped.items()}
    return ", ".join(f"{name} ({some})" if some else name for name, some in models.items())


def _listed(told: list[str]) -> list[str]:
    more = [f"          and {len(told) - LISTED} more"] if len(told) > LISTED else []
    return told[:LISTED] + more


def skipped_line(run: RunSummary) -> list[str]:
    """Return the last line of a run that skipped tasks which are not optional, if there are any."""
    tasks = dict.fromkeys(one.task for one in run.skipped if not one.optional)
    if not tasks:
        return []
    first, *others = tasks
    more = f" and {len(others)} more" if others else ""
    return [
        f"{INCOMPLETE} {first}{more} skipped (reasons above), everything else is done; correct the "
        "data, or declare `optional: true` for the task in dataset.yaml"
    ]
