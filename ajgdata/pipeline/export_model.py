"""Trained model -> one file that says of a waveform what the package says."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from ajgdata.export.description import Exported, describe
from ajgdata.export.layers import CannotExportError
from ajgdata.export.numpy_file import numpy_bytes, program_bytes
from ajgdata.loading import read_predictor
from ajgdata.paths import EXPORT_PROGRAM, Paths
from ajgdata.store.files import write_bytes
from ajgdata.store.models import read_about
from ajgdata.types import DataError

Format = Literal["onnx", "numpy"]


def export_model(
    paths: Paths, dataset: str, task: str, model: str, *, to: Format, folder: Path
) -> list[Path]:
    """Write the trained model of a task into `folder`; return the files.

    For `numpy` that is the model and the program that uses it. Raises DataError for a model that
    was not trained or cannot be exported, and where a package is missing.
    """
    exported = exported_model(paths, dataset, task, model)
    name = f"{dataset}-{task}-{model}"
    if to == "numpy":
        files = {f"{name}.npz": numpy_bytes(exported), EXPORT_PROGRAM: program_bytes()}
    else:
        files = {f"{name}.onnx": _onnx_bytes(exported)}
    for file, content in files.items():
        write_bytes(folder / file, content)
    return [folder / file for file in files]


def exported_model(paths: Paths, dataset: str, task: str, model: str) -> Exported:
    """Return all that a file of the trained model holds. Raises DataError, see `export_model`."""
    place = paths.model(dataset, task, model)
    if not place.is_dir():
        raise DataError(place, "there is no such trained model", "correct the name or `snakemake`")
    about, predictor = read_about(place), read_predictor(place, dataset, task)
    guard = predictor.guard
    try:
        return describe(
            predictor.estimator,
            names=(dataset, task, model),
            kind=predictor.kind,
            unit=predictor.unit,
            period=about["period"],
            audio=predictor.audio,
            features=predictor.features,
            calibration=predictor.calibration.plain(),
            guard={
                "grasps": guard.grasps,
                "references": guard.references,
                "mean": guard.mean,
                "std": guard.std,
                "scale": guard.scale,
            }
            if len(guard.grasps)
            else None,
            provenance=provenance(about),
        )
    except CannotExportError as error:
        raise DataError(place, str(error), "choose another model, or other features") from None


def provenance(about: Mapping[str, Any]) -> dict[str, Any]:
    """Return where a trained model comes from: data, code, seed."""
    return about["provenance"] | {key: about[key] for key in ("seed", "target", "recordings")}


def _onnx_bytes(exported: Exported) -> bytes:
    try:
        from ajgdata.export.onnx_graph import onnx_bytes
    except ImportError as error:
        problem = f"cannot be written without the package {error.name}"
        raise DataError("ONNX", problem, "pip install 'ajgdata[export]'") from None
    return onnx_bytes(exported)
