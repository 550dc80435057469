"""`ajgdata publish` and `ajgdata fetch`: export a data set, or download one."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from ajgdata.cli.completion import dataset_names, source_names
from ajgdata.cli.console import ATTENTION, say
from ajgdata.cli.importing import show_import
from ajgdata.paths import Paths, Tree, find_project
from ajgdata.store.sessions import read_dataset
from ajgdata.types import DataError, many
from ajgdata.types.extras import require_extra

if TYPE_CHECKING:
    from ajgdata.pipeline.upload import Destination


def publish(
    dataset: Annotated[
        str, typer.Argument(metavar="NAME", help="data set", autocompletion=dataset_names)
    ],
    folder: Annotated[
        Path | None,
        typer.Option("--out", help="folder to write; default: results/published/NAME"),
    ] = None,
    with_models: Annotated[
        bool, typer.Option("--with-models", help="also the final models, with descriptions")
    ] = False,
    to: Annotated[
        str,
        typer.Option(metavar="hf:USER/NAME|zenodo", help="also send the folder; zenodo: a draft"),
    ] = "",
    yes: Annotated[bool, typer.Option("--yes", help="send without asking")] = False,
) -> None:
    """Export a data set for publication.

    The folder contains recordings, features, labels and their description for Croissant, Hugging
    Face, Frictionless, xarray and people. `sha256sum -c SHA256SUMS` verifies its files. With --to,
    the command lists the files, asks, sends them, and checks them there. A new repository is
    private, and a draft at Zenodo is published by you. If the upload is interrupted, run the
    command again to resume.
    """
    require_extra("publish", "ajgdata publish")
    from ajgdata.pipeline.publish import publish as publish_dataset
    from ajgdata.pipeline.published_models import model_files

    if yes and not to:
        raise typer.BadParameter("--yes is only used with --to")
    paths = find_project()
    models = model_files(paths, dataset) if with_models else {}
    destination = _prepared_destination(paths, dataset, to, yes=yes) if to else None
    out = folder or paths.published(dataset)
    result = publish_dataset(paths, dataset, out, models=models)
    size = f"{result.bytes / 1e6:.1f} MB"
    summary = f"{escape(str(result.folder))}: {result.recordings} recordings, {size}"
    if result.left_out:
        summary += f", {result.left_out} left out (see its README.md)"
    say(summary)
    if result.is_unlicensed:
        file = f"datasets/{dataset}/dataset.yaml"
        say(f"[yellow]no licence is stated[/yellow]: users must ask you; add it to {file}")
    if destination is not None:
        tree = Tree(result.folder)
        total = _list_files(destination.sizes(tree))
        say(escape(f"{to}: {destination.visibility()}"))
        _ask(f"Send {total} to {to}?", yes=yes)
        for line in destination.send(tree, read_dataset(paths, dataset)):
            say(escape(line))


def _prepared_destination(paths: Paths, dataset: str, to: str, *, yes: bool) -> Destination:
    """Return the destination of a data set; at Zenodo, the data set has a reserved DOI then."""
    from ajgdata.pipeline.upload import ZenodoDestination, check_may_be_sent, destination_of

    spec = read_dataset(paths, dataset)
    check_may_be_sent(paths, dataset)
    destination = destination_of(to)
    file = paths.dataset(dataset)
    destination.check(file, spec)
    if isinstance(destination, ZenodoDestination) and not spec.doi:
        server = destination.zenodo.endpoint
        _ask(f"Create a draft at {server}, and write its DOI into {file}?", yes=yes)
        doi = destination.reserve_doi(file)
        say(escape(f"reserved {doi}, now in {file}"))
    return destination


def _list_files(sizes: Mapping[str, int]) -> str:
    """Print the files to send (bytes by name), one line per folder; return number and size."""
    folders: dict[str, list[int]] = {}
    for name, size in sizes.items():
        top, slash, _ = name.partition("/")
        folders.setdefault(f"{top}{slash}", []).append(size)
    for name, parts in folders.items():
        say(f"  {escape(name):20} {many(len(parts), 'file'):>12} {sum(parts) / 1e6:12,.1f} MB")
    return f"{many(len(sizes), 'file')}, {sum(sizes.values()) / 1e6:,.1f} MB"


def _ask(question: str, *, yes: bool) -> None:
    """End the command unless a person agrees, or has agreed with `yes`."""
    if yes:
        return
    if not sys.stdin.isatty():
        raise DataError("--to", "asks before it sends, and nobody can answer", "add --yes")
    typer.confirm(question, abort=True)


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
    with_models: Annotated[
        bool, typer.Option("--with-models", help="also the final models, with descriptions")
    ] = False,
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
        if with_models:
            raise typer.BadParameter("--with-models is only used with a published data set")
        _fetch_by_name(paths, source)
    else:
        _fetch_published(paths, source, name, with_models=with_models)


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


def _fetch_published(paths: Paths, source: str, name: str, *, with_models: bool) -> None:
    """Download a published data set, and register it under `name` ("": its own name)."""
    from ajgdata.pipeline.fetch import fetch as fetch_published

    result = fetch_published(paths, source, name=name, with_models=with_models)
    if result.removed:
        say(f"[yellow]not taken over[/yellow] from its dataset.yaml: {', '.join(result.removed)}")
    for line in result.converted:
        say(f"[yellow]converted[/yellow] from an older version: {escape(line)}")
    for file, sha256 in result.files.items():
        place = paths.dataset(result.name).parent
        say(f"[yellow]missing[/yellow] {escape(f'{place / file}: copy it there, sha256 {sha256}')}")
    say(
        f"{result.recordings} recordings in {result.sessions} session(s) are data set "
        f"[b]{result.name}[/b]; next: ajgdata run {result.name}, which computes the features"
    )
