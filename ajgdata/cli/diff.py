"""`ajgdata diff`: list the recordings that differ between two versions of a data set."""

from __future__ import annotations

import csv
import sys
from typing import Annotated

import typer
from rich.markup import escape

from ajgdata.cli.console import ATTENTION, JsonOption, print_json, warn
from ajgdata.store.addresses import without_credentials


def diff(
    old: Annotated[
        str, typer.Argument(metavar="A", help="NAME, PROJECT:NAME, published folder or address")
    ],
    new: Annotated[str, typer.Argument(metavar="B", help="the other version, in the same form")],
    as_json: JsonOption = False,
) -> None:
    """List recordings that were added, removed, renamed or relabelled between two versions.

    Also lists recordings with another sound. Prints CSV: one row per recording and label. A
    recording is renamed if its sha256 is equal. Rejected and quarantined recordings of a project
    are left out, as in a published data set. Exit code 3 if the versions differ.
    """
    from ajgdata.pipeline.dataset_differences import VersionDifference, compare_versions
    from ajgdata.pipeline.dataset_versions import read_version

    result = compare_versions(read_version(old), read_version(new))
    counts = result.counts()
    old = without_credentials(old)
    new = without_credentials(new)
    if as_json:
        print_json(
            {
                "old": old,
                "new": new,
                "n_recordings_old": result.n_old,
                "n_recordings_new": result.n_new,
                **{f"n_{kind.replace(' ', '_')}": count for kind, count in counts.items()},
                "differences": [
                    {key: cell or None for key, cell in item._asdict().items()}
                    for item in result.differences
                ],
            }
        )
    else:
        if result.differences:
            table = csv.writer(sys.stdout, lineterminator="\n")
            table.writerow(VersionDifference._fields)
            table.writerows(result.differences)
            sys.stdout.flush()
        summary = ", ".join(f"{count} {kind}" for kind, count in counts.items())
        sizes = f"{result.n_old} recordings in {old}, {result.n_new} in {new}"
        warn(escape(f"{sizes}: {summary}"))
    raise typer.Exit(ATTENTION if result.differences else 0)
