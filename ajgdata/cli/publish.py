"""`ajgdata publish` and `ajgdata fetch`: data sets written for other people, and downloaded."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from ajgdata.cli.console import ATTENTION, say

if TYPE_CHECKING:
    from ajgdata.paths import Paths


def publish(
    dataset: Annotated[str, typer.Argument(metavar="NAME", help="data set")],
    folder: Annotated[
        Path | None,
        typer.Option("--out", help="folder to write; default: results/published/NAME"),
    ] = None,
) -> None:
    """Export a data set for publication.

    It contains recordings, features, labels and their description for Croissant, Hugging Face,
    Frictionless, xarray and people. `sha256sum -c SHA256SUMS` verifies it.
    """
    from ajgdata.paths import find_project
    from ajgdata.pipeline.publish import publish as write

    paths = find_project()
    target = folder or paths.published(dataset)
    done = write(paths, dataset, target)
    left_out = f", {done.left_out} left out (see its README.md)" if done.left_out else ""
    size = f"{done.bytes / 1e6:.1f} MB"
    say(f"{escape(str(done.folder))}: {done.recordings} recordings, {size}{left_out}")
    if done.is_unlicensed:
        file = f"datasets/{dataset}/dataset.yaml"
        say(f"[yellow]no licence is stated[/yellow]: users must ask you; add it to {file}")


def fetch(
    source: Annotated[
        str,
        typer.Argument(
            metavar="NAME|URL|FOLDER",
            help="public recordings by name, or a published data set",
        ),
    ],
    name: Annotated[
        str, typer.Option(help="new name of a published data set; default: unchanged")
    ] = "",
) -> None:
    """Download a published data set or a public recording collection.

    NAME has a datasets/NAME/source.yaml; its recordings are cached outside the project. URL or
    FOLDER is a published data set. Every file is verified by its hash. If the download is
    interrupted, run the command again to resume. Exit code 3 if recordings are missing.
    """
    from ajgdata.paths import find_project

    paths = find_project()
    if paths.source(source).is_file():
        _fetch_by_name(paths, source)
    else:
        _fetch_published(paths, source, name)


def _fetch_by_name(paths: Paths, dataset: str) -> None:
    from ajgdata.cli.importing import show_import
    from ajgdata.pipeline.fetch import fetch_source
    from ajgdata.store.sessions import read_dataset
    from ajgdata.store.sources import read_source

    spec, declared = read_dataset(paths, dataset), read_source(paths, dataset)
    republish = "" if declared.republish else "; do not hand them on"
    say(escape(f"licence: {spec.licence}{republish}"))
    say(escape(f"cite: {spec.citation or spec.url}"))
    say(escape(f"about {declared.size_mb:g} MB from {declared.origin.repository}"))
    if declared.status == "not yet run":
        say("[yellow]not yet run[/yellow]: declared from the list of its files only")
    result = fetch_source(paths, dataset)
    show_import(result, dataset, everything=False)
    say(f"next: ajgdata run {dataset}")
    raise typer.Exit(0 if result.is_complete else ATTENTION)


def _fetch_published(paths: Paths, source: str, name: str) -> None:
    from ajgdata.pipeline.fetch import fetch as fetch_published

    done = fetch_published(paths, source, name=name)
    if done.removed:
        say(f"[yellow]not taken over[/yellow] from its dataset.yaml: {', '.join(done.removed)}")
    for line in done.converted:
        say(f"[yellow]converted[/yellow] from an older version: {escape(line)}")
    say(
        f"{done.recordings} recordings in {done.sessions} session(s) are data set [b]{done.name}"
        f"[/b]; next: ajgdata run {done.name}, which computes the features"
    )
