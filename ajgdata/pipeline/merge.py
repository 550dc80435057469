"""Shards + labels -> the feature store of a data set, and the list of what was left out."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ajgdata.store.features import (
    Shard,
    concatenate,
    feature_attrs,
    labels_of,
    open_store,
    read_spectra,
    write_blocks,
)
from ajgdata.store.files import read_csv, sha256_of
from ajgdata.store.findings import read_findings, rejected, without_rejected, write_findings
from ajgdata.store.labels import labelled, select, with_columns, without_copies
from ajgdata.store.provenance import software
from ajgdata.types import Finding, Target

if TYPE_CHECKING:
    import xarray as xr


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
    missing, and listed. Of a rejected recording only the rejection is listed. Spectra pass through
    memory one shard at a time.
    """
    found = [finding for path in findings for finding in read_findings(path)]
    with ExitStack() as stack:
        opened = {path: stack.enter_context(open_store(path)) for path in shards}
        parts = []
        notes: list[Finding] = []
        for (shard_path, shard), label_path in zip(opened.items(), labels, strict=True):
            session = shard_path.stem
            table = {row["recording_id"]: row for row in read_csv(label_path)[1]}
            kept, told = select(labels_of(shard), table, targets, session)
            found += told
            notes += rejected(session, table).values()
            parts.append(labelled(kept, table, targets, session))
        columns = {name for part in parts for name in part.columns}
        merged = concatenate([with_columns(part, columns, targets) for part in parts])
        merged, told = without_copies(merged, [*targets])
        found = [*without_rejected(found, notes), *told]
        blocks = _spectra(opened, merged.columns["recording"].values)
        write_blocks(store, with_attributes(merged, dataset), blocks, feature_attrs(merged.attrs))
    write_findings(quarantine, found)


def _spectra(opened: Mapping[Path, xr.Dataset], recordings: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the spectra (m, f) of each open shard that are of `recordings` (`<session>/<name>`)."""
    chosen = set(recordings.tolist())
    for path, dataset in opened.items():
        names = dataset["recording"].values.tolist()
        rows = [f"{path.stem}/{name}" in chosen for name in names]
        yield read_spectra(path, dataset)[rows]


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
