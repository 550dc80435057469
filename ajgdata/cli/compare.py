"""The command that says what changed between two runs: `ajgdata compare`."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.cells import cell_len, set_cell_size
from rich.console import Console
from rich.markup import escape

if TYPE_CHECKING:
    from ajgdata.report.blocks import ShownTable
    from ajgdata.report.run_tables import RunComparison

comparing = typer.Typer()
out = Console(emoji=False, highlight=False)

#: Exit code with --fail-on-worse; 1 is an error, 2 a wrong option.
WORSE = 3

RunArgument = Annotated[
    str, typer.Argument(help="project or results folder, metrics.csv, or commit (hash, tag, HEAD)")
]


@comparing.command()
def compare(
    run_a: RunArgument,
    run_b: RunArgument,
    page: Annotated[
        Path, typer.Option("--out", help="page that is written: one file, with figures")
    ] = Path("compare.html"),
    as_json: Annotated[
        bool, typer.Option("--json", help="print everything as JSON, and write no page")
    ] = False,
    everything: Annotated[
        bool, typer.Option("--all", help="list all that changed, not the 20 largest changes")
    ] = False,
    fail_on_worse: Annotated[
        bool,
        typer.Option(help=f"exit code {WORSE} if a number got worse by more than 2 sd (for CI)"),
    ] = False,
) -> None:
    """Say what changed from run A to run B: numbers beyond their spread first.

    A change is told in standard deviations of its differences fold by fold.
    Beside it: predictions that flipped, agreement with the paper, settings
    and versions that differ (why), and times and memory of the machines.

    The last ten runs are kept by commit: after a change,

        ajgdata compare HEAD results

    says what it did. Of another commit make a run in a folder of its own
    (git worktree add), and compare the folders. The exit code is 0 whatever
    changed, unless --fail-on-worse is given.
    """
    from ajgdata.pipeline.compare import compare_runs, write_page
    from ajgdata.report.run_tables import summary
    from ajgdata.store.tables import plain

    found = compare_runs(run_a, run_b)
    if as_json:
        typer.echo(json.dumps(plain(found.as_json()), indent=1, allow_nan=False))
    elif found.same and not everything:
        noted = "".join(f" ({one.told()})" for one in (found.a, found.b) if one.note)
        out.print(escape(summary(found) + noted), soft_wrap=True)
    else:
        _print(found, everything)
        write_page(found, page)
        out.print(f"page: {escape(str(page))}", soft_wrap=True)
    raise typer.Exit(WORSE if fail_on_worse and found.numbers.worse else 0)


def _print(found: RunComparison, everything: bool) -> None:
    from ajgdata.report.run_tables import console_tables, summary

    out.print(f"A: {escape(found.a.told())}\nB: {escape(found.b.told())}", soft_wrap=True)
    out.print(f"[b]{escape(summary(found))}[/b]", soft_wrap=True)
    for shown in console_tables(found, everything):
        for line in _lines(shown):
            out.out(line, highlight=False)
    for what in found.missing:
        out.print(f"[yellow]not compared[/yellow] {escape(what)}", soft_wrap=True)


def _lines(shown: ShownTable) -> Iterator[str]:
    """Yield a table in lines, however wide the terminal is; numbers are flush right."""
    heads = [head.removesuffix("|") for head in shown.heads]
    right = [head.endswith("|") for head in shown.heads]
    widths = [max(map(cell_len, column)) for column in zip(heads, *shown.rows, strict=True)]
    yield f"\n{shown.caption}"
    for row in (heads, *shown.rows):
        cells = (
            " " * (width - cell_len(cell)) + cell if flush else set_cell_size(cell, width)
            for cell, width, flush in zip(row, widths, right, strict=True)
        )
        yield "  ".join(cells).rstrip()
