"""Latents and features -> their pictures in two dimensions, as a document."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.store.features import read_store
from ajgdata.store.files import json_bytes, write_bytes
from ajgdata.store.latents import Run, read_run
from ajgdata.types import DataError

#: The run that is looked at, and what a latent of two dimensions is drawn by.
FOLD, INIT, PLANE = 0, 0, "plane"


def make_projections(
    latents: Path, store: Path, *, dimension: int, flat: bool, seed: int, output: Path
) -> None:
    """Write the pictures of one run, from the latent of `dimension` and from raw features.

    With `flat` the two-dimensional latent is there as it is, too.
    """
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    from ajgdata.embed.projections import project
    from ajgdata.models.baselines import Compress

    run, features = read_run(latents, dimension, FOLD, INIT), read_store(store)
    if features.columns["recording"].values.tolist() != run.recording.tolist():
        raise DataError(latents, "is not of these features", "delete it and run again")
    training = run.validation_fold != FOLD
    raw = make_pipeline(Compress(), StandardScaler()).fit(features.feature[training])
    spaces = {"raw": raw.transform(features.feature), "latent": run.latent}
    pictures = [
        _picture(space, method, plane)
        for space, points in spaces.items()
        for method, plane in project(points, training, seed).items()
    ]
    if flat:
        plane_run: Run = read_run(latents, 2, FOLD, INIT)
        pictures.insert(0, _picture("latent", PLANE, plane_run.latent))
    content = {
        "fold": FOLD,
        "init": INIT,
        "dimension": dimension,
        "seed": seed,
        "recording": run.recording.tolist(),
        "training": training.tolist(),
        "pictures": pictures,
    }
    write_bytes(output, json_bytes(content))


def _picture(space: str, method: str, points: np.ndarray) -> dict[str, Any]:
    """float32 has seven digits; more in the file would be made up."""
    listed = [[float(f"{value:.7g}") for value in row] for row in points.tolist()]
    return {"space": space, "method": method, "points": listed}
