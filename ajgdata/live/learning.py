"""Corrections become labels: what people say of a run's objects, entered into its session."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from ajgdata.acquire.live_session import REJECTED
from ajgdata.acquire.session_setup import recording_alone
from ajgdata.live.events import Event, read_events
from ajgdata.live.kept import LOOK, PREDICTED, SORT, VERDICT
from ajgdata.live.prediction import Verdict
from ajgdata.paths import AUDIO_FOLDER, RECORDINGS_FILE, Paths
from ajgdata.store.audio import file_sha256
from ajgdata.store.sessions import read_dataset, read_recordings, read_session, write_session
from ajgdata.types import DataError, DatasetSpec, Recording

#: Asked what an object was: (number of the sort, what was predicted) -> class, "" if not known.
Asked = Callable[[int, str], str]
#: Names of recordings of looks, without their ending: number and look.
_LOOK = re.compile(r"sort_([0-9]+)_([0-9]+)_1")


@dataclass(frozen=True)
class Learnt:
    """Recordings that were given a label, and those that are left without."""

    labelled: int
    unlabelled: int


def truths(events: Iterable[Event]) -> dict[int, str]:
    """Return the class of each object that somebody named, by its number; the last word counts."""
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


def learn_from(
    paths: Paths, run: str, ask: Asked, doubt: Callable[[str], object] = lambda _: None
) -> tuple[str, str, Learnt]:
    """Label the recordings of `run`: a log, a session's folder, or DATASET/SESSION.

    A class that has no bin is doubted, and asked for once more. Returns data set, session, and what
    was learnt. Raises DataError if there is no such run.
    """
    log, folder = _run_of(paths, run)
    dataset, session = folder.parent.parent.name, folder.name
    setup = getattr(read_session(folder).acquisition, "setup", {})
    if "sort" not in setup:
        fix = "name a session that `ajgdata sort` recorded"
        raise DataError(folder, "is no session of sorting", fix)
    spec = read_dataset(paths, dataset)
    known = truths(read_events(log)) if log.is_file() else {}
    target = str(setup["sort"]["target"])
    classes = sorted(setup["sort"].get("bins", {}))

    def asked(number: int, predicted: str) -> str:
        said, before = ask(number, predicted), predicted
        while said and said not in classes and said != before:
            doubt(f"{said!r} is none of the classes {', '.join(classes)}: again, to keep it")
            said, before = ask(number, said), said
        return said

    return dataset, session, learn(folder, spec, target, known, asked)


def learn(
    folder: Path,
    spec: DatasetSpec,
    target: str,
    known: Mapping[int, str],
    ask: Asked = lambda number, predicted: "",
) -> Learnt:
    """Label the recordings of the session at `folder` by what is `known` of its sorts, by number.

    What a killed run wrote and did not enter is entered now. Of sorts that are not `known` the cell
    of `target` counts, if somebody filled it in, else what `ask` returns (once a sort). What has a
    label is no longer rejected. A look in which nothing was held, among others of its sort in which
    something was, gets none but that of its own cell. Raises DataError while the run goes on.
    """
    with recording_alone(folder):
        rows, findings = read_recordings(folder)
        if findings:
            raise DataError(folder, findings[0].problem, findings[0].fix)
        rows += _lost(folder, rows)
        said = dict(known)
        in_order = sorted(rows, key=_order)
        held = {row.labels.get(SORT, "") for row in rows if not _is_nothing(row)}
        changed = [
            row
            if _is_nothing(row) and row.labels[SORT] in held and not _typed(row, target)
            else _labelled(row, spec, target, said, ask)
            for row in in_order
        ]
        session = read_session(folder)
        if session.acquisition is not None:
            finished = session.acquisition.model_copy(update={"finished": True})
            session = session.model_copy(update={"acquisition": finished})
        write_session(folder, session, sorted(changed, key=lambda row: row.recording_id))
    before = {row.recording_id: row for row in rows}
    new = sum(row != before[row.recording_id] for row in changed)
    left = sum(row.quality == REJECTED and bool(row.labels.get(SORT)) for row in changed)
    return Learnt(new, left)


def _labelled(
    row: Recording, spec: DatasetSpec, target: str, said: dict[int, str], ask: Asked
) -> Recording:
    number = row.labels.get(SORT, "")
    if not number.isdecimal():
        return row  # a reference
    typed = _typed(row, target)
    if int(number) not in said and not typed and row.quality == REJECTED:
        # of other verdicts what was predicted says nothing
        meant = row.labels.get(VERDICT) in (Verdict.KNOWN, Verdict.NOT_CHECKED)
        said[int(number)] = ask(int(number), row.labels.get(PREDICTED, "") if meant else "")
    value = typed if _is_nothing(row) and typed else said.get(int(number)) or typed
    if not value or (value == typed and row.quality != REJECTED):
        return row
    name = row.object if class_of(spec, target, row.object) == value else value
    labels = {key: str(one) for key, one in labels_of(spec, target, value, name).items()}
    if row.object and name != row.object:  # what was known belongs to another object
        labels = {key: "" for key in spec.targets if key in row.labels} | labels
    clipped = row.labels.get("clipped", "0") not in ("", "0")
    return row.model_copy(
        update={
            "object": name,
            "quality": "clipped" if clipped else "ok",
            "labels": {**row.labels, **labels},
        }
    )


def _typed(row: Recording, target: str) -> str:
    return row.object if target == "object" else row.labels.get(target, "")


def _is_nothing(row: Recording) -> bool:
    return row.labels.get(VERDICT) == Verdict.NOTHING


def _lost(folder: Path, rows: Iterable[Recording]) -> list[Recording]:
    """Return a row for each look that a killed run wrote and did not enter."""
    entered = {row.file for row in rows}
    found = []
    for path in sorted((folder / AUDIO_FOLDER).glob("sort_*_*_1.wav")):
        file, look = f"{AUDIO_FOLDER}/{path.name}", _LOOK.fullmatch(path.stem)
        if look and file not in entered:
            grasp = path.stem.removesuffix("_1")
            labels = {SORT: str(int(look[1])), LOOK: look[2]}
            row = Recording(
                recording_id=path.stem, file=file, sha256=file_sha256(path), grasp_id=grasp,
                quality=REJECTED, labels=labels,
            )  # fmt: skip
            found.append(row)
    return found


def _order(row: Recording) -> tuple[int, int]:
    number, look = row.labels.get(SORT, ""), row.labels.get(LOOK, "")
    return int(number) if number.isdecimal() else 0, int(look) if look.isdecimal() else 0


def _declared(spec: DatasetSpec) -> dict[str, dict[str, float | str]]:
    """Return the targets of every object that the recipe or the protocol lists."""
    given = (one.objects for one in (spec.recipe, spec.protocol) if one)
    return {made.name: dict(made.targets) for objects in given for made in objects}


def _run_of(paths: Paths, run: str) -> tuple[Path, Path]:
    """Return log and session of a run, however it is named."""
    path = Path(run)
    if path.is_file() and path.parent.parent.name == "live":
        dataset, session = path.parent.parent.parent.name, path.parent.name
    elif (path / RECORDINGS_FILE).is_file():
        path = path.absolute()
        dataset, session = path.parent.parent.name, path.name
    else:
        dataset, _, session = run.partition("/")
    folder = paths.session(dataset, session) if session else Path(run)
    if not (folder / RECORDINGS_FILE).is_file():
        fix = "name a log, the folder of a session, or DATASET/SESSION"
        raise DataError(run, "there is no such run", fix)
    return paths.events(dataset, session), folder
