"""Issues of labels: grasps, samples, classes, tasks and placements of all sessions together."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence

from ajgdata.evaluate.design import recording_design
from ajgdata.paths import Paths
from ajgdata.pipeline.similar_classes import similar_classes
from ajgdata.store.counters import grasp_key
from ajgdata.store.findings import is_rejected
from ajgdata.store.labels import parse_label
from ajgdata.store.listing import listed
from ajgdata.store.session_audio import label_rows
from ajgdata.store.sessions import list_sessions, read_recordings, read_session
from ajgdata.types import WHOLE, DatasetSpec, Finding, Target

#: Rows of labels by session.
Tables = Mapping[str, Sequence[Mapping[str, str]]]
CLASSES_NEEDED = 2
#: Column that groups recordings if a task names no other.
DEFAULT_GROUPS = "grasp_id"
#: Number of texts that an issue or a line of counts lists.
MAX_LISTED = 5
#: Fixes of `label_issues` by code.
FIXES = {
    "mixed_grasp": "give each grasp of a session its own grasp_id",
    "repeated_sample": "correct the numbers, or import with a --grasp that separates them",
    "grasp_spelling": "give both the same grasp_id in recordings.csv",
    "similar_classes": "write each class in one way in the table or recordings.csv; "
    "--on-change labels takes the texts of the table",
    "no_task": "record or import another class",
}


def label_tables(paths: Paths, dataset: str) -> dict[str, list[dict[str, str]]]:
    """Return the label rows of each session of a data set."""
    folders = [paths.session(dataset, name) for name in list_sessions(paths, dataset)]
    return {f.name: label_rows(read_session(f), read_recordings(f)[0]) for f in folders}


def label_issues(tables: Tables, spec: DatasetSpec) -> list[Finding]:
    """Return the warnings on labels of all sessions together.

    They are on grasps with two objects or target values, on several recordings of a grasp with one
    sample number, on grasps and classes that differ only in spelling, and on impossible tasks.
    """
    targets = spec.label_targets
    columns = dict.fromkeys(("object", *targets))
    problems = {
        "mixed_grasp": [_mixed_grasps(tables, name, targets.get(name)) for name in columns],
        "repeated_sample": [_repeated_samples(tables)],
        "grasp_spelling": [_grasp_spellings(tables)],
        "similar_classes": _similar_classes(tables, spec),
        "no_task": impossible_tasks(tables, spec),
    }
    return [
        Finding(WHOLE, WHOLE, "", "warning", code, problem, FIXES[code])
        for code, lines in problems.items()
        for problem in lines
        if problem
    ]


def _mixed_grasps(tables: Tables, column: str, target: Target | None) -> str:
    """Return a line on grasps with several values of a column; "" if there are none."""
    missing = missing_texts(target)
    values: dict[str, dict[str, None]] = defaultdict(dict)
    for session, rows in tables.items():
        for row in rows:
            text = row.get(column, "")
            if not is_rejected(row) and text not in missing:
                values[f"{session}/{row['grasp_id']}"][text] = None
    mixed = [f"{grasp} ({', '.join(texts)})" for grasp, texts in values.items() if len(texts) > 1]
    if not mixed:
        return ""
    noun = "object" if column == "object" else f"value of {column}"
    counted = f"{len(mixed)} of {len(values)} grasps have more than one {noun}"
    return f"{counted}: {listed(mixed, MAX_LISTED)}"


def _repeated_samples(tables: Tables) -> str:
    """Return a line on recordings with equal grasp and sample number; "" if there are none.

    If all recordings of a grasp have sample 0, its samples are not numbered.
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
    if not repeated:
        return ""
    counted = f"{len(repeated)} pairs of grasp and sample have several recordings"
    return f"{counted}: {listed(repeated, MAX_LISTED)}"


