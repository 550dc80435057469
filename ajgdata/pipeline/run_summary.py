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
#: Number of unreadable recordings per data set that the summary names. The quarantine lists all.
MAX_NAMED = 5


def complete(
    paths: Paths,
    datasets: Sequence[str],
    requested: Sequence[MeasurementKey],
    trained: Sequence[tuple[str, str, str]],
    optional: Sequence[str],
    files: Sequence[Path],
    summary: Path,
) -> None:
    """Write the `summary` of a target.

    `datasets`, measurements `requested` and `files` of measurements and studies are those of the
    target. `trained` are its final models as (data set, task, model), and `optional` the tasks that
    may be skipped, as `data set/task`.

    The last nine lines are the answer: sentences on the results, the number of skipped
    measurements, the report, the cost and the speed of the machine. Reasons are above them. If a
    task that is not optional was skipped, or a recording or a result could not be read, the last
    line begins with INCOMPLETE. Unreadable results of other targets are also listed.
    """
    about_report = read_json(paths.runs)
    results = [
        about
        for about in about_report["measurements"]
        if tuple(about[key] for key in ("dataset", "task", "experiment", "model")) in requested
    ]
    models, unreadable_models = _final_models(paths, trained)
    skipped = _skipped(results, models)
    unreadable_results = {**about_report["unreadable"], **unreadable_models}
    findings = {name: read_findings(paths.quarantine(name)) for name in datasets}
    unreadable_recordings = {name: unreadable(own) for name, own in findings.items()}

    lines = [f"left out  {error}" for error in unreadable_results.values()]
    lines += _excluded_lines(paths, findings)
    lines += _unreadable_lines(unreadable_recordings)
    lines += _rare_class_lines(results)
    lines += _skipped_lines(skipped, optional)
    lines += about_report["answer"]
    if about_report["placebo"]:
        lines.append(about_report["placebo"])
    if about_report["agreements"]:
        lines.append(f"comparison with the paper: {tally_text(about_report['agreements'])}")
    lines += _issue_lines(findings)
    lines.append(_used_line(paths, datasets))
    lines.append(_measurements_line(results, skipped))
    lines.append(f"report: {paths.report}")
    if about_report["cost"]:
        lines.append(f"cost without final models: {about_report['cost']}")
    lines.append(machine_line())

    incomplete = []
    required = list(dict.fromkeys(task for task, _ in skipped if task not in optional))
    if required:
        incomplete.append(
            f"{', '.join(required)} skipped (reasons above), everything else is done; "
            "correct the data, or declare `optional: true` for the task in dataset.yaml"
        )
    incomplete += _unreadable_end(paths, unreadable_recordings)
    lost = unreadable_results.keys() & {*map(str, files), *unreadable_models}
    if lost:
        incomplete.append(f"{many(len(lost), 'result')} could not be read (reasons above)")
    if incomplete:
        lines.append(f"{INCOMPLETE} {'; '.join(incomplete)}")
    write_bytes(summary, "".join(f"{line}\n" for line in lines).encode())


def _final_models(
    paths: Paths, trained: Sequence[tuple[str, str, str]]
) -> tuple[dict[str, dict[str, Any]], dict[str, str]]:
    """Return the descriptions of the final models `trained`, and the errors of unreadable models.

    Both are by file.
    """
    models = {}
    errors = {}
    for key in trained:
        folder = paths.model(*key)
        file = str(folder / ABOUT_FILE)
        try:
            models[file] = read_description(folder)
        except DataError as error:
            errors[file] = str(error)
    return models, errors


def _skipped(
    results: Sequence[Mapping[str, Any]], models: Mapping[str, Mapping[str, Any]]
) -> dict[tuple[str, str], list[str]]:
    """Return skipped measurements, parts of measurements and models, by task and reason.

    `models` are the descriptions of the final models, by file.
    """
    skipped = defaultdict(list)
    for about in results:
        task = task_name(about)
        name = measurement_name(about["experiment"], about["model"])
        if about.get("skipped"):
            skipped[task, str(about["skipped"])].append(name)
        for part, reason in about.get("others", {}).items():
            skipped[task, str(reason)].append(f"{part} of {name}")
    for file, description in models.items():
        *_, dataset, task, model, _ = Path(file).parts
        if description.get("skipped"):
            skipped[f"{dataset}/{task}", str(description["skipped"])].append(f"training of {model}")
    return dict(skipped)


