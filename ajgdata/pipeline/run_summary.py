"""Summary of a run: data, measurements, skipped tasks with reasons, and cost."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ajgdata.experiments.requests import MeasurementKey, measurement_name
from ajgdata.paths import Paths
from ajgdata.pipeline.machine import machine_line
from ajgdata.pipeline.run_end import INCOMPLETE
from ajgdata.report.comparison import tally_text
from ajgdata.store.benchmarks import RuleCost, read_costs
from ajgdata.store.features import open_store
from ajgdata.store.files import read_json, write_bytes
from ajgdata.store.findings import read_findings, unreadable
from ajgdata.store.models import ABOUT_FILE, read_description
from ajgdata.store.sessions import list_datasets
from ajgdata.types import WHOLE, DataError, Finding, IssueCounts, issue_counts, left_out, many

#: Rule that trains the final models.
FINAL_MODELS = "train"
#: Unreadable recordings of a data set that the summary names; the quarantine lists all.
MAX_NAMED = 5


def complete(
    paths: Paths,
    datasets: Sequence[str],
    requested: Sequence[MeasurementKey],
    trained: Sequence[str],
    optional: Sequence[str],
    files: Sequence[Path],
    summary: Path,
) -> None:
    """Write the `summary` of a target: its data sets, its measurements `requested`, and the models
    of the data sets `trained`. `files` are its measurements and studies.

    The last nine lines are the answer: sentences on the results, the number of skipped
    measurements, the report, the cost and the speed of the machine. Reasons are above them.
    `optional` are the tasks that may be skipped, as `data set/task`. If another task was skipped,
    or a recording or a result could not be read, the last line begins with INCOMPLETE. Results of
    other targets that could not be read are listed, too.
    """
    about_report = read_json(paths.runs)
    results = [
        about
        for about in about_report["measurements"]
        if tuple(about[key] for key in ("dataset", "task", "experiment", "model")) in requested
    ]
    models, unreadable_models = _final_models(paths, trained)
    skipped = _skipped(models, results)
    problems = {name: unreadable(read_findings(paths.quarantine(name))) for name in datasets}
    unreadable_results = about_report["unreadable"] | unreadable_models
    lines = [
        *(f"left out  {error}" for error in unreadable_results.values()),
        *_excluded_lines(paths, datasets),
        *_unreadable_lines(problems),
        *_rare_class_lines(results),
    ]
    lines += _skipped_lines(skipped, optional)
    lines += about_report["answer"]
    if about_report["placebo"]:
        lines.append(about_report["placebo"])
    if agreements := about_report["agreements"]:
        lines.append(f"comparison with the paper: {tally_text(agreements)}")
    lines += _issue_lines(paths, datasets)
    lines += [_used_line(paths, datasets), _measurements_line(results, skipped)]
    lines.append(f"report: {paths.report}")
    if cost := about_report["cost"]:
        lines.append(f"cost without final models: {cost}")
    lines.append(machine_line())
    required = list(dict.fromkeys(task for task, _ in skipped if task not in optional))
    own_results = {*map(str, files), *unreadable_models}
    incomplete = [*_skipped_end(required), *_unreadable_end(paths, problems)]
    if lost := unreadable_results.keys() & own_results:
        incomplete.append(f"{many(len(lost), 'result')} could not be read (reasons above)")
    if incomplete:
        lines.append(f"{INCOMPLETE} {'; '.join(incomplete)}")
    write_bytes(summary, "".join(f"{line}\n" for line in lines).encode())


def task_name(about: Mapping[str, Any]) -> str:
    """Return the data set and task of a result."""
    return f"{about['dataset']}/{about['task']}"


def _skipped(
    models: Mapping[str, Mapping[str, Any]], results: Sequence[Mapping[str, Any]]
) -> dict[tuple[str, str], list[str]]:
    """Return skipped measurements, models and parts, by task and reason.

    `models` are the descriptions of the final models, by file.
    """
    skipped = defaultdict(list)
    for about in results:
        name = measurement_name(about["experiment"], about["model"])
        reasons = {name: about.get("skipped", "")}
        reasons |= {f"{part} of {name}": why for part, why in about.get("others", {}).items()}
        for part, reason in reasons.items():
            skipped[task_name(about), str(reason)].append(part)
    for file, description in models.items():
        *_, name, task, model, _ = Path(file).parts
        reason = str(description.get("skipped", ""))
        skipped[f"{name}/{task}", reason].append(f"training of {model}")
    return {(task, reason): parts for (task, reason), parts in skipped.items() if reason}


def _final_models(
    paths: Paths, datasets: Sequence[str]
) -> tuple[dict[str, dict[str, Any]], dict[str, str]]:
    """Return the descriptions of the final models of data sets, and the errors of descriptions that
    cannot be read, both by file."""
    models = {}
    errors = {}
    for name in datasets:
        for file in sorted(paths.models(name).glob(f"*/*/{ABOUT_FILE}")):
            try:
                models[str(file)] = read_description(file.parent)
            except DataError as error:
                errors[str(file)] = str(error)
    return models, errors


def _skipped_lines(
    skipped: Mapping[tuple[str, str], Sequence[str]], optional: Sequence[str]
) -> Iterator[str]:
    """Yield each skipped or optional task with its parts and the reason."""
    for (task, reason), parts in sorted(skipped.items()):
        word = "optional" if task in optional else "skipped "
        yield f"{word}  {task}, {', '.join(parts)}: {reason}"


def _skipped_end(tasks: Sequence[str]) -> list[str]:
    """Return what a run without these tasks ends with; nothing if there are none."""
    if not tasks:
        return []
    text = f"{', '.join(tasks)} skipped (reasons above), everything else is done; "
    fix = "correct the data, or declare `optional: true` for the task in dataset.yaml"
    return [text + fix]


def _unreadable_lines(problems: Mapping[str, Sequence[Finding]]) -> Iterator[str]:
    """Yield the first unreadable recordings of each data set with their problems."""
    for name, findings in problems.items():
        for f in findings[:MAX_NAMED]:
            yield f"unreadable {name}/{f.session_id}/{f.recording_id}: {f.code}: {f.problem}"
        if len(findings) > MAX_NAMED:
            yield f"unreadable and {len(findings) - MAX_NAMED} more of {name}"


def _unreadable_end(paths: Paths, problems: Mapping[str, Sequence[Finding]]) -> list[str]:
    """Return what a run with unreadable recordings or sessions ends with, by data set."""
    texts = []
    for name, findings in problems.items():
        if not findings:
            continue
        recordings = {(f.session_id, f.recording_id) for f in findings}
        sessions = {session for session, recording in recordings if recording == WHOLE}
        count = len(recordings) - len(sessions)
        counted = [many(count, "recording")] if count else []
        counted += [many(len(sessions), "session")] if sessions else []
        fixes = "; or ".join(dict.fromkeys(finding.fix for finding in findings[:MAX_NAMED]))
        texts.append(
            f"{' and '.join(counted)} of {name} could not be read, see {paths.quarantine(name)}; "
            f"{fixes}, or set `quality` to `reject` in recordings.csv"
        )
    return texts


def _excluded_lines(paths: Paths, names: Sequence[str]) -> list[str]:
    """Return where the excluded recordings of each data set are listed."""
    counts = {name: len(left_out(read_findings(paths.quarantine(name)))) for name in names}
    return [
        f"left out  {many(count, 'recording')}: {paths.quarantine(name)}"
        for name, count in counts.items()
        if count
    ]


def _issue_lines(paths: Paths, names: Sequence[str]) -> list[str]:
    """Return the number of recordings with issues; nothing if there are none."""
    counts = sum(
        (issue_counts(read_findings(paths.quarantine(name))) for name in names), IssueCounts()
    )
    return [f"recordings with issues: {counts}"] if counts else []


def _rare_class_lines(results: Sequence[Mapping[str, Any]]) -> Iterable[str]:
    """Return the classes of each task that are excluded because they have too few groups."""
    return dict.fromkeys(
        f"left out  classes of {task_name(about)} with fewer groups than min_groups: "
        + ", ".join(about["left_out"])
        for about in results
        if about.get("left_out")
    )


def _used_line(paths: Paths, names: Sequence[str]) -> str:
    """Return the number of data sets and of used recordings."""
    used = 0
    for name in names:
        with open_store(paths.features(name)) as store:
            used += store.sizes["recording"]
    return f"{many(len(names), 'data set')}: {many(used, 'recording')} used"


def _measurements_line(
    results: Sequence[Mapping[str, Any]], skipped: Iterable[tuple[str, str]]
) -> str:
    """Return the number of measurements, and the names of skipped tasks."""
    absent = sum("skipped" in about for about in results)
    names = ", ".join(dict.fromkeys(task for task, _ in skipped))
    line = f"{many(len(results), 'measurement')}: {len(results) - absent} made, {absent} skipped"
    if names:
        line += f" ({names}; reasons above)" if absent else f"; parts of {names} skipped, see above"
    return line


def run_cost(paths: Paths, datasets: Sequence[str]) -> list[RuleCost]:
    """Return the cost by rule of all jobs on `datasets`.

    Except for a run of selected data sets, this includes jobs without a data set, such as studies.
    The report writes this cost, and the summary repeats it. Final models are excluded, because the
    report does not wait for them.
    """
    excluded = set(list_datasets(paths)) - set(datasets)
    return read_costs(
        paths.benchmarks,
        lambda name: name in datasets or (not paths.run and name not in excluded),
        without=(FINAL_MODELS,),
    )
