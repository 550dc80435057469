"""Latents and features -> their pictures in two dimensions, as a document."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.pipeline.embed import write_document
from ajgdata.store.features import read_store
from ajgdata.store.latents import read_latents
from ajgdata.types import DataError, Embedding

#: The run that is looked at, and what a latent of two dimensions is drawn by.
FOLD, INIT, PLANE = 0, 0, "plane"


def make_projections(
    store: Path, latents: Path, *, settings: Embedding, seed: int, output: Path
) -> None:
    """Write the pictures of one run, of the latent and of raw features; or why there are none.

    A latent of two dimensions is there as it is, too.
    """
    from ajgdata.embed.encoder import raw_scaling
    from ajgdata.embed.projections import project

    found, features = read_latents(latents), read_store(store)
    if "skipped" in found.attrs:
        write_document(output, settings, found.attrs, {"skipped": str(found.attrs["skipped"])})
        return
    recordings = found.columns["recording"].values.tolist()
    place = {name: row for row, name in enumerate(features.columns["recording"].values.tolist())}
    if not set(recordings) <= set(place):
        raise DataError(latents, "is not of these features", "delete it and run again")
    feature = features.feature[[place[name] for name in recordings]]
    training = found.validation_fold != FOLD
    raw = raw_scaling().fit(feature[training]).transform(feature)
    spaces = {"raw": raw, "latent": found.latent[settings.shown][FOLD, INIT]}
    pictures = [
        _picture(space, method, plane)
        for space, points in spaces.items()
        for method, plane in project(points, training, seed).items()
    ]
    if 2 in found.latent:
        pictures.insert(0, _picture("latent", PLANE, found.latent[2][FOLD, INIT]))
    content = {
        "fold": FOLD,
        "init": INIT,
        "dimension": settings.shown,
        "seed": seed,
        "recording": recordings,
        "training": training.tolist(),
        "pictures": pictures,
    }
    write_document(output, settings, found.attrs, content)


def _picture(space: str, method: str, points: np.ndarray) -> dict[str, Any]:
    """float32 has seven digits; more in the file would be made up."""
    listed = [[float(f"{value:.7g}") for value in row] for row in points.tolist()]
    return {"space": space, "method": method, "points": listed}
