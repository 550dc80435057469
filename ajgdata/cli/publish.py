"""`ajgdata publish` and `ajgdata fetch`: export a data set, or download one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from ajgdata.cli.completion import dataset_names, source_names
from ajgdata.cli.console import ATTENTION, say
from ajgdata.cli.importing import show_import
from ajgdata.paths import Paths, find_project
from ajgdata.store.sessions import read_dataset
from ajgdata.types.extras import require_extra


def publish(
    dataset: Annotated[
        str, typer.Argument(metavar="NAME", help="data set", autocompletion=dataset_names)
    ],
    folder: Annotated[
        Path | None,
        typer.Option("--out", help="folder to write; default: results/published/NAME"),
    ] = None,
) -> None:
    """Export a data set for publication.

    The folder contains recordings, features, labels and their description for Croissant, Hugging
    Face, Frictionless, xarray and people. `sha256sum -c SHA256SUMS` verifies its files.
    """
    require_extra("publish", "ajgdata publish")
    from ajgdata.pipeline.publish import publish as publish_dataset

    paths = find_project()
    result = publish_dataset(paths, dataset, folder or paths.published(dataset))
    size = f"{result.bytes / 1e6:.1f} MB"
    summary = f"{escape(str(result.folder))}: {result.recordings} recordings, {size}"
    if result.left_out:
        summary += f", {result.left_out} left out (see its README.md)"
    say(summary)
    if result.is_unlicensed:
        file = f"datasets/{dataset}/dataset.yaml"
        say(f"[yellow]no licence is stated[/yellow]: users must ask you; add it to {file}")


def fetch(
    source: Annotated[
        str,
        typer.Argument(
            metavar="NAME|ADDRESS|FOLDER",
            help="public recordings by name, or a published data set",
            autocompletion=source_names,
        ),
    ],
    name: Annotated[
        str, typer.Option(help="new name of a published data set; default: unchanged")
    ] = "",
) -> None:
    """Download a published data set or a public recording collection.

    NAME has a file datasets/NAME/source.yaml in the project or in the package; its recordings are
    cached outside the project. ADDRESS or FOLDER is a published data set: https://…, doi:…,
    hf:USER/NAME or a git repository. Every file is verified by its hash. If the download is
    interrupted, run the command again to resume. Exit code 3 if recordings are missing.
    """
    from ajgdata.store.packaged_datasets import copy_public_dataset

    paths = find_project()
    if copy_public_dataset(paths, source):
        _fetch_by_name(paths, source)
    else:
        _fetch_published(paths, source, name)


def _fetch_by_name(paths: Paths, dataset: str) -> None:
    """Download and import the recordings of a data set with source.yaml."""
    from ajgdata.pipeline.fetch import fetch_source
    from ajgdata.store.sources import read_source

    spec = read_dataset(paths, dataset)
    source = read_source(paths, dataset)
    licence = f"licence: {spec.licence}"
    if not source.republish:
        licence += "; do not publish the recordings again"
    say(escape(licence))
    say(escape(f"cite: {spec.citation or spec.url}"))
    say(escape(f"about {source.size_mb:g} MB from {source.origin.repository}"))
    if source.status == "not yet run":
        say("[yellow]not yet run[/yellow]: dataset.yaml was written from the list of files only")
    result = fetch_source(paths, dataset)
    show_import(result, dataset, everything=False)
    say(f"next: ajgdata run {dataset}")
    raise typer.Exit(0 if result.is_complete else ATTENTION)


def _fetch_published(paths: Paths, source: str, name: str) -> None:
    """Download a published data set, and register it under `name` ("": its own name)."""
    from ajgdata.pipeline.fetch import fetch as fetch_published

    result = fetch_published(paths, source, name=name)
    if result.removed:
        say(f"[yellow]not taken over[/yellow] from its dataset.yaml: {', '.join(result.removed)}")
    for line in result.converted:
        say(f"[yellow]converted[/yellow] from an older version: {escape(line)}")
    say(
        f"{result.recordings} recordings in {result.sessions} session(s) are data set "
        f"[b]{result.name}[/b]; next: ajgdata run {result.name}, which computes the features"
    )
