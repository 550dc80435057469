"""`ajgdata train`: train one model of one task, for example for `ajgdata sense`."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.markup import escape

from ajgdata.cli.completion import dataset_names
from ajgdata.cli.console import say
from ajgdata.cli.project import run_snakemake
from ajgdata.paths import find_project
from ajgdata.store.sessions import read_dataset
from ajgdata.types import MODELS, DataError
from ajgdata.types.extras import require_extra


def train(
    dataset: Annotated[
        str, typer.Argument(metavar="NAME", help="data set", autocompletion=dataset_names)
    ],
    task: Annotated[str, typer.Argument(help="task that the model is trained for")],
    options: Annotated[
        list[str] | None,
        typer.Argument(metavar="[OPTION]...", help="options of Snakemake, e.g. --dry-run"),
    ] = None,
    model: Annotated[
        str, typer.Option(help="model; default: cnn, else the first of the task")
    ] = "",
) -> None:
    """Train one model of a task, without the experiments and the report.

    Computes the features first if they are outdated. Prints the equivalent `snakemake` command
    first. The model may also be one that the task does not list.
    """
    paths = find_project()
    spec = read_dataset(paths, dataset)
    if task not in spec.tasks:
        fix = f"use one of {', '.join(spec.tasks)}" if spec.tasks else "add it to dataset.yaml"
        raise DataError(paths.dataset(dataset), f"there is no task {task!r}", fix)
    model = model or spec.default_model(task)
    if model not in MODELS:
        raise DataError("--model", f"unknown model {model!r}", f"use one of {', '.join(MODELS)}")
    extra = MODELS[model].extra
    if extra:
        require_extra(extra, f"model {model}")
    folder = paths.model(dataset, task, model)
    target = folder.relative_to(paths.root).as_posix()
    code = run_snakemake(paths, [dataset], [target, *(options or ())])
    if code:
        raise typer.Exit(code)
    if not folder.is_dir():  # after a dry run
        return
    from ajgdata.store.models import read_about

    read_about(folder)  # raises DataError if the model could not be trained
    source = "--source virtual" if spec.recipe else '--device "…"   (see `ajgdata device list`)'
    say(escape(f"next: ajgdata sense {dataset} {task} {model} {source}"))
    predictor = f'ajgdata.load_predictor("{dataset}", "{task}", "{model}")'
    say(escape(f'a file, in Python: {predictor}.predict_file("recording.wav")'))
