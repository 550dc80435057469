"""`ajgdata export`: write a trained model as an ONNX file, or check such a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape

from ajgdata.pipeline.progress import bar
from ajgdata.types import DataError

exporting = typer.Typer()
out = Console(emoji=False, highlight=False)


@exporting.command()
def export(
    dataset: Annotated[
        str, typer.Argument(metavar="DATASET", help="data set; with --check: an exported file")
    ],
    task: Annotated[str, typer.Argument(help="task that the model was trained for")] = "",
    model: Annotated[str, typer.Argument(help="its name, e.g. cnn")] = "",
    folder: Annotated[
        Path | None, typer.Option("--out", help="folder to write into; default: results/exported")
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="only compare the file DATASET with the package")
    ] = False,
    recordings: Annotated[
        Path | None,
        typer.Option(help="with --check: a folder of recordings; default: all of the data set"),
    ] = None,
) -> None:
    """Write a trained model as one ONNX file: waveform in, calibrated prediction out.

    --check compares the file with the package, for every recording of its data set (exit code 1 if
    rounding does not explain the difference).
    """
    from ajgdata.paths import find_project

    paths = find_project()
    if check:
        _check(Path(dataset), recordings)
        return
    if not (task and model):
        raise DataError("ajgdata export", "needs DATASET TASK MODEL", "name all three")
    from ajgdata.pipeline.export_model import export_model

    file = export_model(paths, dataset, task, model, folder=folder or paths.exported)
    _print(f"{file}: {file.stat().st_size / 1e3:.0f} kB")
    _print(f"next: ajgdata export --check {file}")


def _check(file: Path, folder: Path | None) -> None:
    from ajgdata.paths import find_project
    from ajgdata.pipeline.export_model import check_export

    with bar("comparing") as started:
        comparison = check_export(find_project(), file, folder, started)
    for one in comparison.differences:
        verdict = "not explained by rounding" if one.is_beyond else "explained by rounding"
        numbers = f"largest difference {one.largest:.2g}, allowed {one.allowed:.2g}"
        _print(f"{one.quantity:12} {numbers}: {verdict}")
    if comparison.turned:
        _print(f"{comparison.turned} classes or verdicts differ for the same feature")
    unusable = f", {comparison.unusable} unusable" if comparison.unusable else ""
    result = "differs from the package" if comparison.is_wrong else "agrees with the package"
    _print(f"{file}: {result}; {comparison.recordings} recordings{unusable}")
    raise typer.Exit(comparison.is_wrong)


def _print(text: str) -> None:
    out.print(escape(text), soft_wrap=True)
