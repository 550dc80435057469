"""`ajgdata check`: every check on every recording, without changing anything; label counts."""

from __future__ import annotations

import os
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor

from ajgdata.acquire.protocol import REFERENCE
from ajgdata.experiments import all_requests
from ajgdata.paths import DATASET_FILE, Paths
from ajgdata.pipeline.plan import config_problems
from ajgdata.pipeline.progress import tracked
from ajgdata.pipeline.recordings import examine, finding
from ajgdata.store.audio import Remark
from ajgdata.store.findings import is_rejected, rejected, without_rejected
from ajgdata.store.labels import bad_labels, copies
from ajgdata.store.session_audio import AudioFile, SessionAudio, check_session, label_rows
from ajgdata.store.sessions import (
    check_one_kind,
    list_sessions,
    read_dataset,
    read_recordings,
    read_session,
)
from ajgdata.types import DataError, DatasetSpec, Finding, Target

Row = Mapping[str, str]
#: Rows of labels by session.
Tables = Mapping[str, Sequence[Row]]
CLASSES_NEEDED = 2
_SHOWN = 5


def validate_dataset(paths: Paths, dataset: str) -> tuple[int, list[Finding]]:
    """Check every session of a data set: files, samples, labels, copies.

    Returns the number of recordings and all issues. Raises DataError for a declaration that cannot
    be used.
    """
    spec = read_dataset(paths, dataset)
    list(all_requests(spec, paths.dataset(dataset)))  # raises DataError for what cannot be made
    names = list_sessions(paths, dataset)
    sessions = [check_session(paths.session(dataset, name)) for name in names]
    issues = list(_check_declaration(paths, spec, names))
    rows: list[tuple[str, str, tuple[str, ...]]] = []
    for session in sessions:
        problems = _check_session(session, spec)
        issues += problems
        unusable = {f.recording_id for f in problems if f.level == "error" or f.code == "rejected"}
        labels = {row["recording_id"]: row for row in session.labels}
        rows += [
            (f"{session.session_id}/{name}", file.sha256, _values(labels[name], spec))
            for file in session.files
            if (name := file.recording_id) not in unusable
        ]
    issues += label_issues({session.session_id: session.labels for session in sessions}, spec)
    if rows:
        issues += copies(*zip(*rows, strict=True)).values()
    return sum(len(session.labels) for session in sessions), sorted(issues)


def _values(row: Row, spec: DatasetSpec) -> tuple[str, ...]:
    return tuple(row.get(target, "") for target in spec.targets)


def _check_declaration(paths: Paths, spec: DatasetSpec, names: Sequence[str]) -> Iterator[Finding]:
    """Yield problems of the declaration, and an error if simulated and recorded sessions meet."""
    for problem, fix in config_problems(paths, spec):
        yield Finding(DATASET_FILE, "*", "", "error", "declaration", problem, fix)
    try:
        check_one_kind(paths, spec, names)
    except DataError as error:
        yield Finding("*", "*", "", "error", "mixed", error.problem, error.fix)


def _check_session(session: SessionAudio, spec: DatasetSpec) -> list[Finding]:
    """Return issues of files, samples and labels; a rejected recording has one note."""
    name, issues = session.session_id, list[Finding]()

    def check(file: AudioFile) -> tuple[Remark, ...]:
        return examine(file.path, spec.audio, spec.features.window).remarks

    with ThreadPoolExecutor(os.cpu_count()) as pool:  # numpy and the file system release the lock
        files = tracked(session.files, f"checking {name}")
        for file, remarks in zip(files, pool.map(check, session.files), strict=True):
            issues += [finding(name, file.recording_id, file.path, r) for r in remarks]
    table = {row["recording_id"]: row for row in session.labels}
    issues += [i for n, row in table.items() for i in bad_labels(name, n, row, spec.targets)]
    return without_rejected([*session.findings, *issues], list(rejected(name, table).values()))


def label_tables(paths: Paths, dataset: str) -> dict[str, list[dict[str, str]]]:
    """Return the label rows of each session of a data set."""
    folders = [paths.session(dataset, name) for name in list_sessions(paths, dataset)]
    return {f.name: label_rows(read_session(f), read_recordings(f)[0]) for f in folders}


