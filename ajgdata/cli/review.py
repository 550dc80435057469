"""`ajgdata review` and `ajgdata label`: find suspicious labels, and correct them."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer
from rich.markup import escape

from ajgdata.cli.completion import dataset_names
from ajgdata.cli.console import AllOption, JsonOption, print_json, say
from ajgdata.paths import find_project
from ajgdata.types import DataError, DatasetSpec
from ajgdata.types.browse_command import browse_command

#: Number of recordings that are printed without `--all`.
SHOWN = 10
NameArgument = Annotated[
    str, typer.Argument(metavar="NAME", help="data set", autocompletion=dataset_names)
]


def review(
    dataset: NameArgument,
    task: Annotated[str, typer.Option(help="only this task; default: all tasks")] = "",
    everything: AllOption = False,
    as_json: JsonOption = False,
) -> None:
    """List recordings with suspicious labels, the most suspicious first.

    A label is suspicious if models predict another one, if the sound is far from the sounds of its
    class, or if a recording with nearly the same sound has another label. Before the first run, the
    list has no predictions. `ajgdata label` accepts, corrects or rejects a recording.
    """
    from ajgdata.pipeline.review import review_list, summary_line

    result = review_list(find_project(), dataset, task=task)
    if as_json:
        print_json(
            {
                "dataset": dataset,
                "remarks": list(result.remarks),
                "recordings": [asdict(item) for item in result.items],
            }
        )
        return
    for remark in result.remarks:
        say(escape(remark))
    shown = result.items if everything else result.items[:SHOWN]
    for item in shown:
        predicted = f", predicted {item.predicted}" if item.predicted else ""
        confidence = "" if item.confidence is None else f" ({item.confidence:.2f})"
        reasons = "; ".join(item.reasons) or "no reason"
        state = " [accepted]" if item.is_reviewed else ""
        say(
            escape(
                f"{item.rank:>3}  {item.suspicion:.2f}  {item.recording}: {item.task} "
                f"{item.label}{predicted}{confidence}{state}; {reasons}"
            )
        )
    n_more = len(result.items) - len(shown)
    if n_more:
        say(f"and {n_more} more (--all shows them)")
    say(summary_line(result))
    say(f"see and hear: {escape(browse_command(dataset, [], sort='-suspicion'))}")


def label(
    dataset: NameArgument,
    recordings: Annotated[
        list[str], typer.Argument(metavar="RECORDING...", help="recordings, <session>/<name>")
    ],
    ok: Annotated[bool, typer.Option("--ok", help="the label is right")] = False,
    reject: Annotated[
        str, typer.Option(metavar="REASON", help="exclude the recording, with the reason")
    ] = "",
    new_labels: Annotated[
        list[str] | None,
        typer.Option("--label", metavar="TARGET=VALUE", help="the right label; repeatable"),
    ] = None,
    reason: Annotated[str, typer.Option(help="reason of --label or --ok")] = "",
    note: Annotated[str, typer.Option(metavar="TEXT", help="store a note")] = "",
    undo: Annotated[bool, typer.Option("--undo", help="take back the last change")] = False,
) -> None:
    """Accept, correct or reject recordings, with the reason.

    All decisions are checked before the first one is stored. Decisions that are stored already are
    printed and change nothing, so the command can be repeated.
    Each change is a line of changes.jsonl of the session; recordings.csv and the recordings stay as
    they are. The next run computes what depends on the labels. An import keeps these labels.
    """
    from ajgdata.pipeline.labelling import (
        NothingToChangeError,
        change_recording,
        check_changeable,
        find_recording,
    )

    options = {
        "--ok": ok,
        "--reject": bool(reject),
        "--label": bool(new_labels),
        "--note": bool(note),
        "--undo": undo,
    }
    given = [name for name, is_given in options.items() if is_given]
    if len(given) != 1:
        problem = f"{' and '.join(given)} together" if given else "no decision"
        raise DataError("label", problem, f"use one of {', '.join(options)}")
    if reject and reason:
        raise DataError(
            "label", "--reject and --reason together", "write the reason after --reject"
        )
    paths = find_project()
    spec = check_changeable(paths, dataset)
    action = given[0].removeprefix("--")
    cells = [_cell(spec, text) for text in new_labels or ()] or [("", note)]
    names = [find_recording(paths, dataset, text) for text in recordings]
    decisions = [(name, column, value) for name in names for column, value in cells]
    for check_only in (True, False):  # a decision that is refused stops the command before all
        for name, column, value in decisions:
            try:
                change = change_recording(
                    paths,
                    dataset,
                    name,
                    action,  # type: ignore[arg-type]  # the names of the options are the actions
                    column=column,
                    value=value,
                    reason=reject or reason,
                    check_only=check_only,
                )
                text = f"{name}: {change}"
            except NothingToChangeError as error:
                text = str(error)
            if not check_only:
                say(escape(text))
    if action != "note":
        say(escape(f"next: ajgdata run {dataset}"))


def _cell(spec: DatasetSpec, text: str) -> tuple[str, str]:
    """Return the column and the value of TARGET=VALUE; the name of a task stands for its target.

    Raises DataError for another form.
    """
    column, equals, value = text.partition("=")
    if not equals:
        raise DataError("--label", f"{text!r} has no =", "write it as TARGET=VALUE")
    if column in spec.tasks and column not in spec.label_targets:
        column = spec.tasks[column].target
    return column, value
