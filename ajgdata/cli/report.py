"""`ajgdata report`: print where a report is, or write it as one file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from ajgdata.cli.completion import dataset_names
from ajgdata.cli.console import ATTENTION, say, warn
from ajgdata.paths import find_project, run_name
from ajgdata.types import DataError, many
from ajgdata.types.extras import require_extra

MB = 1e6


def report(
    datasets: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME]...", help="data sets of the run", autocompletion=dataset_names
        ),
    ] = None,
    is_one_file: Annotated[
        bool, typer.Option("--one-file", help="write pages, figures and sounds into one file")
    ] = False,
    file: Annotated[
        Path | None, typer.Option("--out", help="HTML file to write", show_default=False)
    ] = None,
) -> None:
    """Print the path of a report, or write it as one HTML file.

    The file of --one-file needs no other file and no network. Its sounds are compressed (MP3).
    Exit code 3 if sounds had to be omitted, or the file is larger than 10 MB.
    """
    names = datasets or []
    paths = replace(find_project(), run=run_name(names))
    if not paths.report.is_file():
        command = " ".join(["ajgdata run", *names])
        raise DataError(paths.report, "does not exist", f"run `{command}`")
    if file is not None and not is_one_file:
        raise typer.BadParameter("--out requires --one-file")
    if not is_one_file:
        say(escape(str(paths.report)))
        return
    require_extra("workflow", "ajgdata report --one-file")
    from ajgdata.pipeline.one_file import MAX_BYTES, write_one_file

    target = file or Path(f"{paths.run or 'report'}.html")
    written = write_one_file(paths, target)
    sounds = many(written.n_sounds, "sound")
    say(f"{escape(str(target))}: {written.n_bytes / MB:.1f} MB, {sounds}")
    if written.n_omitted:
        warn(f"{many(written.n_omitted, 'sound')} omitted: missing, or too many for 10 MB")
    if written.n_bytes > MAX_BYTES:
        warn("the file is larger than 10 MB: choose one data set")
    if written.n_omitted or written.n_bytes > MAX_BYTES:
        raise typer.Exit(ATTENTION)
