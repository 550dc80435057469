"""Commands on a project: `ajgdata doctor` and `status`, which change nothing, and `run`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape

looking = typer.Typer()
out = Console(emoji=False, highlight=False)


@looking.command()
def doctor() -> None:
    """Say what a bug report should: versions, backends, threads, disk and caches.

    Exit code 1 if something is wrong.
    """
    from ajgdata.paths import find_project
    from ajgdata.pipeline.doctor import doctor as examine

    try:
        paths = find_project()
    except FileNotFoundError:
        paths = None
    facts, wrong = examine(paths)
    _print(facts)
    for problem in wrong:
        out.print(f"[red]wrong[/red] {escape(problem)}", soft_wrap=True)
    raise typer.Exit(bool(wrong))


@looking.command(context_settings={"ignore_unknown_options": True})
def status(
    more: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME]... [OPTION]...",
            help="data sets, as of `ajgdata run`; the rest is handed on to Snakemake, e.g. "
            "--config 'pages=[]'",
        ),
    ] = None,
) -> None:
    """Say which results are current, which are not and why, and what no run would mend."""
    from ajgdata.paths import find_project
    from ajgdata.pipeline.run import split_arguments, with_datasets
    from ajgdata.pipeline.status import data_status, workflow_status

    paths = find_project()
    names, rest = split_arguments(more or ())
    for line in data_status(paths, names or None):
        out.print(escape(line), soft_wrap=True)
    current, groups = workflow_status(paths, with_datasets(names, rest))
    for group in groups:
        first, others = group.files[0], len(group.files) - 1
        files = f"{first} and {others} more" if others else first
        said = f"[yellow]{group.rule}[/yellow] would run ({escape(group.reason)}): {escape(files)}"
        out.print(said, soft_wrap=True)
    stale = sum(len(group.files) for group in groups)
    mend = f"; `ajgdata run {' '.join(names)}`" if names else "; `snakemake`, or `ajgdata run NAME`"
    out.print(f"{current} results are current, {stale} are not" + (mend if stale else ""))


@looking.command(context_settings={"ignore_unknown_options": True})
def run(
    arguments: Annotated[
        list[str],
        typer.Argument(
            metavar="NAME... [OPTION]...",
            help="data sets; the rest is handed on to Snakemake, e.g. --dry-run or --cores 2",
        ),
    ],
) -> None:
    """Make everything of some data sets alone: features, models, tests and the report.

    Prints the `snakemake` command that does the same first, and at the end what was made, skipped
    and left out. The exit code is 0 only if nothing was skipped that is not declared optional.
    """
    from ajgdata.paths import find_project
    from ajgdata.pipeline.run import run as run_workflow
    from ajgdata.pipeline.run import split_arguments
    from ajgdata.store.sessions import read_dataset

    paths = find_project()
    names, rest = split_arguments(arguments)
    for name in names or arguments[:1]:
        read_dataset(paths, name)  # raises DataError for an unknown name
    raise typer.Exit(run_workflow(paths, names, rest))


def _print(facts: Mapping[str, str]) -> None:
    width = max(map(len, facts))
    for topic, said in facts.items():
        out.print(f"{topic:{width}}  {escape(said)}", soft_wrap=True)
