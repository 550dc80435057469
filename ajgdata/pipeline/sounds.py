"""Recordings of a data set -> a few of them beside its report, chosen by a rule, to compare.

What is heard is what was measured: the recording's own bytes, or nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ajgdata.paths import Paths
from ajgdata.report.format import value, with_unit, words
from ajgdata.report.sounds import Sound, SoundPair, SoundPairs, apart
from ajgdata.store.audio import inspect_audio
from ajgdata.store.features import Shard
from ajgdata.store.files import sha256_of, write_bytes
from ajgdata.store.sessions import recording_paths
from ajgdata.types import RECORDING_COLUMNS, STORE_NAMES, DataError, DatasetSpec, Kind

#: Suffix by container, which is how a browser knows them; every one plays these.
SUFFIXES = {"FLAC": ".flac", "OGG": ".ogg"}
GRASPS, VALUES = "grasps", "values"
RULES: dict[Kind, str] = {
    "classification": (
        "Chosen by a rule: of the first class by alphabet of which one object was grasped twice, "
        "the first recording of each of its first two grasps; then the class whose mean spectrum "
        "is the nearest to its own, so the one to mistake it for: the first recording, of the same "
        "session and object if there is one."
    ),
    "regression": (
        "Chosen by a rule: of the smallest value at which one object was grasped twice, the first "
        "recording of each of its first two grasps; then the largest value: the first recording, "
        "of the same session and object if there is one."
    ),
}


class Rows(NamedTuple):
    """Recordings in the order of their names: name, target, object, session and grasp, each (n,),
    and feature (n, f)."""

    name: np.ndarray
    target: np.ndarray
    thing: np.ndarray
    session: np.ndarray
    grasp: np.ndarray
    feature: np.ndarray


def sounds_of(
    paths: Paths, spec: DatasetSpec, store: Shard, folder: Path, task: str = ""
) -> SoundPairs:
    """Copy the sounds of a task (default: the first) into `folder`, and return them in pairs.

    A pair is left out if a recording of it is gone, or is no longer what was measured, and if the
    data set has none that fits.
    """
    named = [task] if task else [*spec.tasks, *spec.embeddings]
    if not named:
        return SoundPairs("", ())
    settings = spec.task_settings(named[0])
    target, kind = settings["target"], settings["kind"]
    classes = settings.get("classes", ())
    places = _places(store, target, kind, classes)
    rows = _rows(store, target, places)
    chosen = chosen_pairs(rows, kind)
    used = sorted({i for pair in chosen.values() for i in pair})
    files = {i: _copied(paths, spec.name, store, int(places[i]), folder) for i in used}
    sounds = {
        i: Sound(
            recording=str(rows.name[i]),
            label=with_unit(words(value(rows.target[i].item())), settings["unit"]),
            file=files[i],
            facts=_facts(store, int(places[i]), target),
            spectrum=rows.feature[i],
        )
        for i in used
    }
    pairs = tuple(
        SoundPair(
            name=f"sounds--{spec.name}-{named[0] if classes else target}-{key}",
            by_grasp=key == GRASPS,
            target=words(target),
            first=sounds[a],
            second=sounds[b],
            source="simulated" if store.attrs["source"] == "simulated" else "recorded",
            frequency_hz=store.frequency_hz,
            peak=max(float(one.spectrum.max()) for one in sounds.values()),
            is_power=spec.features.quantity == "power",
        )
        for key, (a, b) in chosen.items()
        if files[a] and files[b]
    )
    return SoundPairs(RULES[kind], pairs)


def chosen_pairs(rows: Rows, kind: Kind) -> dict[str, tuple[int, int]]:
    """Return the pairs that RULES name, as places in `rows`, by what differs in them."""
    values = np.unique(rows.target)  # sorted
    if not len(values):
        return {}
    twice = next(filter(None, (_two_grasps(rows, rows.target == one) for one in values)), None)
    first = twice[0] if twice else int(np.flatnonzero(rows.target == values[0])[0])
    pairs = {GRASPS: twice} if twice else {}
    others = values[values != rows.target[first]]
    if not len(others):
        return pairs
    other = others[-1] if kind == "regression" else _nearest(rows, rows.target[first], others)

    def likeness(i: int) -> tuple[bool, bool, int]:
        same = rows.session[i] == rows.session[first], rows.thing[i] == rows.thing[first]
        return not same[0], not same[1], i

    second = min(map(int, np.flatnonzero(rows.target == other)), key=likeness)
    return {**pairs, VALUES: (first, second)}


def _two_grasps(rows: Rows, among: np.ndarray) -> tuple[int, int] | None:
    """Return the first recordings of the first two grasps of one object, if there are two."""
    firsts: dict[str, dict[tuple[str, str], int]] = {}
    for i in map(int, np.flatnonzero(among)):
        grasps = firsts.setdefault(str(rows.thing[i]), {})
        grasps.setdefault((str(rows.session[i]), str(rows.grasp[i])), i)
    for grasps in firsts.values():
        if len(grasps) > 1:
            first, second, *_ = grasps.values()
            return first, second
    return None


def _nearest(rows: Rows, one: str, others: np.ndarray) -> str:
    def mean(given: str) -> np.ndarray:
        return rows.feature[rows.target == given].mean(axis=0, dtype=float)

    return min(map(str, others), key=lambda other: (apart(mean(one), mean(other)), other))


def _places(store: Shard, target: str, kind: Kind, classes: Sequence[str]) -> np.ndarray:
    """Return the rows of the store whose target is known, in the order of their names; of `classes`
    alone, if there are any."""
    if target not in store.columns or not len(store.feature):
        return np.empty(0, int)
    values = store.columns[target].values
    known = np.isfinite(values) if kind == "regression" else values != ""
    known &= np.isin(values, classes) if classes else True
    order = np.argsort(store.columns["recording"].values, kind="stable")
    return order[known[order]]


def _rows(store: Shard, target: str, places: np.ndarray) -> Rows:
    names = ("recording", target, "object", "session_id", "grasp_id")
    missing = np.zeros(len(store.feature), str)
    columns = (store.columns[n].values if n in store.columns else missing for n in names)
    name, known, thing, session, grasp = (column[places] for column in columns)
    in_order = np.array_equal(places, np.arange(len(store.feature)))  # mostly: no copy of them all
    feature = store.feature if in_order else store.feature[places]
    return Rows(name, known, thing, session, grasp, feature)


def _facts(store: Shard, row: int, target: str) -> tuple[tuple[str, str], ...]:
    """Return what else is known of a recording: its object, gripper, medium, and every label."""
    technical = {*RECORDING_COLUMNS, *STORE_NAMES, "source", "setup_sha256", target} - {"object"}
    known = {
        words(name): _shown(column.values[row].item())
        for name, column in store.columns.items()
        if name not in technical
    }
    return tuple((name, text) for name, text in known.items() if text not in ("", "unknown"))


def _shown(given: str | float) -> str:
    """Return a label for people; a fraction that stands in a column of text is a number too."""
    with suppress(ValueError):
        given = float(given) if "." in str(given) else given
    if isinstance(given, str):
        return words(given)
    return value(given) if np.isfinite(given) else ""


def _copied(paths: Paths, dataset: str, store: Shard, row: int, folder: Path) -> str:
    """Copy a recording, byte for byte, and return its name in `folder`; none if it is gone."""
    session, _, recording = str(store.columns["recording"].values[row]).partition("/")
    digest = str(store.columns["sha256"].values[row])
    try:
        path = recording_paths(paths.session(dataset, session))[recording]
        suffix = SUFFIXES.get(inspect_audio(path).format, ".wav")
        sound = path.read_bytes()
    except (DataError, LookupError, OSError):
        return ""
    if sha256_of(sound) != digest:
        return ""
    name = f"{dataset}--{digest[:16]}{suffix}"
    write_bytes(folder / name, sound)
    return name
