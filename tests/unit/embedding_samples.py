"""Projections of a small embedding, and its settings."""

import numpy as np
from report_samples import SCRIPT

from ajgdata.report.projections import Projection, Projections

#: Of the things, two are spherical; one has a hostile name.
THINGS = {"apple": "spherical", "orange": "spherical", "pen": "cylindrical", SCRIPT: "other"}
SETTINGS = {
    "supervision": f"Which things are the same, and {SCRIPT}.",
    "target": "object",
    "category": "category",
    "dimensions": (2, 4),
    "shown": 4,
    "folds": 2,
    "inits": 1,
}


def pictures(n: int = 32, seed: int = 0) -> Projections:
    """Recordings of the things in turn, every fourth one held out."""
    rng = np.random.default_rng(seed)
    thing = np.resize(np.array(list(THINGS)), n)
    pairs = [(s, m) for s in ("latent", "raw") for m in ("pca", "umap", "tsne")]
    return Projections(
        recording=np.array([f"s{i % 2}/r{i}" for i in range(n)]),
        training=np.arange(n) // 4 % 4 != 0,
        columns={
            "object": thing,
            "category": np.array([THINGS[one] for one in thing]),
            "angle_deg": np.where(np.arange(n) == 3, np.nan, np.linspace(-90, 90, n)),
            "session_id": np.array([f"s{i % 2}" for i in range(n)]),
            "grasp_id": np.array([f"g{i}" for i in range(n)]),
        },
        projections=(
            Projection("latent", "plane", rng.standard_normal((n, 2))),
            *(Projection(*pair, rng.standard_normal((n, 2))) for pair in pairs),
        ),
    )
