"""`ajgdata info`: a description of a data set, and how much of it there is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from ajgdata.acquire.protocol import REFERENCE
from ajgdata.paths import Paths
from ajgdata.pipeline.plan import recorded_sessions
from ajgdata.store.features import Column, read_labels
from ajgdata.store.files import bytes_below
from ajgdata.store.findings import read_findings
from ajgdata.store.sessions import read_dataset, read_recordings, read_session
from ajgdata.types import DatasetSpec, Recording, Session

MAX_CLASSES = 8  # that are named


def dataset_facts(paths: Paths, dataset: str) -> dict[str, str]:
    """Return what is known of a data set, by topic. Raises DataError for what cannot be read."""
    spec = read_dataset(paths, dataset)
    folders = [paths.session(dataset, name) for name in recorded_sessions(paths, spec)]
    held = [(read_session(folder), read_recordings(folder)[0]) for folder in folders]
    facts = {
        "title": spec.title or dataset,
        "description": spec.description,
        "licence": spec.licence,
        "source": _source([session for session, _ in held], spec),
        "recordings": _counts(held),
    }
    for session, recordings in held:
        facts[f"session {session.session_id}"] = (
            f"{len(recordings)} recordings, gripper {session.gripper}, medium {session.medium}, "
            f"{session.device}"
            + (f"; {session.notes}" if session.notes else "")
            + _acquired(session)
        )
    facts |= _features(paths, spec)
    for name, task in spec.tasks.items():
        split = f"{task.folds} folds by {task.groups}"
        facts[f"task {name}"] = f"{task.target}, {split}; {', '.join(task.models)}"
    raw, made = bytes_below(paths.sessions(dataset)), paths.results_of(dataset)
    facts["disk"] = f"recordings {_mb(raw)}, results {_mb(sum(map(bytes_below, made)))}"
    return {topic: said for topic, said in facts.items() if said}


def _acquired(session: Session) -> str:
    """Return what is to be known of a session with a real gripper; "" of others."""
    made = session.acquisition
    if made is None:
        return ""
    said = ", ".join(f"{key} {value}" for key, value in made.driver.items() if value)
    state = "" if made.finished else "; is being recorded, or its acquisition crashed"
    return (f"; {said}" if said else "") + state


def _mb(size: int) -> str:
    return f"{size / 1e6:.1f} MB"


def _source(sessions: Sequence[Session], spec: DatasetSpec) -> str:
    if not sessions:
        made = f"`ajgdata import FOLDER --dataset {spec.name}`"
        if spec.recipe:
            made = "`ajgdata acquire`"
        elif spec.protocol:
            made = f"`ajgdata acquire {spec.name} --source soundcard`"
        return f"nothing recorded yet; {made} does"
    simulated = any(session.source == "virtual" for session in sessions)
    return "simulated by the virtual gripper" if simulated else "recorded"


def _counts(held: Sequence[tuple[Session, Sequence[Recording]]]) -> str:
    rows = [(session.session_id, one) for session, recordings in held for one in recordings]
    held_nothing = [one for _, one in rows if one.labels.get(REFERENCE)]
    grasps = {(session, one.grasp_id) for session, one in rows if not one.labels.get(REFERENCE)}
    objects = {one.object for _, one in rows} - {""}
    rejected = sum(one.quality.lower() == "reject" for _, one in rows)
    unsealed = sum(not one.sha256 for _, one in rows)
    taken = len(rows) - len(held_nothing)
    said = f"{taken} of {len(grasps)} grasps of {len(objects)} objects in {len(held)} sessions"
    said += f"; {len(held_nothing)} references" if held_nothing else ""
    said += f"; {rejected} rejected" if rejected else ""
    return said + (f"; {unsealed} not sealed" if unsealed else "")


def _features(paths: Paths, spec: DatasetSpec) -> dict[str, str]:
    store = paths.features(spec.name)
    if not store.is_file():
        declared = {f"target {n}": f"{t.kind} {t.unit}".strip() for n, t in spec.targets.items()}
        return {**declared, "features": f"not made yet; `ajgdata run {spec.name}` makes them"}
    shard = read_labels(store)
    rows, bins = len(shard.feature), len(shard.frequency_hz)
    low, high = shard.frequency_hz[[0, -1]]
    facts = {
        f"target {name}": _values(shard.columns[name], target.unit)
        for name, target in spec.targets.items()
        if name in shard.columns
    }
    facts["features"] = (
        f"{rows} rows of {bins} values, {low:g} to {high:g} Hz, {_mb(store.stat().st_size)}; "
        f"ajgdata {shard.attrs['ajgdata_version']}, commit {shard.attrs['git_commit'] or 'unknown'}"
    )
    if paths.quarantine(spec.name).is_file():
        found = read_findings(paths.quarantine(spec.name))
        kinds = Counter(one.code for one in found).most_common()
        facts["quarantine"] = ", ".join(f"{count} {code}" for code, count in kinds) or "nothing"
    return facts


def _values(column: Column, unit: str) -> str:
    """Return the range of numbers, or the recordings of each class, and how many have no value."""
    if column.values.dtype.kind == "f":
        there = column.values[np.isfinite(column.values)]
        if not len(there):
            return "regression, no recording has a value"
        distinct = len(np.unique(there))
        ends = f"{there.min():g} to {there.max():g} {unit}".strip()
        said = f"regression, {ends}, {distinct} distinct values"
    else:
        counts = Counter(column.values[column.values != ""].tolist())
        named = ", ".join(f"{name} {n}" for name, n in counts.most_common(MAX_CLASSES))
        more = f" and {len(counts) - MAX_CLASSES} more" if len(counts) > MAX_CLASSES else ""
        said = f"classification, {len(counts)} classes: {named}{more}"
        there = column.values[column.values != ""]
    missing = len(column.values) - len(there)
    return said + (f"; {missing} missing" if missing else "")
