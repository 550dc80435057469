"""`ajgdata export` and `ajgdata scene`: write a network, a table, or a drawing of a scene."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from ajgdata.cli.completion import dataset_names
from ajgdata.cli.console import say
from ajgdata.paths import find_project
from ajgdata.store.files import write_bytes
from ajgdata.store.sessions import read_dataset
from ajgdata.types import DataError, NotPossibleError
from ajgdata.types.extras import require_extra

if TYPE_CHECKING:
    from ajgdata.live.predictor import Predictor

OutFolder = Annotated[
    Path | None, typer.Option("--out", help="folder to write; default: results/exported")
]


def export(
    dataset: Annotated[str, typer.Argument(help="data set", autocompletion=dataset_names)],
    task: Annotated[str, typer.Argument(help="task that the model was trained for")] = "",
    model: Annotated[str, typer.Argument(help="cnn or cnn_per_bin")] = "cnn",
    folder: OutFolder = None,
    parquet: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="write labels and features of all recordings"),
    ] = None,
) -> None:
    """Write a trained CNN as one ONNX file, or a data set as one Parquet table.

    The input of the ONNX file is a waveform, and its output is a calibrated prediction. With
    --parquet, the command takes only the data set. The table has one row per recording: labels,
    codes of issues, and the feature as a list.
    """
    if parquet is not None:
        if task or folder:
            raise typer.BadParameter("--parquet takes only the data set and the file")
        _export_table(dataset, parquet)
    elif task:
        _export_model(dataset, task, model, folder)
    else:
        raise typer.BadParameter("name a task, or use --parquet FILE")


def _export_table(dataset: str, file: Path) -> None:
    """Write labels and features of a data set as one Parquet table."""
    require_extra("publish", "ajgdata export --parquet")
    from ajgdata.pipeline.feature_table import export_table

    paths = find_project()
    table = export_table(paths, dataset, file)
    summary = f"{escape(str(file))}: {table.recordings} recordings, {table.bytes / 1e6:.1f} MB"
    if table.excluded:
        summary += f", {table.excluded} excluded (see {escape(str(paths.quarantine(dataset)))})"
    say(summary)


def _export_model(dataset: str, task: str, model: str, folder: Path | None) -> None:
    """Write a trained CNN as one ONNX file into a folder."""
    from ajgdata.loading import load_predictor
    from ajgdata.store.models import other_version_reported, read_about

    require_extra("export", "ajgdata export")
    paths = find_project()
    predictor = load_predictor(dataset, task, model, paths.root)
    if predictor.axes:
        fix = "export a task whose target is one column, or use ajgdata.load_predictor"
        raise DataError(f"{dataset}/{task}", "predicts a vector, which is not exported", fix)
    from ajgdata.export import onnx_bytes  # loads torch, so errors above are printed first

    model_folder = paths.model(dataset, task, model)
    with other_version_reported(model_folder):
        description = onnx_metadata(predictor, read_about(model_folder))
    try:
        content = onnx_bytes(predictor, description)
    except NotPossibleError as error:
        fix = "export cnn or cnn_per_bin of spectra, or use ajgdata.load_predictor"
        raise DataError(model_folder, str(error), fix) from None
    file = (folder or paths.exported) / f"{dataset}-{task}-{model}.onnx"
    write_bytes(file, content)
    say(escape(f"{file}: {len(content) / 1e3:.0f} kB"))


def onnx_metadata(predictor: Predictor, about: dict[str, Any]) -> dict[str, Any]:
    """Return the metadata of the ONNX file. `about` is the content of model.json."""
    from ajgdata.export import NOVELTY_VERDICTS

    training = {key: about[key] for key in ("seed", "target", "recordings")}
    return {
        "data_set": predictor.dataset,
        "task": predictor.task,
        "model": predictor.model,
        "kind": predictor.kind,
        "unit": predictor.unit,
        "period": about["period"],
        "classes": list(predictor.classes),
        "sample_rate_hz": predictor.sample_rate_hz,
        "microphone": predictor.audio.microphone,
        "features": predictor.features.model_dump(mode="json"),
        "calibration": predictor.calibration.plain(),
        "verdicts": list(NOVELTY_VERDICTS),
        "provenance": about["provenance"] | training,
    }


def scene(
    dataset: Annotated[
        str, typer.Argument(help="data set with a recipe", autocompletion=dataset_names)
    ],
    object_name: Annotated[str, typer.Argument(metavar="OBJECT", help="object of the recipe")],
    folder: OutFolder = None,
) -> None:
    """Draw the virtual gripper on an object of a recipe.

    Draws the cross-section of the object's first grasp as SVG and PDF files.
    """
    require_extra("simulate", "ajgdata scene")
    from ajgdata.acquire.recipe import plan_session, session_names
    from ajgdata.gripper import Scene
    from ajgdata.report.canvas import save_figure
    from ajgdata.report.scenes import cross_section_figure

    paths = find_project()
    recipe = read_dataset(paths, dataset).recipe
    if recipe is None:
        raise DataError(paths.dataset(dataset), "has no recipe", "choose a simulated data set")
    grasps = plan_session(recipe, dataset, session_names(recipe)[0], code="")
    setups: dict[str, Any] = {}  # of the first grasp of each object
    for grasp in grasps:
        setups.setdefault(grasp.object, grasp.setup)
    if object_name not in setups:
        names = ", ".join(item.name for item in recipe.objects)
        problem = f"has no object {object_name!r}"
        raise DataError(paths.dataset(dataset), problem, f"use one of {names}")
    figure = cross_section_figure(
        Scene.model_validate(setups[object_name]),
        f"{dataset}: {object_name}",
        object_name.replace("_", " "),
    )
    for file in save_figure(figure, (folder or paths.exported) / f"{dataset}-{object_name}"):
        say(escape(str(file)))
