"""Tables that changed while a run read them (an import, an edit), and times in the future."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.plan import DatasetPlan
from ajgdata.store.file_times import reset_future_times
from ajgdata.store.freshness import FeatureHashes, read_hashes, table_changes, table_digests


@dataclass(frozen=True)
class FeatureState:
    """The features of a data set before a run.

    `hashes` is None if there are no features. `is_current` is whether the tables have not changed
    since the features were computed.
    """

    hashes: FeatureHashes | None
    is_current: bool


def feature_states(paths: Paths, plans: Mapping[str, DatasetPlan]) -> dict[str, FeatureState]:
    """Return the state of the features of each data set.

    Raises DataError for a table that cannot be read.
    """
    states = {}
    for name, plan in plans.items():
        hashes = read_hashes(paths.session_hashes(name))
        tables = table_digests(paths, name, plan.virtual)
        is_current = hashes is not None and not table_changes(hashes.tables, tables)
        states[name] = FeatureState(hashes, is_current)
    return states


def changed_during_run(
    paths: Paths, plans: Mapping[str, DatasetPlan], before: Mapping[str, FeatureState]
) -> Iterator[str]:
    """Yield a line for each data set whose tables are no longer those that this run used.

    A data set is not part of the run if its features were outdated before the run, and the run did
    not compute them again.
    """
    for name, state in before.items():
        hashes = read_hashes(paths.session_hashes(name))
        if hashes is None or (hashes == state.hashes and not state.is_current):
            continue
        tables = table_digests(paths, name, plans[name].virtual)
        changes = table_changes(hashes.tables, tables)
        if changes:
            yield (
                f"{name}: {', '.join(changes)} during the run; "
                f"its results are outdated, `ajgdata run {name}` computes them again"
            )


def correct_future_times(paths: Paths, tables: Iterable[Path]) -> None:
    """Give results and `tables` whose time is in the future the present time, and report it.

    Called when a run starts its jobs: Snakemake fails if a result is older than its inputs.
    """
    count = reset_future_times([*tables, *paths.results.rglob("*")])
    if count:
        print(
            f"{count} files of data/ and results/ had a time in the future; they got the present "
            "time. Check the clock of the computer that wrote them.",
            file=sys.stderr,
        )
