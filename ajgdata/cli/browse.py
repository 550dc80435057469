"""`ajgdata browse`: see and hear the recordings of a data set on a local page."""

from __future__ import annotations

import time
import webbrowser
from typing import Annotated

import typer
from rich.markup import escape

from ajgdata.cli.completion import dataset_names
from ajgdata.cli.console import say
from ajgdata.paths import find_project
from ajgdata.types import many
from ajgdata.types.extras import require_extra


def browse(
    dataset: Annotated[str, typer.Argument(help="data set", autocompletion=dataset_names)],
    filter_text: Annotated[
        str, typer.Option("--filter", metavar="FILTER", help="e.g. 'wrong=yes confidence>0.9'")
    ] = "",
    sort: Annotated[str, typer.Option(help="column; -COLUMN: largest first")] = "",
    predictions: Annotated[
        str, typer.Option(help="task and model, e.g. object/cnn; default: first")
    ] = "",
    recording: Annotated[str, typer.Option(help="selected recording, SESSION/ID")] = "",
    check: Annotated[
        bool, typer.Option("--check", help="check all recordings first, as `ajgdata check`")
    ] = False,
    port: Annotated[int, typer.Option(min=0, max=65535, help="port; 0: any free port")] = 0,
    opened: Annotated[
        bool, typer.Option("--open", help="also open the page in the browser")
    ] = False,
) -> None:
    """Show and play recordings on a local page, and correct their labels.

    The page shows labels, issues and predictions, before and after a run. It needs no network, and
    only this computer can open it. The printed address has a token that permits changes of labels.
    Ctrl-C ends the command. The page of the documentation (Browsing) describes filters and keys.
    """
    require_extra("live", "ajgdata browse")
    from ajgdata.browse.site import browsing
    from ajgdata.browse.view import View

    view = View(find_project(), dataset, check=check)
    found = view.table(predictions, "", filter_text, sort)
    shown = many(len(found["order"]), "recording")
    with browsing(
        view,
        port=port,
        filter=filter_text,
        sort=sort,
        predictions=predictions,
        recording=recording,
    ) as address:
        say(f"{shown} of [b]{escape(dataset)}[/b]: {escape(address)}")
        if opened:
            webbrowser.open(address)
        while True:  # until Ctrl-C, which ends a sleep on every system
            time.sleep(1)
