"""End of a run: its summary with data, measurements, skipped tasks with reasons, and cost."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ajgdata.paths import Paths
from ajgdata.report.comparison import tally_text
from ajgdata.store.benchmarks import RuleCost, read_costs
from ajgdata.store.features import open_store
from ajgdata.store.files import read_json, write_bytes
from ajgdata.store.findings import read_findings
from ajgdata.store.models import ABOUT_FILE
from ajgdata.store.sessions import list_datasets
from ajgdata.types import left_out

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


def complete(paths: Paths, datasets: Sequence[str], optional: Sequence[str], summary: Path) -> None:
    """Write the `summary` of a whole run: its measurements, and the models of `datasets`.

    `optional` are the tasks that may be skipped, as `data set/task`. If another task was skipped,
    the last line begins with INCOMPLETE.
    """
    results = read_json(paths.all_metrics)["experiments"]
    lines = _data_lines(paths, datasets)
    lines += dict.fromkeys(
        f"left out  classes of {task_name(about)} with fewer groups than min_groups: "
        + ", ".join(about["left_out"])
        for about in results
        if about.get("left_out")
    )
    absent = sum("skipped" in about for about in results)
    count = many(len(results), "measurement")
    lines.append(f"{count}: {len(results) - absent} made, {absent} skipped")
    skipped = _skipped(paths, datasets, results)
    for (task, reason), parts in sorted(skipped.items()):
        word = "optional" if task in optional else "skipped "
        lines.append(f"{word}  {task}, {', '.join(parts)}: {reason}")
    if agreements := read_json(paths.runs).get("agreements", {}):
        lines.append(f"comparison with the paper: {tally_text(agreements)}")
    if cost := run_cost(paths, datasets, everything=not paths.run):
        lines.append(_cost_line(cost[-1]))
    lines.append(f"report: {paths.report}")
    if required := dict.fromkeys(task for task, _ in skipped if task not in optional):
        lines.append(
            f"{INCOMPLETE} {', '.join(required)} skipped (reasons above), everything else is done; "
            "correct the data, or declare `optional: true` for the task in dataset.yaml"
        )
    write_bytes(summary, "".join(f"{line}\n" for line in lines).encode())


def task_name(about: Mapping[str, Any]) -> str:
    """Return the data set and task of a result."""
    return f"{about['dataset']}/{about['task']}"


def _skipped(
    paths: Paths, datasets: Sequence[str], results: Sequence[Mapping[str, Any]]
) -> dict[tuple[str, str], list[str]]:
    """Return skipped measurements, models and parts, by task and reason."""
    skipped = defaultdict(list)
    for about in results:
        kind = "-".join(filter(None, (about["experiment"], about["model"])))
        reasons = {kind: about.get("skipped", "")}
        reasons |= {f"{part} of {kind}": why for part, why in about.get("others", {}).items()}
        for part, reason in reasons.items():
            skipped[task_name(about), str(reason)].append(part)
    for name in datasets:
        for file in sorted(paths.models(name).glob(f"*/*/{ABOUT_FILE}")):
            *_, task, model, _ = file.parts
            reason = read_json(file).get("skipped", "")
            skipped[f"{name}/{task}", reason].append(f"training-{model}")
    return {(task, reason): parts for (task, reason), parts in skipped.items() if reason}


def _data_lines(paths: Paths, names: Sequence[str]) -> list[str]:
    """Return the numbers of used and excluded recordings, and where excluded ones are listed."""
    used, lines = 0, []
    for name in names:
        with open_store(paths.features(name)) as store:
            used += store.sizes["recording"]
        if excluded := len(left_out(read_findings(paths.quarantine(name)))):
            lines.append(f"left out  {many(excluded, 'recording')}: {paths.quarantine(name)}")
    return [f"{many(len(names), 'data set')}: {many(used, 'recording')} used", *lines]


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
