"""End of a run: its summary with data, measurements, skipped tasks with reasons, and cost."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ajgdata.paths import Paths
from ajgdata.pipeline.experiments import models_of
from ajgdata.report.comparison import tally_text
from ajgdata.store.benchmarks import RuleCost, read_costs
from ajgdata.store.features import open_store
from ajgdata.store.files import read_json, write_bytes
from ajgdata.store.findings import read_findings
from ajgdata.store.models import ABOUT_FILE
from ajgdata.store.sessions import list_datasets, read_dataset
from ajgdata.types import DatasetSpec, left_out

Key = tuple[str, str, str]  #: data set, task or embedding, and kind of measurement
Result = tuple[str, str, str, dict[str, Any]]  #: the key, and what its file says of it
TRAINING = "training"
#: The summary of a run that skipped tasks ends with a line that begins with this.
INCOMPLETE = "incomplete:"


def end_run(summary: Path, before_ns: int) -> None:
    """Print the summary of a whole run if this run wrote it; `before_ns` is its time before.

    A run that skipped tasks ends with one line and exit code 1. Its summary is removed, so that the
    next run reports the tasks again.
    """
    if modified_ns(summary) in (0, before_ns):
        return
    text = summary.read_text(encoding="utf-8")
    *_, last = text.splitlines()
    skipped = last.startswith(INCOMPLETE)
    shown = text.removesuffix(f"{last}\n") if skipped else text
    print(f"\n{shown}", flush=True)
    if skipped:
        summary.unlink()
        raise SystemExit(last)


def modified_ns(path: Path) -> int:
    """Return when a file was written, in ns; 0 if it does not exist."""
    return path.stat().st_mtime_ns if path.is_file() else 0


def complete(
    paths: Paths, datasets: Sequence[str], measurements: Sequence[Key], summary: Path
) -> None:
    """Write the `summary` of a whole run: its `measurements`, and the models of their tasks.

    If a task was skipped that is not optional, the last line begins with INCOMPLETE.
    """
    specs = {name: read_dataset(paths, name) for name in datasets}
    results = [(*key, read_json(path)) for *key, path in _results(paths, specs, measurements)]
    skipped = _skipped(specs, results)
    lines = _data_lines(paths, list(specs))
    lines += dict.fromkeys(
        f"left out  classes of {name}/{task} with fewer groups than min_groups: {', '.join(rare)}"
        for name, task, _, about in results
        if (rare := about.get("left_out"))
    )
    absent = sum(
        "skipped" in about and not kind.startswith(TRAINING) for *_, kind, about in results
    )
    count = len(measurements)
    lines.append(f"{many(count, 'measurement')}: {count - absent} made, {absent} skipped")
    for (task, reason, optional), kinds in sorted(skipped.items()):
        word = "optional" if optional else "skipped "
        lines.append(f"{word}  {task}, {', '.join(kinds)}: {reason}")
    if agreements := read_json(paths.runs).get("agreements", {}):
        lines.append(f"comparison with the paper: {tally_text(agreements)}")
    if cost := run_cost(paths, list(specs), everything=not paths.run):
        lines.append(_cost_line(cost[-1]))
    lines.append(f"report: {paths.report}")
    if missing := dict.fromkeys(task for task, _, optional in skipped if not optional):
        lines.append(
            f"{INCOMPLETE} {', '.join(missing)} skipped (reasons above), everything else is done; "
            "correct the data, or declare `optional: true` for the task in dataset.yaml"
        )
    write_bytes(summary, "".join(f"{line}\n" for line in lines).encode())


def _skipped(
    specs: Mapping[str, DatasetSpec], results: Sequence[Result]
) -> dict[tuple[str, str, bool], list[str]]:
    """Return skipped measurements, models and parts, by task, reason and whether it is optional."""
    skipped = defaultdict(list)
    for name, task, kind, about in results:
        spec = specs[name]
        optional = (spec.embeddings.get(task) or spec.tasks[task]).optional
        reasons = {kind: about.get("skipped", "")}
        reasons |= {f"{part} of {kind}": why for part, why in about.get("others", {}).items()}
        for what, why in reasons.items():
            if why:
                skipped[f"{name}/{task}", str(why), optional].append(what)
    return skipped


def _data_lines(paths: Paths, names: Sequence[str]) -> list[str]:
    """Return the numbers of used and excluded recordings, and where excluded ones are listed."""
    used, lines = 0, []
    for name in names:
        with open_store(paths.features(name)) as store:
            used += store.sizes["recording"]
        if excluded := len(left_out(read_findings(paths.quarantine(name)))):
            lines.append(f"left out  {many(excluded, 'recording')}: {paths.quarantine(name)}")
    return [f"{many(len(names), 'data set')}: {many(used, 'recording')} used", *lines]


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


def run_cost(paths: Paths, datasets: Sequence[str], *, everything: bool) -> list[RuleCost]:
    """Return the cost by rule of all jobs on `datasets`; with `everything` also of jobs that do not
    belong to a data set, such as studies."""
    others = set(list_datasets(paths)) - set(datasets)
    return read_costs(
        paths.benchmarks,
        lambda name: name in datasets or (everything and name not in others),
    )


def _cost_line(cost: RuleCost) -> str:
    return (
        f"cost: {many(cost.jobs, 'job')}, {cost.wall_s / 60:.1f} min of run time, "
        f"{cost.cpu_s / 60:.1f} min of CPU time, up to {cost.peak_mb:,.0f} MB per job"
    )


def many(count: int, noun: str) -> str:
    """Return `1 job` or `2,000 jobs`."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"