def _grasp_spellings(tables: Tables) -> str:
    """Return a line on grasps of a session that differ only in the spelling of a number.

    A recording without a grasp has its recording_id as grasp_id; it is not compared. Returns "" if
    no grasp has two spellings.
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
    return f"{counted}: {listed(several, MAX_LISTED)}"


def _similar_classes(tables: Tables, spec: DatasetSpec) -> list[str]:
    """Return a line for each target with classes that differ only in spelling.

    Objects are also classes. If they have the same spellings as a target, they have no own line.
    """
    rows = [row for table in tables.values() for row in table if not is_rejected(row)]
    classes = [name for name, target in spec.targets.items() if target.kind == "classification"]
    problems: dict[str, str] = {}
    for column in dict.fromkeys((*classes, "object")):
        counted = Counter(row.get(column, "") for row in rows)
        for text in missing_texts(spec.targets.get(column)):
            del counted[text]
        groups = [
            "; ".join(f"{name!r} {count}" for name, count in group.items())
            for group in similar_classes(counted)
        ]
        if groups:
            noun = "objects" if column == "object" else f"classes of {column}"
            spellings = ", and ".join(groups)
            problems.setdefault(spellings, f"{noun} differ only in spelling: {spellings}")
    return list(problems.values())


def impossible_tasks(tables: Tables, spec: DatasetSpec) -> list[str]:
    """Return a line for each task without two classes, or without a number.

    A data set without recordings has no lines.
    """
    rows = [
        row
        for table in tables.values()
        for row in table
        if not is_rejected(row) and row.get("object", "") not in spec.placebo
    ]
    if not rows:
        return []
    problems = []
    for name, task in spec.tasks.items():
        target = spec.targets[task.target]
        column = target.columns[0] if target.columns else task.target
        values = {row.get(column, "") for row in rows} - missing_texts(target)
        if task.classes:
            values &= set(task.classes)
        if not values:
            problems.append(f"task {name} is not possible: no recording has a {column}")
        elif target.kind == "classification" and len(values) < CLASSES_NEEDED:
            problems.append(f"task {name} is not possible: {values.pop()!r} is its only class")
    return problems


def placebo_issues(tables: Tables, spec: DatasetSpec) -> list[Finding]:
    """Return a warning if no recording has an object of `placebo`: it is then not measured.

    A data set without recordings has no warning.
    """
    objects = {row.get("object", "") for table in tables.values() for row in table}
    absent = [name for name in spec.placebo if name not in objects]
    if not absent or not objects:
        return []
    problem = f"placebo: no recording has the object {listed(absent, MAX_LISTED)}"
    fix = "correct the names in dataset.yaml, or record them: until then the placebo has no score"
    return [Finding(WHOLE, WHOLE, "", "warning", "placebo", problem, fix)]


def placement_notes(tables: Tables, spec: DatasetSpec) -> list[Finding]:
    """Return a note for each classification whose classes and placements cannot be distinguished.

    Tasks that hold out sessions, or groups of a label, have no note.
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
            if row.get(task.target, "") not in missing_texts(target)
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


def cells_without_value(tables: Tables, spec: DatasetSpec) -> list[Finding]:
    """Return a warning for each target of numbers with cells that are not numbers.

    In contrast, `bad_labels` returns a warning for each recording.
    """
    fix = "correct recordings.csv, or declare the text under `missing` of the target"
    rows = [(name, row) for name, table in tables.items() for row in table if not is_rejected(row)]
    findings = []
    for column, target in spec.label_targets.items():
        cells = [
            f"{row[column]!r} ({session}/{row['recording_id']})"
            for session, row in rows
            if not is_value(row.get(column, ""), target)
        ]
        if cells:
            verb = "cell is not a number" if len(cells) == 1 else "cells are not numbers"
            problem = f"{len(cells)} {verb} in {column}: {listed(cells, MAX_LISTED)}"
            findings.append(Finding(WHOLE, WHOLE, "", "warning", "bad_label", problem, fix))
    return findings


def is_value(text: str, target: Target) -> bool:
    """Return whether a cell is a value of a target, or missing."""
    try:
        parse_label(text, target)
    except ValueError:
        return False
    return True


def missing_texts(target: Target | None) -> set[str]:
    """Return the texts of missing values in the column of a target, or in another column."""
    return {"", *(target.missing if target else ())}
