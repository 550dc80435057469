"""`ajgdata info`: a description of a data set, and how much of it there is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from ajgdata.paths import Paths
from ajgdata.pipeline.label_counts import counts, label_tables
from ajgdata.pipeline.plan import recorded_sessions
from ajgdata.store.features import read_labels
from ajgdata.store.files import bytes_below
from ajgdata.store.findings import read_findings
from ajgdata.store.sessions import read_dataset, read_recordings, read_session
from ajgdata.types import DatasetSpec, Session


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
        **counts(label_tables(paths, dataset), spec.targets),
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


def _features(paths: Paths, spec: DatasetSpec) -> dict[str, str]:
    store = paths.features(spec.name)
    if not store.is_file():
        return {"features": f"not made yet; `ajgdata run {spec.name}` makes them"}
    shard = read_labels(store)
    rows, bins = len(shard.feature), len(shard.frequency_hz)
    low, high = shard.frequency_hz[[0, -1]]
    version, commit = shard.attrs["ajgdata_version"], shard.attrs["git_commit"] or "unknown"
    size = _mb(store.stat().st_size)
    facts = {
        "features": f"{rows} rows of {bins} values, {low:g} to {high:g} Hz, {size}; "
        f"ajgdata {version}, commit {commit}"
    }
    if paths.quarantine(spec.name).is_file():
        found = read_findings(paths.quarantine(spec.name))
        kinds = Counter(one.code for one in found).most_common()
        facts["quarantine"] = ", ".join(f"{count} {code}" for code, count in kinds) or "nothing"
    return facts
