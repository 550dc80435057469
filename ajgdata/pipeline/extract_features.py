"""Recordings of a session -> its shard of features; only what changed is computed."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ajgdata.features.align import shift
from ajgdata.features.maker import feature_maker
from ajgdata.features.spectrum import frequencies_hz
from ajgdata.pipeline.recordings import (
    OTHER_DELAY,
    Examined,
    examine,
    finding,
    late_or_early,
    read_excitation,
)
from ajgdata.store.features import (
    Column,
    Shard,
    read_store,
    text_column,
    write_store,
)
from ajgdata.store.files import csv_bytes, write_bytes
from ajgdata.store.findings import read_findings, write_findings
from ajgdata.store.provenance import settings_digest, software
from ajgdata.store.session_audio import (
    WHOLE_SESSION,
    AudioFile,
    check_session,
    label_columns,
)
from ajgdata.types import (
    AudioSettings,
    DataError,
    FeatureSettings,
    Finding,
    NotPossibleError,
    Strict,
)

SETTINGS_ATTRIBUTE = "settings_digest"


@dataclass(frozen=True)
class Row:
    """One recording's part of a shard."""

    feature: np.ndarray
    delay: float
    remarks: tuple[Finding, ...]


class _Reference(Strict):
    """Return what a feature depends on besides its recording and the settings."""

    code: str
    excitation: str


def extract_features(
    *,
    folder: Path,
    audio: AudioSettings,
    features: FeatureSettings,
    code: str,
    shard: Path,
    findings: Path,
    labels: Path,
) -> tuple[int, int]:
    """Write `shard`, `findings` and `labels` of the session in `folder`.

    Returns how many features were computed and how many reused. Rows of the `shard` that is there
    are reused while recording_id, sha256, settings, excitation and `code` are the same. A recording
    that cannot be used becomes a finding and has no row; so do all of a session without the played
    sound, if features need it.
    """
    session = check_session(folder)
    issues, entries = session.findings, session.files
    excitation, played = None, ""
    if features.needs_excitation:
        excitation, more = read_excitation(session.session_id, session.played, audio)
        issues += more
        if excitation is None or session.played is None:
            issues.append(_unknown_sound(session.session_id, features))
            entries = []
        else:
            played = session.played.sha256
    digest = settings_digest(audio, features, _Reference(code=code, excitation=played))
    known = _known_rows(shard, findings, digest)

    new = [e for e in entries if (e.recording_id, e.sha256) not in known]
    try:
        results = _made(session.session_id, new, audio, features, excitation)
    except NotPossibleError as error:
        issues.append(_unfit_sound(session.session_id, features, str(error)))
        entries, new, results = [], [], {}
    rows: dict[str, Row] = {}
    for entry in entries:
        row = results.get(entry.recording_id, known.get((entry.recording_id, entry.sha256)))
        if isinstance(row, Row):
            rows[entry.recording_id] = row
            issues += row.remarks
        else:
            issues += row or []
    if features.align:
        delays = [int(row.delay) for row in rows.values()]
        issues += late_or_early(session.session_id, list(rows), delays, audio.sample_rate_hz)
    _write(shard, entries, rows, issues, audio, features, digest)
    write_findings(findings, issues)
    write_bytes(labels, csv_bytes(label_columns(session.labels), session.labels))
    print(f"{len(new)} recordings read, {len(entries) - len(new)} features reused")
    return len(new), len(entries) - len(new)


def _unknown_sound(session: str, features: FeatureSettings) -> Finding:
    setting, other = ("align", "false") if features.align else ("kind", "stft")
    problem = f"features.{setting} needs the played sound, which this session does not have"
    fix = f"add it to session.yaml, or set features.{setting} to {other}"
    return Finding(session, WHOLE_SESSION, "", "error", "no_excitation", problem, fix)


def _unfit_sound(session: str, features: FeatureSettings, problem: str) -> Finding:
    fix = f"set features.kind to stft: {features.kind} cannot be made of this sound"
    return Finding(session, WHOLE_SESSION, "", "error", "unfit_excitation", problem, fix)


