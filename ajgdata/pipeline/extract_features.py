"""Manifest of a session -> its shard of features; only what changed is computed."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.features.align import shift
from ajgdata.features.spectrum import frequencies_hz, spectrum
from ajgdata.pipeline.recordings import (
    OTHER_DELAY,
    Examined,
    examine,
    finding,
    in_threads,
    late_or_early,
    read_excitation,
)
from ajgdata.store.features import (
    Column,
    Shard,
    read_store,
    settings_text,
    text_column,
    write_store,
)
from ajgdata.store.files import link_or_copy
from ajgdata.store.findings import read_findings, write_findings
from ajgdata.store.manifest import WHOLE_SESSION, read_manifest
from ajgdata.store.provenance import settings_digest, software
from ajgdata.types import AudioSettings, DataError, FeatureSettings, Finding, Strict

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
    root: Path,
    manifest: Path,
    audio: AudioSettings,
    features: FeatureSettings,
    code: str,
    shard: Path,
    findings: Path,
    cache: Path,
    threads: int = 1,
) -> tuple[int, int]:
    """Write `shard` and `findings`; returns how many features were computed and how many reused.

    Rows of `cache`, the last shard made, are reused while recording_id, sha256, settings,
    excitation and `code` are the same. A recording that cannot be used becomes a finding and has
    no row; so do all of a session without the played sound, if recordings are to be aligned to it.
    """
    content, told = read_manifest(manifest)
    entries = content["recordings"]
    excitation, played = None, ""
    if features.align:
        excitation, more = read_excitation(root, content, audio)
        told += more
        if excitation is None:
            told.append(_not_aligned(content["session_id"]))
            entries = []
        else:
            played = content["excitation"]["sha256"]
    digest = settings_digest(audio, features, _Reference(code=code, excitation=played))
    known = _cached(cache, digest)

    def made(entry: Mapping[str, str]) -> Row | list[Finding]:
        found = examine(root / entry["path"], audio, features.window, excitation)
        return _row(content["session_id"], entry, found, audio, features)

    new = [e for e in entries if (e["recording_id"], e["sha256"]) not in known]
    made_new = in_threads(made, new, threads)
    results = {e["recording_id"]: r for e, r in zip(new, made_new, strict=True)}
    rows: dict[str, Row] = {}
    for entry in entries:
        row = results.get(
            entry["recording_id"], known.get((entry["recording_id"], entry["sha256"]))
        )
        if isinstance(row, Row):
            rows[entry["recording_id"]] = row
            told += row.remarks
        else:
            told += row or []
    if features.align:
        delays = [int(row.delay) for row in rows.values()]
        told += late_or_early(content["session_id"], list(rows), delays, audio.sample_rate_hz)
    _write(shard, content, rows, told, audio, features, digest)
    write_findings(findings, told)
    link_or_copy(shard, cache)
    link_or_copy(findings, cache.with_suffix(".findings.csv"))
    print(f"{len(new)} recordings read, {len(entries) - len(new)} features reused")
    return len(new), len(entries) - len(new)


def _not_aligned(session: str) -> Finding:
    problem = "features.align needs the played sound, which this session does not have"
    fix = "add it to session.yaml, or set features.align to false"
    return Finding(session, WHOLE_SESSION, "", "error", "no_excitation", problem, fix)


def _row(
    session: str,
    entry: Mapping[str, str],
    found: Examined,
    audio: AudioSettings,
    features: FeatureSettings,
) -> Row | list[Finding]:
    told = [finding(session, entry["recording_id"], entry["path"], r) for r in found.remarks]
    if found.samples is None:
        return told
    samples = found.samples if found.delay is None else shift(found.samples, found.delay)
    try:
        feature = spectrum(samples, audio.sample_rate_hz, features)
    except ValueError as error:  # for instance: not normalised, and beyond float32
        fix = "change features in dataset.yaml, or set quality to reject"
        return [
            *told,
            Finding(session, entry["recording_id"], "", "error", "no_feature", str(error), fix),
        ]
    return Row(feature, np.nan if found.delay is None else found.delay, tuple(told))


def _write(
    path: Path,
    content: Mapping[str, Any],
    rows: Mapping[str, Row],
    told: list[Finding],
    audio: AudioSettings,
    features: FeatureSettings,
    digest: str,
) -> None:
    frequency = frequencies_hz(audio.sample_rate_hz, features)
    hashes = {entry["recording_id"]: entry["sha256"] for entry in content["recordings"]}
    flags = _codes(told)
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
    attrs = {"settings": settings_text(settings), SETTINGS_ATTRIBUTE: digest, **software()}
    shard = Shard(feature.reshape(len(rows), len(frequency)), frequency, columns, attrs)
    write_store(path, shard, {"long_name": "spectrum", "units": "1"})


def _codes(findings: Iterable[Finding]) -> dict[str, str]:
    """Codes of the findings of each recording, sorted, with commas between them."""
    codes: dict[str, set[str]] = defaultdict(set)
    for one in findings:
        codes[one.recording_id].add(one.code)
    return {name: ",".join(sorted(found)) for name, found in codes.items()}


def _cached(cache: Path, digest: str) -> dict[tuple[str, str], Row]:
    """Rows of the last shard by (recording_id, sha256); none when it was made otherwise."""
    if not cache.is_file():
        return {}
    try:
        shard = read_store(cache)
        remarks = read_findings(cache.with_suffix(".findings.csv"))
    except DataError:
        return {}  # a cache: what cannot be read is computed again
    if shard.attrs.get(SETTINGS_ATTRIBUTE) != digest:
        return {}
    values = {name: column.values.tolist() for name, column in shard.columns.items()}
    names, hashes, flags = values["recording"], values["sha256"], values["flags"]
    delays = values.get("delay_samples", [np.nan] * len(names))
    codes = _codes(remarks)
    told = defaultdict(list)
    for one in remarks:
        if one.code != OTHER_DELAY:  # depends on the other recordings
            told[one.recording_id].append(one)
    return {
        (name, sha256): Row(shard.feature[row], delays[row], tuple(told[name]))
        for row, (name, sha256) in enumerate(zip(names, hashes, strict=True))
        if flags[row] == codes.get(name, "")  # else shard and findings are of different runs
    }
