"""`ajgdata export`: write a trained model as an ONNX file, and compare it with the package."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from ajgdata.cli.console import say
from ajgdata.pipeline.progress import bar


def export(
    dataset: Annotated[str, typer.Argument(help="data set")],
    task: Annotated[str, typer.Argument(help="task that the model was trained for")],
    model: Annotated[str, typer.Argument(help="its name, e.g. cnn")],
    folder: Annotated[
        Path | None, typer.Option("--out", help="folder to write into; default: results/exported")
    ] = None,
) -> None:
    """Write a trained model as one ONNX file: waveform in, calibrated prediction out.

    Compares the file with the package for every recording of the data set. Exit code 1 if they
    differ by more than rounding.
    """
    from ajgdata.paths import find_project
    from ajgdata.pipeline.export_model import check_export, export_model

    paths = find_project()
    file = export_model(paths, dataset, task, model, folder=folder or paths.exported)
    with bar("comparing") as started:
        differences = check_export(paths, file, (dataset, task, model), started)
    for one in differences:
        verdict = "differs" if one.is_beyond else "agrees"
        numbers = f"largest difference {one.largest:.2g}, allowed {one.allowed:.2g}"
        say(f"{one.quantity:12} {numbers}: {verdict}")
    is_wrong = any(one.is_beyond for one in differences)
    result = "differs from the package" if is_wrong else "agrees with the package"
    say(escape(f"{file}: {file.stat().st_size / 1e3:.0f} kB, {result}"))
    raise typer.Exit(is_wrong)
