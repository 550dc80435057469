"""Commands that begin a project: `new`, and `paper` for the data sets of the paper."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from ajgdata.cli.console import say
from ajgdata.paths import find_project
from ajgdata.types import many
from ajgdata.types.extras import missing_packages
from ajgdata.types.shell import shell_command


def new(folder: Annotated[Path, typer.Argument(help="new folder, or an existing one")]) -> None:
    """Create a project: a folder for data sets, recordings and results.

    Existing files are not changed. In a project, this adds the files that are missing.
    """
    from ajgdata.store.new_project import create_project

    files = create_project(folder)
    for file in files:
        say(f"[green]new[/green] {escape(str(file))}")
    if not files:
        say("nothing to add: the project has all its files")
    go = shell_command(["cd", str(folder)])
    say(escape(f"next: {go}, then ajgdata import RECORDINGS --dataset mine"))


def paper() -> None:
    """Copy the simulated data sets of the paper into the project.

    `ajgdata run` without a name then reproduces the results of the paper.
    """
    from ajgdata.store.packaged_datasets import copy_paper_datasets

    paths = find_project()
    names = copy_paper_datasets(paths)
    say(f"{many(len(names), 'new data set')} in {escape(str(paths.datasets))}")
    for extra in ("simulate", "cnn"):
        if missing_packages(extra):
            say(f'first: pip install "ajgdata[{extra}]"')
    say("next: ajgdata run (15 to 40 minutes on two cores), which writes results/report/index.html")