def label_issues(tables: Tables, spec: DatasetSpec) -> list[Finding]:
    """Return a warning for grasps with two objects or target values, for numbers of samples that
    stand twice in a grasp, and for impossible tasks."""
    mixed_fix = "give each grasp of a session its own grasp_id"
    columns = dict.fromkeys(("object", *spec.targets))
    problems = [_mixed_grasps(tables, column, spec.targets.get(column)) for column in columns]
    issues = [("mixed_grasp", problem, mixed_fix) for problem in problems if problem]
    if problem := _repeated_samples(tables):
        sample_fix = "correct the numbers, or import with a --grasp that separates them"
        issues.append(("repeated_sample", problem, sample_fix))
    class_fix = "record or import another class"
    issues += [("no_task", problem, class_fix) for problem in impossible_tasks(tables, spec)]
    return [Finding("*", "*", "", "warning", *issue) for issue in issues]


def _mixed_grasps(tables: Tables, column: str, target: Target | None) -> str:
    """Return a line on grasps with several values of a column; "" if there are none."""
    values: dict[str, dict[str, None]] = defaultdict(dict)
    for session, rows in tables.items():
        for row in rows:
            if not is_rejected(row) and (text := row.get(column, "")) not in _missing(target):
                values[f"{session}/{row['grasp_id']}"][text] = None
    mixed = [f"{grasp} ({', '.join(texts)})" for grasp, texts in values.items() if len(texts) > 1]
    noun = "object" if column == "object" else f"value of {column}"
    counted = f"{len(mixed)} of {len(values)} grasps have more than one {noun}"
    return f"{counted}: {_listed(mixed)}" if mixed else ""


def _repeated_samples(tables: Tables) -> str:
    """Return a line on recordings with one grasp and one sample; "" if there are none.

    A grasp whose recordings all have sample 0 has no numbers of samples.
    """
    samples: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    for session, rows in tables.items():
        for row in rows:
            if not is_rejected(row):
                grasp = samples[f"{session}/{row['grasp_id']}"]
                grasp[str(row["sample"])].append(row["recording_id"])
    repeated = [
        f"{grasp}, sample {number} ({', '.join(names[:2])})"
        for grasp, numbers in samples.items()
        for number, names in numbers.items()
        if len(names) > 1 and set(numbers) != {"0"}
    ]
    counted = f"{len(repeated)} pairs of grasp and sample have several recordings"
    return f"{counted}: {_listed(repeated)}" if repeated else ""


def impossible_tasks(tables: Tables, spec: DatasetSpec) -> list[str]:
    """Return a line for each task without two classes, or without a number."""
    rows = [row for table in tables.values() for row in table if not is_rejected(row)]
    problems = []
    for name, task in spec.tasks.items() if rows else ():
        target = spec.targets[task.target]
        values = {row.get(task.target, "") for row in rows} - _missing(target)
        if task.classes:
            values &= set(task.classes)
        if not values:
            problems.append(f"task {name} is not possible: no recording has a {task.target}")
        elif target.kind == "classification" and len(values) < CLASSES_NEEDED:
            problems.append(f"task {name} is not possible: {values.pop()!r} is its only class")
    return problems


def counts(tables: Tables, targets: Mapping[str, Target]) -> dict[str, str]:
    """Return the numbers of recordings, objects and grasps, and of recordings per class.

    Empty-gripper references are not grasps and are counted separately.
    """
    all_rows = [(session, row) for session, table in tables.items() for row in table]
    rows = [(session, row) for session, row in all_rows if not row.get(REFERENCE)]
    used = [row for _, row in rows if not is_rejected(row)]
    grasps = Counter((session, row["grasp_id"]) for session, row in rows)
    sizes = sorted(Counter(grasps.values()).items())
    rejections = f" ({len(rows) - len(used)} rejected)" if len(used) < len(rows) else ""
    facts = {
        "recordings": f"{len(rows)}{rejections}",
        "objects": str(len({row["object"] for _, row in rows} - {""})),
        "grasps": str(len(grasps)),
        "samples per grasp": _listed([f"{size} ({n} grasp{'s' * (n != 1)})" for size, n in sizes]),
    }
    if references := len(all_rows) - len(rows):
        facts["references"] = str(references)
    for name, target in targets.items():
        cells = Counter(row.get(name, "") for row in used)
        missing = sum(cells.pop(text, 0) for text in _missing(target))
        values = [f"{text} {count}" for text, count in cells.most_common()]
        if target.kind == "regression":
            values = [f"{cells.total()} numbers, {len(cells)} distinct"]
        suffix = f"; {missing} missing" if missing else ""
        facts[f"recordings per {name}"] = _listed(values) + suffix
    return facts


def _listed(texts: Sequence[str]) -> str:
    """Return the first texts and the number of the remaining texts."""
    remaining = f" and {len(texts) - _SHOWN} more" if len(texts) > _SHOWN else ""
    return ", ".join(texts[:_SHOWN]) + remaining


def _missing(target: Target | None) -> set[str]:
    return {"", *(target.missing if target else ())}
