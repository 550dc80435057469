"""`ajgdata export NAME --parquet FILE`: one table of a data set for other programs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ajgdata.acquire.recipe import session_names
from ajgdata.paths import Paths
from ajgdata.store.features import read_store
from ajgdata.store.files import write_bytes
from ajgdata.store.findings import read_findings
from ajgdata.store.freshness import check_computed, check_up_to_date
from ajgdata.store.publishing.feature_table import feature_table_bytes
from ajgdata.store.sessions import read_dataset
from ajgdata.types import left_out


@dataclass(frozen=True)
class ExportedTable:
    """Facts about an exported table: numbers of its recordings, excluded recordings and bytes."""

    recordings: int
    excluded: int
    bytes: int


def export_table(paths: Paths, dataset: str, file: Path) -> ExportedTable:
    """Write the labels and features of a data set into the Parquet file `file`.

    Raises DataError if the data set has no features, or if they are outdated.
    """
    spec = read_dataset(paths, dataset)
    check_computed(paths, dataset)
    store = read_store(paths.features(dataset))
    check_up_to_date(paths, spec, session_names(spec.recipe))
    content = feature_table_bytes(store)
    write_bytes(file, content)
    excluded = left_out(read_findings(paths.quarantine(dataset)))
    return ExportedTable(len(store.feature), len(excluded), len(content))
