"""Recordings, grasps and classes of a data set: their numbers, and what makes tasks impossible."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence

from ajgdata.acquire.protocol import REFERENCE
from ajgdata.paths import Paths
from ajgdata.store.findings import is_rejected
from ajgdata.store.session_audio import label_rows
from ajgdata.store.sessions import list_sessions, read_recordings, read_session
from ajgdata.types import DatasetSpec, Finding, Target

Row = Mapping[str, str]
CLASSES_NEEDED = 2
_SHOWN = 5


def listed(texts: Sequence[str]) -> str:
    """Return the first texts and the number of the remaining texts."""
    more = f" and {len(texts) - _SHOWN} more" if len(texts) > _SHOWN else ""
    return ", ".join(texts[:_SHOWN]) + more


def label_tables(paths: Paths, dataset: str) -> dict[str, list[dict[str, str]]]:
    """Return the label rows of each session of a data set."""
    folders = [paths.session(dataset, name) for name in list_sessions(paths, dataset)]
    return {f.name: label_rows(read_session(f), read_recordings(f)[0]) for f in folders}


def label_issues(tables: Mapping[str, Sequence[Row]], spec: DatasetSpec) -> list[Finding]:
    """Return a warning for grasps with two objects or target values, and for impossible tasks."""
    mixed_fix = "give each grasp of a session its own grasp_id"
    issues = [("mixed_grasp", problem, mixed_fix) for problem in _mixed_grasps(tables, spec)]
    class_fix = "record or import another class"
    issues += [("no_task", problem, class_fix) for problem in impossible_tasks(tables, spec)]
    return [Finding("*", "*", "", "warning", *issue) for issue in issues]


def _mixed_grasps(tables: Mapping[str, Sequence[Row]], spec: DatasetSpec) -> list[str]:
    problems = []
    for column in dict.fromkeys(("object", *spec.targets)):
        missing = _missing(spec.targets.get(column))
        values: dict[str, dict[str, None]] = defaultdict(dict)
        for session, rows in tables.items():
            for row in rows:
                if is_rejected(row):
                    continue
                if (text := row.get(column, "")) not in missing:
                    values[f"{session}/{row['grasp_id']}"][text] = None
        if mixed := {grasp: texts for grasp, texts in values.items() if len(texts) > 1}:
            shown = [f"{grasp} ({', '.join(texts)})" for grasp, texts in mixed.items()]
            noun = "object" if column == "object" else f"value of {column}"
            problems.append(
                f"{len(mixed)} of {len(values)} grasps have more than one {noun}: {listed(shown)}"
            )
    return problems


def impossible_tasks(tables: Mapping[str, Sequence[Row]], spec: DatasetSpec) -> list[str]:
    """Return a line for each task without two classes, or without a number."""
    rows = [row for table in tables.values() for row in table if not is_rejected(row)]
    problems = []
    for name, task in spec.tasks.items() if rows else ():
        target = spec.targets[task.target]
        there = Counter(row.get(task.target, "") for row in rows)
        values = [text for text in there if text not in _missing(target)]
        if task.classes:
            values = [text for text in values if text in task.classes]
        if not values:
            problems.append(f"task {name} is not possible: no recording has a {task.target}")
        elif target.kind == "classification" and len(values) < CLASSES_NEEDED:
            problems.append(f"task {name} is not possible: {values[0]!r} is its only class")
    return problems


def counts(tables: Mapping[str, Sequence[Row]], targets: Mapping[str, Target]) -> dict[str, str]:
    """Return the numbers of recordings, objects and grasps, and of recordings per class.

    Empty-gripper references are not grasps and are counted separately.
    """
    listed_rows = [(session, row) for session, table in tables.items() for row in table]
    rows = [(session, row) for session, row in listed_rows if not row.get(REFERENCE)]
    used = [row for _, row in rows if not is_rejected(row)]
    grasps = Counter((session, row["grasp_id"]) for session, row in rows)
    sizes = Counter(grasps.values())
    rejected = f" ({len(rows) - len(used)} rejected)" if len(used) < len(rows) else ""
    facts = {
        "recordings": f"{len(rows)}{rejected}",
        "objects": str(len({row["object"] for _, row in rows} - {""})),
        "grasps": str(len(grasps)),
        "samples per grasp": listed(
            [f"{size} ({n} grasp{'s' * (n != 1)})" for size, n in sorted(sizes.items())]
        ),
    }
    if references := len(listed_rows) - len(rows):
        facts["references"] = str(references)
    for name, target in targets.items():
        cells = Counter(row.get(name, "") for row in used)
        missing = sum(cells.pop(text, 0) for text in _missing(target))
        values = [f"{text} {count}" for text, count in cells.most_common()]
        if target.kind == "regression":
            values = [f"{cells.total()} numbers, {len(cells)} distinct"]
        suffix = f"; {missing} missing" if missing else ""
        facts[f"recordings per {name}"] = listed(values) + suffix
    return facts


def _missing(target: Target | None) -> set[str]:
    return {"", *(target.missing if target else ())}
