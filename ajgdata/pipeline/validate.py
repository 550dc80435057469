"""`ajgdata check`: every check on every recording, without changing anything; label counts."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence

from ajgdata.acquire.protocol import REFERENCE
from ajgdata.evaluate.design import recording_design
from ajgdata.experiments.requests import all_requests
from ajgdata.paths import DATASET_FILE, Paths
from ajgdata.pipeline.plan import config_problems
from ajgdata.pipeline.played_sounds import played_sound_issues
from ajgdata.pipeline.progress import tracked
from ajgdata.pipeline.recordings import examine, finding
from ajgdata.pipeline.session_levels import level_issues
from ajgdata.pipeline.similar_classes import similar_classes
from ajgdata.pipeline.similar_sounds import Fingerprints, checked_sounds
from ajgdata.store.counters import grasp_key
from ajgdata.store.findings import is_rejected, rejected, without_rejected
from ajgdata.store.labels import bad_labels, comparable_labels, copies, parse_label
from ajgdata.store.listing import listed
from ajgdata.store.session_audio import SessionAudio, check_session, label_rows
from ajgdata.store.sessions import (
    check_one_source,
    list_datasets,
    list_sessions,
    read_dataset,
    read_recordings,
    read_session,
)
from ajgdata.types import WHOLE, DataError, DatasetSpec, Finding, Target

Row = Mapping[str, str]
#: Rows of labels by session.
Tables = Mapping[str, Sequence[Row]]
CLASSES_NEEDED = 2
#: Column that groups recordings if a task names no other.
DEFAULT_GROUPS = "grasp_id"
#: Texts listed in an issue or a line of counts.
_MAX_LISTED = 5


def validate_dataset(paths: Paths, dataset: str) -> tuple[int, list[Finding]]:
    """Check every session of a data set: files, samples, labels, copies.

    Returns the number of recordings and all issues. Raises DataError for a declaration that cannot
    be used.
    """
    spec = read_dataset(paths, dataset)
    list(all_requests(spec, paths.dataset(dataset)))  # raises DataError for what cannot be made
    names = list_sessions(paths, dataset)
    sessions = [check_session(paths.session(dataset, name)) for name in names]
    issues = [*_check_declaration(paths, spec, names), *_no_sessions(paths, spec, names)]
    used: list[tuple[str, str, Row]] = []
    prints = Fingerprints(paths, spec)
    for session in sessions:
        problems = _check_session(session, spec, prints)
        prints.finish()
        issues += problems
        unusable = {f.recording_id for f in problems if f.level == "error" or f.code == "rejected"}
        labels = {row["recording_id"]: row for row in session.labels}
        used += [
            (f"{session.session_id}/{name}", file.sha256, labels[name])
            for file in session.files
            if (name := file.recording_id) not in unusable
        ]
    issues += played_sound_issues(paths, spec, names)
    tables = {session.session_id: session.labels for session in sessions}
    issues += label_issues(tables, spec)
    issues += placement_notes(tables, spec)
    issues += placebo_issues(tables, spec)
    issues += _check_copies(paths, spec, used, prints)
    return sum(len(session.labels) for session in sessions), sorted(issues)


def _check_copies(
    paths: Paths, spec: DatasetSpec, used: Sequence[tuple[str, str, Row]], prints: Fingerprints
) -> list[Finding]:
    """Return issues of equal bytes, and of equal or similar sounds.

    `used` are name `<session>/<recording_id>`, sha256 and labels of recordings.
    """
    names = [name for name, _, _ in used]
    digests = [digest for _, digest, _ in used]
    labels = [comparable_labels(row, spec.targets) for _, _, row in used]
    copied = copies(names, digests, labels)
    distinct = [recording for number, recording in enumerate(used) if number not in copied]
    return [*copied.values(), *checked_sounds(paths, spec, prints.sounds(distinct, spec.targets))]


def _check_declaration(paths: Paths, spec: DatasetSpec, names: Sequence[str]) -> Iterator[Finding]:
    """Yield problems of the declaration, and an error if simulated and recorded sessions meet."""
    for problem, fix in config_problems(paths, spec):
        yield Finding(DATASET_FILE, WHOLE, "", "error", "declaration", problem, fix)
    try:
        check_one_source(paths, spec, names)
    except DataError as error:
        yield Finding(WHOLE, WHOLE, "", "error", "mixed", error.problem, error.fix)


def _no_sessions(paths: Paths, spec: DatasetSpec, names: Sequence[str]) -> list[Finding]:
    """Return an error for a data set without sessions; a recipe is simulated by the next run."""
    if names or spec.recipe:
        return []
    fix = (
        f"get some with `ajgdata import FOLDER --dataset {spec.name}` or "
        f"`ajgdata record {spec.name}`"
    )
    if paths.source(spec.name).is_file():
        fix = f"get some with `ajgdata fetch {spec.name}`"
    return [Finding(WHOLE, WHOLE, "", "error", "no_sessions", "there are no sessions", fix)]


def not_fetched(paths: Paths) -> list[str]:
    """Return the data sets of public recordings (`source.yaml`) without sessions."""
    public = [name for name in list_datasets(paths) if paths.source(name).is_file()]
    return [name for name in public if not list_sessions(paths, name)]


def _check_session(session: SessionAudio, spec: DatasetSpec, prints: Fingerprints) -> list[Finding]:
    """Return issues of files, samples and labels; a rejected recording has one note."""
    name = session.session_id
    issues: list[Finding] = []
    levels: dict[str, tuple[float, ...]] = {}

    # One after the other: threads wait for Python's lock, and need twice the CPU time.
    for file in tracked(session.files, f"checking {name}"):
        result = examine(file.path, spec.audio, spec.features.window, spec.features.band_hz)
        prints.add(file.sha256, result.samples)
        issues += [finding(name, file.recording_id, file.path, r) for r in result.remarks]
        if result.levels_db:
            levels[file.recording_id] = result.levels_db
    table = {row["recording_id"]: row for row in session.labels}
    used = {key: value for key, value in levels.items() if not is_rejected(table[key])}
    issues += level_issues(name, used, table, spec.targets, spec.audio.microphone)
    issues += [i for n, row in table.items() for i in bad_labels(name, n, row, spec.targets)]
    return without_rejected([*session.findings, *issues], list(rejected(name, table).values()))


def label_tables(paths: Paths, dataset: str) -> dict[str, list[dict[str, str]]]:
    """Return the label rows of each session of a data set."""
    folders = [paths.session(dataset, name) for name in list_sessions(paths, dataset)]
    return {f.name: label_rows(read_session(f), read_recordings(f)[0]) for f in folders}


def label_issues(tables: Tables, spec: DatasetSpec) -> list[Finding]:
    """Return a warning for grasps with two objects or target values, for several recordings of one
    grasp with one number of a sample, for classes that differ only in spelling, and for impossible
    tasks."""
    mixed_fix = "give each grasp of a session its own grasp_id"
    columns = dict.fromkeys(("object", *spec.targets))
    problems = [_mixed_grasps(tables, column, spec.targets.get(column)) for column in columns]
    issues = [("mixed_grasp", problem, mixed_fix) for problem in problems if problem]
    if problem := _repeated_samples(tables):
        sample_fix = "correct the numbers, or import with a --grasp that separates them"
        issues.append(("repeated_sample", problem, sample_fix))
    if problem := _grasp_spellings(tables):
        grasp_fix = "give both the same grasp_id in recordings.csv"
        issues.append(("grasp_spelling", problem, grasp_fix))
    class_fix = "write each class in one way in the table or recordings.csv; "
    class_fix += "--on-change labels takes the texts of the table"
    spellings = _similar_classes(tables, spec)
    issues += [("similar_classes", problem, class_fix) for problem in spellings]
    task_fix = "record or import another class"
    issues += [("no_task", problem, task_fix) for problem in impossible_tasks(tables, spec)]
    return [Finding(WHOLE, WHOLE, "", "warning", *issue) for issue in issues]


def placebo_issues(tables: Tables, spec: DatasetSpec) -> list[Finding]:
    """Return a warning if recordings lack an object of `placebo`: the placebo is then not measured.

    A data set without recordings has no warning.
    """
    objects = {row.get("object", "") for table in tables.values() for row in table}
    absent = [name for name in spec.placebo if name not in objects]
    if not absent or not objects:
        return []
    problem = f"placebo: no recording has the object {listed(absent, _MAX_LISTED)}"
    fix = "correct the names in dataset.yaml, or record them: until then the placebo has no score"
    return [Finding(WHOLE, WHOLE, "", "warning", "placebo", problem, fix)]


def placement_notes(tables: Tables, spec: DatasetSpec) -> list[Finding]:
    """Return a note for each classification whose classes and placements cannot be distinguished.

    Tasks that hold out sessions, or groups of a label, are not concerned.
    """
    rows = [(name, row) for name, table in tables.items() for row in table if not is_rejected(row)]
    notes = []
    for name, task in spec.tasks.items():
        target = spec.targets[task.target]
        if target.kind != "classification" or task.groups != DEFAULT_GROUPS:
            continue
        present = [
            (session, row)
            for session, row in rows
            if row.get(task.target, "") not in _missing(target)
            and row.get("object", "") not in spec.placebo
            and (not task.classes or row[task.target] in task.classes)
        ]
        values = [row[task.target] for _, row in present]
        if len(set(values)) < CLASSES_NEEDED:
            continue  # reported as an impossible task
        sessions = [session for session, _ in present]
        placements = [row.get("placement_id", "") for _, row in present]
        design = recording_design(values, sessions, placements)
        if design.problem:
            problem = f"task {name}: {design.problem}"
            notes.append(Finding(WHOLE, WHOLE, "", "note", "placement", problem, design.fix))
    return notes


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
    return f"{counted}: {listed(mixed, _MAX_LISTED)}" if mixed else ""


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
    return f"{counted}: {listed(repeated, _MAX_LISTED)}" if repeated else ""


def _grasp_spellings(tables: Tables) -> str:
    """Return a line on grasps of a session that differ only in the spelling of a number.

    A recording without a grasp has its recording_id as grasp_id: these are no spellings. Returns
    "" if no grasp has two spellings.
    """
    spellings: dict[str, dict[str, None]] = defaultdict(dict)
    for session, rows in tables.items():
        for row in rows:
            if row["grasp_id"] != row["recording_id"] and not is_rejected(row):
                grasp = "/".join((session, *grasp_key(row["grasp_id"])))
                spellings[grasp][row["grasp_id"]] = None
    several = [f"{grasp} ({', '.join(ids)})" for grasp, ids in spellings.items() if len(ids) > 1]
    if not several:
        return ""
    counted = f"{len(several)} of {len(spellings)} grasps have several spellings of a number"
    return f"{counted}: {listed(several, _MAX_LISTED)}"


def _similar_classes(tables: Tables, spec: DatasetSpec) -> list[str]:
    """Return a line for each target with classes that differ only in spelling.

    Objects are classes too; if they have the spellings of a target, they have no line of their own.
    """
    rows = [row for table in tables.values() for row in table if not is_rejected(row)]
    classes = [name for name, target in spec.targets.items() if target.kind == "classification"]
    problems: dict[str, str] = {}
    for column in dict.fromkeys((*classes, "object")):
        counted = Counter(row.get(column, "") for row in rows)
        for text in _missing(spec.targets.get(column)):
            del counted[text]
        groups = similar_classes(counted)
        texts = ["; ".join(f"{name!r} {count}" for name, count in g.items()) for g in groups]
        if texts:
            noun = "objects" if column == "object" else f"classes of {column}"
            spellings = ", and ".join(texts)
            problems.setdefault(spellings, f"{noun} differ only in spelling: {spellings}")
    return list(problems.values())


def impossible_tasks(tables: Tables, spec: DatasetSpec) -> list[str]:
    """Return a line for each task without two classes, or without a number."""
    rows = [
        row
        for table in tables.values()
        for row in table
        if not is_rejected(row) and row.get("object", "") not in spec.placebo
    ]
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
    sample_counts = [f"{size} ({n} grasp{'s' * (n != 1)})" for size, n in sizes]
    facts = {
        "recordings": f"{len(rows)}{rejections}",
        "objects": str(len({row["object"] for _, row in rows} - {""})),
        "grasps": str(len(grasps)),
        "samples per grasp": listed(sample_counts, _MAX_LISTED),
    }
    if references := len(all_rows) - len(rows):
        facts["references"] = str(references)
    for name, target in targets.items():
        cells = Counter(row.get(name, "") for row in used)
        missing = sum(cells.pop(text, 0) for text in _missing(target))
        values = [f"{text} {count}" for text, count in cells.most_common()]
        suffix = f"; {missing} missing" if missing else ""
        if target.kind == "regression":
            words = {text: count for text, count in cells.items() if not _is_value(text, target)}
            numbers = cells - Counter(words)
            values = [f"{numbers.total()} numbers, {len(numbers)} distinct"]
            suffix += f"; {sum(words.values())} not a number" if words else ""
        facts[f"recordings per {name}"] = listed(values, _MAX_LISTED) + suffix
    return facts


def cells_without_value(tables: Tables, spec: DatasetSpec) -> list[Finding]:
    """Return a warning for each target of numbers with cells that are not numbers.

    `bad_labels` returns one for each recording.
    """
    fix = "correct recordings.csv, or declare the text under `missing` of the target"
    rows = [(name, row) for name, table in tables.items() for row in table if not is_rejected(row)]
    findings = []
    for column, target in spec.targets.items():
        cells = [
            f"{row[column]!r} ({session}/{row['recording_id']})"
            for session, row in rows
            if not _is_value(row.get(column, ""), target)
        ]
        if cells:
            verb = "cell is not a number" if len(cells) == 1 else "cells are not numbers"
            problem = f"{len(cells)} {verb} in {column}: {listed(cells, _MAX_LISTED)}"
            findings.append(Finding(WHOLE, WHOLE, "", "warning", "bad_label", problem, fix))
    return findings


def _is_value(text: str, target: Target) -> bool:
    try:
        parse_label(text, target)
    except ValueError:
        return False
    return True


def _missing(target: Target | None) -> set[str]:
    return {"", *(target.missing if target else ())}
