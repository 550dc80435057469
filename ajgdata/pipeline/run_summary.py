"""What a run did, in a few lines for the console: data, measurements, what was skipped, and why."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from ajgdata.paths import Paths
from ajgdata.pipeline.experiments import models_of
from ajgdata.report.comparison import tally_text
from ajgdata.store.features import open_store
from ajgdata.store.files import read_json, write_bytes
from ajgdata.store.findings import read_findings
from ajgdata.store.models import ABOUT_FILE
from ajgdata.types import DataError, DatasetSpec

Key = tuple[str, str, str]  #: data set, task or embedding, and kind of measurement
#: Lines of one sort that are listed; the report has all of them.
LISTED = 20
TRAINING = "training"
#: Between a part that was skipped, as a point of a curve, and its measurement.
PART_OF = " of "


class Data(NamedTuple):
    """How many recordings of a data set are used, and how many are left out."""

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
    """What there is of what was asked for.

    `rare` are classes that tasks leave out by `min_groups`, with their groups; `absent` are
    measurements without a result; `agreements` counts the rows of the comparison with the paper by
    verdict; `report` is its first page, if there is one.
    """

    data: tuple[Data, ...]
    asked: int
    skipped: tuple[Skipped, ...] = ()
    rare: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    absent: tuple[str, ...] = ()
    agreements: Mapping[str, int] = field(default_factory=dict)
    report: Path | None = None

    @property
    def wanting(self) -> list[Skipped]:
        """Return what was skipped without being declared optional."""
        return [one for one in self.skipped if not one.optional]


def summarise(
    paths: Paths, specs: Mapping[str, DatasetSpec], keys: Sequence[Key], *, report: bool
) -> RunSummary:
    """Return what there is of the measurements `keys`, and of the models of their tasks.

    `report`: the report is part of the run.
    """
    reasons: dict[tuple[str, str, str], list[str]] = {}
    absent, rare = [], {}
    for name, task, kind, path in _results(paths, specs, keys):
        if not path.is_file():
            absent.append(f"{name}/{task}: {kind}")
            continue
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
    runs = read_json(paths.runs) if report and paths.runs.is_file() else {}
    return RunSummary(
        data=tuple(filter(None, (_data(paths, name) for name in specs))),
        asked=len(keys),
        skipped=tuple(skipped),
        rare=rare,
        absent=tuple(absent),
        agreements=runs.get("agreements", {}),
        report=paths.report if runs else None,
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


def _data(paths: Paths, name: str) -> Data | None:
    """Return what became of recordings; None without a store that can be read, of which jobs tell:
    a run that has ended well does not fail for its summary."""
    try:
        with open_store(paths.merged(name)) as store:
            used = store.sizes["recording"]
    except DataError:
        return None
    found = read_findings(paths.quarantine(name)) if paths.quarantine(name).is_file() else []
    recordings = {(one.session_id, one.recording_id) for one in found if one.leaves_out}
    return Data(name, used, len(recordings))


def lines(paths: Paths, run: RunSummary, failed: Sequence[str] = ()) -> list[str]:
    """Return the summary for a console; `failed` names the jobs that ended in an error."""
    used, left_out = (sum(getattr(one, key) for one in run.data) for key in ("used", "left_out"))
    told = [
        f"{many(len(run.data), 'data set')}: {many(used, 'recording')} used, {left_out} left out"
    ]
    for one in run.data:
        if one.left_out:
            why = f"{paths.quarantine(one.name)} says why"
            told.append(f"left out  {one.left_out} of {one.name}: {why}")
    for task, counts in run.rare.items():
        named = ", ".join(f"{label} ({count})" for label, count in counts.items())
        told.append(f"left out  of {task}, classes of fewer groups than min_groups: {named}")
    whole = [k for one in run.skipped for k in one.kinds if PART_OF not in k]
    skipped = sum(not kind.startswith(TRAINING) for kind in whole)
    gone = sum(f": {TRAINING}" not in one for one in run.absent)
    told.append(
        f"{many(run.asked, 'measurement')}: {run.asked - skipped - gone} made, {skipped} skipped, "
        f"{gone} not made"
    )
    for some, word in ((run.wanting, "skipped "), (_optional(run), "optional")):
        told += _listed([f"{word}  {s.task}, {_kinds(s.kinds)}: {s.reason}" for s in some])
    told += _listed([f"failed    {one}" for one in failed])
    if not failed:
        told += _listed([f"not made  {one}" for one in run.absent])
    if run.agreements:
        told.append(f"comparison with the paper: {tally_text(run.agreements)}")
    if run.report:
        told.append(f"report: {run.report}")
    return told


def _optional(run: RunSummary) -> list[Skipped]:
    return [one for one in run.skipped if one.optional]


def many(count: int, noun: str) -> str:
    """Return `1 job` or `2,000 jobs`."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


def _kinds(kinds: Sequence[str]) -> str:
    """Return `cross_validation (knn, cnn), permutation_test` of the names of jobs."""
    grouped: dict[str, list[str]] = {}
    for kind in kinds:
        name, _, model = kind.partition("-")
        grouped.setdefault(name, []).append(model)
    models = {name: ", ".join(filter(None, some)) for name, some in grouped.items()}
    return ", ".join(f"{name} ({some})" if some else name for name, some in models.items())


def _listed(told: list[str]) -> list[str]:
    more = [f"          and {len(told) - LISTED} more"] if len(told) > LISTED else []
    return told[:LISTED] + more


def complete(
    paths: Paths, specs: Mapping[str, DatasetSpec], keys: Sequence[Key], out: Path
) -> None:
    """Write the summary of a whole run to `out`."""
    run = summarise(paths, specs, keys, report=True)
    write_bytes(out, "".join(f"{line}\n" for line in lines(paths, run)).encode())


def skipped_line(run: RunSummary) -> str:
    """Return the last line of a run that skipped tasks which are not optional; else ""."""
    tasks = dict.fromkeys(one.task for one in run.wanting)
    if not tasks:
        return ""
    first, *others = tasks
    more = f" and {len(others)} more" if others else ""
    return (
        f"incomplete: {first}{more} skipped (reasons above), everything else is done; correct the "
        "data, or declare `optional: true` for the task in dataset.yaml"
    )