def _made(
    session: str,
    entries: Sequence[AudioFile],
    audio: AudioSettings,
    features: FeatureSettings,
    excitation: np.ndarray | None,
) -> dict[str, Row | list[Finding]]:
    """Return what became of recordings, by their names."""
    if not entries:
        return {}
    with _one_thread_of_blas(features):
        make = feature_maker(features, audio.sample_rate_hz, excitation)

        def made(entry: AudioFile) -> Row | list[Finding]:
            played = excitation if features.align else None
            found = examine(entry.path, audio, features.window, played)
            return _row(session, entry, found, make)

        return {entry.recording_id: made(entry) for entry in entries}


def _one_thread_of_blas(features: FeatureSettings) -> AbstractContextManager[object]:
    """Return what keeps the sums of BLAS in one order, however many cores there are; a spectrum
    has none."""
    if features.kind != "transfer_function":
        return nullcontext()
    from threadpoolctl import threadpool_limits

    return threadpool_limits(limits=1)


def _row(
    session: str,
    entry: AudioFile,
    found: Examined,
    make: Callable[[np.ndarray], np.ndarray],
) -> Row | list[Finding]:
    issues = [finding(session, entry.recording_id, entry.path, r) for r in found.remarks]
    if found.samples is None:
        return issues
    samples = found.samples if found.delay is None else shift(found.samples, found.delay)
    try:
        feature = make(samples)
    except ValueError as error:  # for instance: not normalised, and beyond float32
        fix = "change features in dataset.yaml, or set quality to reject"
        return [
            *issues,
            Finding(session, entry.recording_id, "", "error", "no_feature", str(error), fix),
        ]
    return Row(feature, np.nan if found.delay is None else found.delay, tuple(issues))


def _write(
    path: Path,
    entries: Sequence[AudioFile],
    rows: Mapping[str, Row],
    issues: list[Finding],
    audio: AudioSettings,
    features: FeatureSettings,
    digest: str,
) -> None:
    frequency = frequencies_hz(audio.sample_rate_hz, features)
    hashes = {entry.recording_id: entry.sha256 for entry in entries}
    flags = _codes(issues)
    columns = {
        "recording": text_column(list(rows)),
        "sha256": text_column([hashes[name] for name in rows], long_name="SHA-256 of the file"),
        "flags": text_column([flags.get(name, "") for name in rows], long_name="findings"),
    }
    if features.align:
        delay = np.asarray([row.delay for row in rows.values()], np.float64)
        columns["delay_samples"] = Column(delay, {"long_name": "delay taken out", "units": "1"})
    feature = np.asarray([row.feature for row in rows.values()], np.float32)
    settings = {
        "audio": audio.model_dump(mode="json"),
        "features": features.model_dump(mode="json"),
    }
    attrs = {
        "settings": json.dumps(settings, sort_keys=True),
        SETTINGS_ATTRIBUTE: digest,
        **software(),
    }
    shard = Shard(feature.reshape(len(rows), len(frequency)), frequency, columns, attrs)
    write_store(path, shard)


def _codes(findings: Iterable[Finding]) -> dict[str, str]:
    """Codes of the findings of each recording, sorted, with commas between them."""
    codes: dict[str, set[str]] = defaultdict(set)
    for one in findings:
        codes[one.recording_id].add(one.code)
    return {name: ",".join(sorted(found)) for name, found in codes.items()}


def _known_rows(path: Path, findings: Path, digest: str) -> dict[tuple[str, str], Row]:
    """Rows of the last shard by (recording_id, sha256); none when it was made otherwise."""
    if not path.is_file():
        return {}
    try:
        shard, remarks = read_store(path), read_findings(findings)
    except DataError:
        return {}  # what cannot be read is computed again
    if shard.attrs.get(SETTINGS_ATTRIBUTE) != digest:
        return {}
    values = {name: column.values.tolist() for name, column in shard.columns.items()}
    names, hashes, flags = values["recording"], values["sha256"], values["flags"]
    delays = values.get("delay_samples", [np.nan] * len(names))
    codes = _codes(remarks)
    issues = defaultdict(list)
    for one in remarks:
        if one.code != OTHER_DELAY:  # depends on the other recordings
            issues[one.recording_id].append(one)
    return {
        (name, sha256): Row(shard.feature[row], delays[row], tuple(issues[name]))
        for row, (name, sha256) in enumerate(zip(names, hashes, strict=True))
        if flags[row] == codes.get(name, "")  # else shard and findings are of different runs
    }
