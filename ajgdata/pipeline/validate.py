"""`ajgdata validate`: every check on every recording, without changing anything."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ajgdata.paths import Paths
from ajgdata.pipeline.declare import common_audio
from ajgdata.pipeline.recordings import (
    examine,
    finding,
    in_threads,
    late_or_early,
    read_excitation,
)
from ajgdata.store.labels import copies, label_problem
from ajgdata.store.manifest import HashCache, survey
from ajgdata.store.scan import AUDIO_SUFFIXES
from ajgdata.store.sessions import list_datasets, list_sessions, read_dataset
from ajgdata.types import AudioSettings, Finding

Started = Callable[[int], Callable[[], object]]


def validate_datasets(
    project: Callable[[], Paths], names: Sequence[str], started: Started
) -> tuple[int, list[Finding]]:
    """Number of recordings checked and everything found in data sets or folders `names`.

    `project` finds the project; it is asked only when a data set is to be checked. A name that is
    no data set but a folder is checked as a plain folder of audio files.
    """
    folders = [Path(n) for n in names if Path(n).is_dir() and not _is_dataset(project, n)]
    count = 0
    told: list[Finding] = []
    for folder in folders:
        checked, found = validate_folder(folder, started)
        count, told = count + checked, told + found
    chosen = [n for n in names if Path(n) not in folders]
    if chosen or not names:
        paths = project()
        for name in chosen or list_datasets(paths):
            checked, found = validate_dataset(paths, name, started)
            count, told = count + checked, told + found
    return count, told


def validate_dataset(paths: Paths, name: str, started: Started) -> tuple[int, list[Finding]]:
    """Every session of a data set: files, samples, delays, labels, copies."""
    spec = read_dataset(paths, name)
    cache = HashCache(paths.hash_cache)
    surveys = [survey(paths, name, session, cache) for session in list_sessions(paths, name)]
    advance = started(sum(len(manifest["recordings"]) for manifest, _ in surveys))
    told: list[Finding] = []
    rows: list[tuple[str, str, tuple[str, ...]]] = []
    for manifest, labels in surveys:
        session = manifest["session_id"]
        told += [Finding(**found) for found in manifest["findings"]]
        told += _check_session(paths.root, manifest, spec.audio, spec.features.window, advance)
        table = {row["recording_id"]: row for row in labels}
        for row in labels:
            if row["quality"] != "reject" and (problem := label_problem(row, spec.targets)):
                fix = "correct recordings.csv, or declare the text under `missing` of the target"
                told.append(
                    Finding(session, row["recording_id"], "", "error", "bad_label", problem, fix)
                )
        for entry in manifest["recordings"]:
            row = table[entry["recording_id"]]
            label = tuple(row.get(target, "") for target in spec.targets)
            rows.append((f"{session}/{entry['recording_id']}", entry["sha256"], label))
    if rows:
        told += copies(*zip(*rows, strict=True)).values()
    return len(rows), sorted(told)


def validate_folder(folder: Path, started: Started) -> tuple[int, list[Finding]]:
    """Every audio file below a plain folder, against the commonest rate among them."""
    files = sorted(p for p in folder.rglob("*") if p.suffix.lower() in AUDIO_SUFFIXES)
    cache = HashCache(folder / ".never-saved")
    entries = [
        {
            "recording_id": str(p.relative_to(folder)),
            "path": str(p.absolute()),
            "sha256": cache.sha256(p),
        }
        for p in files
    ]
    manifest = {"session_id": folder.name, "excitation": None, "recordings": entries}
    audio = common_audio(files)
    told = _check_session(Path(), manifest, audio, 2048, started(len(files)))
    digests = [entry["sha256"] for entry in entries]
    labels = [(str(path.parent),) for path in files]
    names = [f"{folder.name}/{entry['recording_id']}" for entry in entries]
    return len(files), sorted([*told, *copies(names, digests, labels).values()])


def _check_session(
    root: Path,
    manifest: dict[str, Any],
    audio: AudioSettings,
    window: int,
    advance: Callable[[], object],
) -> list[Finding]:
    excitation, told = read_excitation(root, manifest, audio)
    session, entries = manifest["session_id"], manifest["recordings"]
    delays: dict[str, int] = {}
    results = in_threads(
        lambda e: examine(root / e["path"], audio, window, excitation), entries, os.cpu_count() or 1
    )
    for entry, found in zip(entries, results, strict=True):
        name = entry["recording_id"]
        told += [finding(session, name, entry["path"], remark) for remark in found.remarks]
        if found.delay is not None:
            delays[name] = found.delay
        advance()
    return told + late_or_early(session, list(delays), list(delays.values()), audio.sample_rate_hz)


def _is_dataset(project: Callable[[], Paths], name: str) -> bool:
    try:
        return name in list_datasets(project())
    except FileNotFoundError:
        return False
