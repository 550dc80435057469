"""`ajgdata export`: a trained model as one file for another computer, and the check of such."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

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
    to: Annotated[
        Literal["onnx", "numpy"],
        typer.Option(help="onnx: for ONNX Runtime; numpy: where nothing but NumPy is installed"),
    ] = "onnx",
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
    """Write a trained model as one file: waveform in, calibrated probabilities or a number out.

    --check runs such a file over every recording of its data set, and says how far it is from the
    package (exit code 1 if further than rounding explains).
    """
    from ajgdata.paths import find_project

    paths = find_project()
    if check:
        _check(Path(dataset), recordings)
        return
    if not (task and model):
        raise DataError("ajgdata export", "needs DATASET TASK MODEL", "name all three")
    from ajgdata.pipeline.export_model import export_model

    files = export_model(paths, dataset, task, model, to=to, folder=folder or paths.exported)
    for file in files:
        _say(f"{file}: {file.stat().st_size / 1e3:.0f} kB")
    _say(f"next: ajgdata export --check {files[0]}")


def _check(file: Path, folder: Path | None) -> None:
    from ajgdata.paths import find_project
    from ajgdata.pipeline.export_check import check_export

    with bar("comparing") as started:
        checked = check_export(find_project(), file, folder, started)
    for one in checked.differences:
        verdict = "beyond what rounding explains" if one.is_beyond else "as rounding explains"
        apart = f"{one.largest:.2g} apart at most, allowed {one.allowed:.2g}"
        _say(f"{one.quantity:12} {apart}: {verdict}")
    if checked.end_to_end is not None:
        _say(f"{'answer':12} {checked.end_to_end:.2g} apart at most, from recording to answer")
    if checked.turned or checked.turned_by_rounding:
        _say(
            f"{checked.turned} classes or verdicts differ on the same feature, "
            f"{checked.turned_by_rounding} from recording to answer"
        )
    for reason, count in checked.refused.items():
        _say(f"{count} refused: {reason}")
    left_out = f", {checked.left_out} cannot be used" if checked.left_out else ""
    said = "differs from the package" if checked.is_wrong else "says what the package says"
    _say(f"{file}: {said}; {checked.recordings} recordings{left_out}")
    raise typer.Exit(checked.is_wrong)


def _say(text: str) -> None:
    out.print(escape(text), soft_wrap=True)
