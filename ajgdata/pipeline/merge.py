"""Shards + labels -> the feature store of a data set, and the list of what was left out."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path

from ajgdata.pipeline.progress import tell
from ajgdata.store.features import Shard, concatenate, read_store, write_store
from ajgdata.store.files import read_csv, sha256_of
from ajgdata.store.findings import read_findings, rejected, without_rejected, write_findings
from ajgdata.store.labels import labelled, select, with_columns, without_copies
from ajgdata.store.provenance import software
from ajgdata.types import Finding, Target, left_out


def merge(
    *,
    dataset: str,
    shards: Sequence[Path],
    labels: Sequence[Path],
    findings: Sequence[Path],
    targets: Mapping[str, Target],
    store: Path,
    quarantine: Path,
) -> None:
    """Join the shards of a data set (same order as `labels`) with their labels.

    A recording that is marked `reject`, or whose bytes occur a second time, is excluded and listed
    in `quarantine`, together with the issues of the shards. A target that is not a number is
    missing, and listed. Of a rejected recording only the rejection is listed.
    """
    found = [finding for path in findings for finding in read_findings(path)]
    parts = []
    notes: list[Finding] = []
    for shard_path, label_path in zip(shards, labels, strict=True):
        session = shard_path.stem
        table = {row["recording_id"]: row for row in read_csv(label_path)[1]}
        kept, told = select(read_store(shard_path), table, targets, session)
        found += told
        notes += rejected(session, table).values()
        parts.append(labelled(kept, table, targets, session))
    columns = {name for part in parts for name in part.columns}
    merged = concatenate([with_columns(part, columns, targets) for part in parts])
    merged, told = without_copies(merged, [*targets])
    found = [*without_rejected(found, notes), *told]
    write_store(store, with_attributes(merged, dataset))
    write_findings(quarantine, found)
    if excluded := left_out(found):
        tell(f"left out  {len(excluded)} of {dataset}: {quarantine} says why")


def with_attributes(shard: Shard, dataset: str) -> Shard:
    """The shard with what identifies the data set and what made it."""
    sources = set(shard.columns["source"].values) if "source" in shard.columns else set()
    rows = zip(shard.columns["recording"].values, shard.columns["sha256"].values, strict=True)
    inputs = sha256_of("\n".join(f"{name} {digest}" for name, digest in rows).encode())
    attrs = {
        **shard.attrs,
        **software(),
        "data_set": dataset,
        "source": "simulated" if "virtual" in sources else "recorded",
        "inputs_sha256": inputs,
    }
    return dataclasses.replace(shard, attrs=attrs)
