"""Projections of a small embedding, and its settings."""

import numpy as np
from report_samples import SCRIPT

from ajgdata.types.table import Table, table_of

#: Of the things, two are spherical; one has a hostile name.
THINGS = {"apple": "spherical", "orange": "spherical", "pen": "cylindrical", SCRIPT: "other"}
SPACES = [("latent", "plane"), *((s, m) for s in ("latent", "raw") for m in ("pca", "umap"))]
SETTINGS = {
    "supervision": f"Which things are the same, and {SCRIPT}.",
    "target": "object",
    "category": "category",
    "dimensions": (2, 4),
    "shown": 4,
    "folds": 2,
    "inits": 1,
}


def projections(n: int = 32, seed: int = 0) -> list[Table]:
    """Tables of `embedding_projections`: recordings of the things in turn, some held out."""
    rng = np.random.default_rng(seed)
    things = np.resize(np.array(list(THINGS)), n).tolist()
    recordings = [
        {"recording": f"s{i % 2}/r{i}", "training": i // 4 % 4 != 0, "object": thing}
        | {"category": THINGS[thing], "angle_deg": None if i == 3 else 3.0 * i}
        | {"session_id": f"s{i % 2}", "grasp_id": f"g{i}"}
        for i, thing in enumerate(things)
    ]
    points = [
        {"space": space, "method": method, "x": x, "y": y}
        for space, method in SPACES
        for x, y in rng.standard_normal((n, 2))
    ]
    return [
        table_of(name, name, rows, **{key: key for key in rows[0]})
        for name, rows in (("recordings", recordings), ("points", points))
    ]