def task_name(about: Mapping[str, Any]) -> str:
    """Return the data set and task of a result."""
    return f"{about['dataset']}/{about['task']}"


def _excluded_lines(paths: Paths, findings: Mapping[str, Sequence[Finding]]) -> list[str]:
    """Return the number of excluded recordings per data set, with the file that lists them."""
    lines = []
    for name, own in findings.items():
        count = len(left_out(own))
        if count:
            lines.append(f"left out  {many(count, 'recording')}: {paths.quarantine(name)}")
    return lines


def _unreadable_lines(problems: Mapping[str, Sequence[Finding]]) -> Iterator[str]:
    """Yield a line for each of the first unreadable recordings of each data set."""
    for name, findings in problems.items():
        for issue in findings[:MAX_NAMED]:
            recording = f"{name}/{issue.session_id}/{issue.recording_id}"
            yield f"unreadable {recording}: {issue.code}: {issue.problem}"
        if len(findings) > MAX_NAMED:
            yield f"unreadable and {len(findings) - MAX_NAMED} more of {name}"


def _rare_class_lines(results: Sequence[Mapping[str, Any]]) -> Iterable[str]:
    """Return a line on the classes of each task that are excluded because they are too rare."""
    return dict.fromkeys(
        f"left out  classes of {task_name(about)} with fewer groups than min_groups: "
        + ", ".join(about["left_out"])
        for about in results
        if about.get("left_out")
    )


def _skipped_lines(
    skipped: Mapping[tuple[str, str], Sequence[str]], optional: Sequence[str]
) -> Iterator[str]:
    """Yield a line for each skipped task, optional or not, with its parts and the reason."""
    for (task, reason), parts in sorted(skipped.items()):
        word = "optional" if task in optional else "skipped "
        yield f"{word}  {task}, {', '.join(parts)}: {reason}"


def _issue_lines(findings: Mapping[str, Sequence[Finding]]) -> list[str]:
    """Return a line with the number of recordings with issues; no line if there are none."""
    counts = sum((issue_counts(own) for own in findings.values()), IssueCounts())
    return [f"recordings with issues: {counts}"] if counts else []


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
    n_skipped = sum("skipped" in about for about in results)
    n_measured = len(results) - n_skipped
    line = f"{many(len(results), 'measurement')}: {n_measured} made, {n_skipped} skipped"
    names = ", ".join(dict.fromkeys(task for task, _ in skipped))
    if not names:
        return line
    if n_skipped:
        return f"{line} ({names}; reasons above)"
    return f"{line}; parts of {names} skipped, see above"


def _unreadable_end(paths: Paths, problems: Mapping[str, Sequence[Finding]]) -> list[str]:
    """Return the end of the last line for each data set with unreadable recordings or sessions."""
    texts = []
    for name, findings in problems.items():
        if not findings:
            continue
        recordings = {(f.session_id, f.recording_id) for f in findings}
        sessions = {session for session, recording in recordings if recording == WHOLE}
        counts = {"recording": len(recordings) - len(sessions), "session": len(sessions)}
        counted = [many(count, noun) for noun, count in counts.items() if count]
        fixes = "; or ".join(dict.fromkeys(finding.fix for finding in findings[:MAX_NAMED]))
        texts.append(
            f"{' and '.join(counted)} of {name} could not be read, see {paths.quarantine(name)}; "
            f"{fixes}, or set `quality` to `reject` in recordings.csv"
        )
    return texts


def run_cost(paths: Paths, datasets: Sequence[str]) -> list[RuleCost]:
    """Return the cost per rule of all jobs on `datasets`.

    Jobs without a data set, such as studies, count unless the run is one of selected data sets.
    The report shows this cost, and the summary repeats it. Final models are excluded, because the
    report does not wait for them.
    """
    others = set(list_datasets(paths)) - set(datasets)

    def is_included(first_wildcard: str) -> bool:
        """Return whether a job counts. Its first wildcard is a data set, a study, or empty."""
        if paths.run:
            return first_wildcard in datasets
        return first_wildcard in datasets or first_wildcard not in others

    return read_costs(paths.benchmarks, is_included, without=(FINAL_MODELS,))
