"""Corrections become labels of the recordings of a run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from ajgdata.acquire.live_session import REJECTED
from ajgdata.acquire.writer import recording_alone
from ajgdata.live.events import Event, read_events
from ajgdata.live.kept import SORT, VERDICT
from ajgdata.live.predictor import Verdict
from ajgdata.paths import RECORDINGS_FILE, Paths
from ajgdata.store.sessions import read_dataset, read_recordings, read_session, write_session
from ajgdata.types import DataError, DatasetSpec, Recording


@dataclass(frozen=True)
class Learnt:
    """Recordings that were given a label, and those that are left without."""

    labelled: int
    unlabelled: int


def truths(events: Iterable[Event]) -> dict[int, str]:
    """Return the class of each object that somebody named, by its number; the last one counts."""
    return {one["number"]: one["object"] for one in events if one["event"] == "truth"}


def class_of(spec: DatasetSpec, target: str, name: str) -> str | None:
    """Return the class of the object `name` by the recipe or the protocol; None if they do not
    say."""
    if target == "object":
        return name
    value = _declared(spec).get(name, {}).get(target)
    return None if value is None else str(value)


def labels_of(spec: DatasetSpec, target: str, value: str, name: str = "") -> dict[str, float | str]:
    """Return the targets of an object of the class `value`: all of them if it, or its `name`, is
    declared."""
    declared = _declared(spec).get(name or value, {})
    known = {**declared, target: value}
    return {key: known[key] for key in sorted(known) if key != "object"}  # has its own column


def learn_from(paths: Paths, run: str) -> tuple[str, str, Learnt]:
    """Label the recordings of the session `run`, DATASET/SESSION, by the corrections in its log.

    Returns data set, session and result. Raises DataError if there is no such run.
    """
    dataset, _, session = run.partition("/")
    if not session or not (paths.session(dataset, session) / RECORDINGS_FILE).is_file():
        raise DataError(run, "there is no such run", "name DATASET/SESSION")
    folder = paths.session(dataset, session)
    setup = getattr(read_session(folder).acquisition, "setup", {})
    if "sort" not in setup:
        fix = "name a session that `ajgdata sort` recorded"
        raise DataError(folder, "is no session of sorting", fix)
    log = paths.events(dataset, session)
    known = truths(read_events(log)) if log.is_file() else {}
    spec = read_dataset(paths, dataset)
    return dataset, session, learn(folder, spec, str(setup["sort"]["target"]), known)


def learn(folder: Path, spec: DatasetSpec, target: str, known: Mapping[int, str]) -> Learnt:
    """Label the recordings of the session at `folder` by what is `known` of its objects, by number.

    For other objects the cell of `target` counts, if somebody filled it in. Labelled recordings are
    no longer rejected. If one look at an object held nothing and another look did not, only its own
    cell labels it. Raises DataError while the run goes on.
    """
    with recording_alone(folder):
        rows, findings = read_recordings(folder)
        if findings:
            raise DataError(folder, findings[0].problem, findings[0].fix)
        held = {row.labels.get(SORT, "") for row in rows if not _is_nothing(row)}
        changed = []
        for row in rows:
            number = row.labels.get(SORT, "")
            cell = row.object if target == "object" else row.labels.get(target, "")
            value = cell
            if number.isdecimal() and not (_is_nothing(row) and (cell or number in held)):
                value = known.get(int(number)) or cell
            is_new = value and (value != cell or row.quality == REJECTED)
            changed.append(_labelled(row, spec, target, value) if number and is_new else row)
        session = read_session(folder)
        if session.acquisition is not None:
            finished = session.acquisition.model_copy(update={"finished": True})
            session = session.model_copy(update={"acquisition": finished})
        write_session(folder, session, changed)
    new = sum(after != before for after, before in zip(changed, rows, strict=True))
    left = sum(row.quality == REJECTED and bool(row.labels.get(SORT)) for row in changed)
    return Learnt(new, left)


def _labelled(row: Recording, spec: DatasetSpec, target: str, value: str) -> Recording:
    """Return the row of a recording of an object of the class `value`."""
    name = row.object if class_of(spec, target, row.object) == value else value
    labels = {key: str(one) for key, one in labels_of(spec, target, value, name).items()}
    if row.object and name != row.object:  # labels of another object
        labels = {key: "" for key in spec.targets if key in row.labels} | labels
    clipped = row.labels.get("clipped", "0") not in ("", "0")
    quality = ("clipped" if clipped else "ok") if row.quality == REJECTED else row.quality
    changes = {"object": name, "quality": quality, "labels": {**row.labels, **labels}}
    return row.model_copy(update=changes)


def _is_nothing(row: Recording) -> bool:
    return row.labels.get(VERDICT) == Verdict.NOTHING


def _declared(spec: DatasetSpec) -> dict[str, dict[str, float | str]]:
    """Return the targets of every object that the recipe or the protocol lists."""
    given = (one.objects for one in (spec.recipe, spec.protocol) if one)
    return {made.name: dict(made.targets) for objects in given for made in objects}
