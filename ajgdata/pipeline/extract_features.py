"""Recordings of a session -> its shard of features; only what changed is computed."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ajgdata.features.spectrum import frequencies_hz, spectrum
from ajgdata.pipeline.recordings import examine, finding
from ajgdata.store.features import Shard, read_store, text_column, write_store
from ajgdata.store.files import csv_bytes, sha256_of, write_bytes
from ajgdata.store.findings import read_findings, write_findings
from ajgdata.store.provenance import settings_digest, software
from ajgdata.store.session_audio import AudioFile, SessionAudio, check_session, label_columns
from ajgdata.types import AudioSettings, DataError, FeatureSettings, Finding

SETTINGS_ATTRIBUTE = "settings_digest"


@dataclass(frozen=True)
class Row:
    """One recording's part of a shard: feature (f,), None if it cannot be used, and issues."""

    feature: np.ndarray | None
    issues: tuple[Finding, ...]


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

    Returns how many features were computed and how many reused. Rows of the old `shard` are reused
    while recording_id, sha256, settings and `code` are the same. A recording that cannot be used
    becomes a finding and has no row.
    """
    session = check_session(folder)
    digest, rows, computed = _rows(session, audio, features, code, shard, findings)
    issues = session.findings
    issues += [issue for row in rows.values() for issue in row.issues]
    reused = len(rows) - computed
    rows = {name: row for name, row in rows.items() if row.feature is not None}
    hashes = {file.recording_id: file.sha256 for file in session.files}
    write_store(shard, _shard(rows, hashes, issues, audio, features, digest))
    write_findings(findings, issues)
    write_bytes(labels, csv_bytes(label_columns(session.labels), session.labels))
    print(f"{computed} recordings read, {reused} features reused")
    return computed, reused


def _rows(
    session: SessionAudio,
    audio: AudioSettings,
    features: FeatureSettings,
    code: str,
    shard: Path,
    findings: Path,
) -> tuple[str, dict[str, Row], int]:
    """Return the digest of the settings, a row per file, and how many rows were computed."""
    digest = sha256_of(f"{settings_digest(audio, features)} {code}".encode())[:16]
    known = _known_rows(shard, findings, digest)
    new = [file for file in session.files if (file.recording_id, file.sha256) not in known]
    computed = {file.recording_id: _row(session.session_id, file, audio, features) for file in new}
    files = {file.recording_id: file.sha256 for file in session.files}
    rows = {name: computed.get(name) or known[name, sha] for name, sha in files.items()}
    return digest, rows, len(new)


def _row(session: str, file: AudioFile, audio: AudioSettings, features: FeatureSettings) -> Row:
    result = examine(file.path, audio, features.window)
    issues = tuple(finding(session, file.recording_id, file.path, r) for r in result.remarks)
    if result.samples is None:
        return Row(None, issues)
    try:
        return Row(spectrum(result.samples, audio.sample_rate_hz, features), issues)
    except ValueError as error:  # for instance: not normalised, and beyond float32
        fix = "change features in dataset.yaml, or set quality to reject"
        names = (session, file.recording_id, "")
        issue = Finding(*names, "error", "no_feature", str(error), fix)
        return Row(None, (*issues, issue))


def _shard(
    rows: Mapping[str, Row],
    hashes: Mapping[str, str],
    issues: Sequence[Finding],
    audio: AudioSettings,
    features: FeatureSettings,
    digest: str,
) -> Shard:
    """Return the shard of `rows` by recording_id, whose features all exist."""
    frequency = frequencies_hz(audio.sample_rate_hz, features)
    flags = _codes(issues)
    columns = {
        "recording": text_column(list(rows)),
        "sha256": text_column([hashes[name] for name in rows], long_name="SHA-256 of the file"),
        "flags": text_column([flags.get(name, "") for name in rows], long_name="findings"),
    }
    feature = np.asarray([row.feature for row in rows.values()], np.float32)
    settings = {
        "audio": audio.model_dump(mode="json"),
        "features": features.model_dump(mode="json"),
    }
    text = json.dumps(settings, sort_keys=True)
    attrs = {"settings": text, SETTINGS_ATTRIBUTE: digest, **software()}
    return Shard(feature.reshape(len(rows), len(frequency)), frequency, columns, attrs)


def _codes(findings: Iterable[Finding]) -> dict[str, str]:
    """Return the codes of the findings of each recording, sorted, with commas between them."""
    codes: dict[str, set[str]] = defaultdict(set)
    for issue in findings:
        codes[issue.recording_id].add(issue.code)
    return {name: ",".join(sorted(some)) for name, some in codes.items()}


def _known_rows(path: Path, findings: Path, digest: str) -> dict[tuple[str, str], Row]:
    """Return the rows of the last shard by (recording_id, sha256); none if its settings differ."""
    if not path.is_file():
        return {}
    try:
        shard, remarks = read_store(path), read_findings(findings)
    except (DataError, PermissionError):
        return {}  # an unreadable file is computed again
    if shard.attrs.get(SETTINGS_ATTRIBUTE) != digest:
        return {}
    values = {name: column.values.tolist() for name, column in shard.columns.items()}
    names, hashes, flags = values["recording"], values["sha256"], values["flags"]
    codes = _codes(remarks)
    issues = defaultdict(list)
    for issue in remarks:
        issues[issue.recording_id].append(issue)
    return {
        (name, sha256): Row(shard.feature[row], tuple(issues[name]))
        for row, (name, sha256) in enumerate(zip(names, hashes, strict=True))
        if flags[row] == codes.get(name, "")  # else shard and findings are of different runs
    }
