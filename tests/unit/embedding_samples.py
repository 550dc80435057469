"""Documents on a small embedding, as docs/embedding.md has them, and what is made of them."""

import numpy as np

from ajgdata.pipeline.embed_documents import embedded
from ajgdata.report.embedded import Embedded, Picture, Pictured
from ajgdata.types import DatasetSpec

SCRIPT = "<script>alert(1)</script>"
#: Of the things, two are spherical; one has a hostile name.
THINGS = {"apple": "spherical", "orange": "spherical", "pen": "cylindrical", SCRIPT: "other"}
CATEGORIES = ["cylindrical", "other", "spherical"]
PROVENANCE = {"source": "simulated", "git_commit": "abc1234"}
DIMENSIONS = (2, 4)
SETTINGS = {
    "supervision": f"Which things are the same, and {SCRIPT}.",
    "target": "object",
    "category": "category",
    "probes": {"object": {}, "angle_deg": {"within": "object", "period_deg": 180}},
    "dimensions": DIMENSIONS,
    "shown": 4,
    "folds": 2,
    "inits": 1,
}


def declared(**changes) -> DatasetSpec:
    return DatasetSpec.model_validate(
        {
            "name": "d",
            "title": "Things",
            "targets": {
                "object": {"kind": "classification"},
                "category": {"kind": "classification"},
            },
            "embeddings": {"poses": SETTINGS | changes},
        }
    )


def score(mean: float, off: float = 0.1) -> dict:
    """Two runs, `off` above and below the mean."""
    return {"mean": mean, "sd": off * 2**0.5, "per_run": [mean - off, mean + off]}


def knn() -> dict:
    rows = [{"space": "raw", "dimension": None, **score(0.5)}]
    for space, best in (("latent", 0.6), ("pca", 0.4), ("umap", 0.3)):
        rows += [
            {"space": space, "dimension": d, **score(best - 0.2 / d)} for d in reversed(DIMENSIONS)
        ]
    gains = {"gain_points": 0.0, "gain_relative": 0.0}
    return {"k": 5, "target": "object", "chance": 0.25, "rows": [row | gains for row in rows]}


def cost() -> dict:
    return {"networks": 4, "wall_s": 12.5, "cpu_s": 20.0}


def knn_cost() -> dict:
    """Raw takes 0.03 s a fold, a latent of d dimensions d + 0.03 s, and so on."""
    fits = {"raw": 0.0, "latent": 1.0, "pca": 0.1, "umap": 10.0}
    return {
        "rows": [
            {
                "space": row["space"],
                "dimension": row["dimension"],
                "fit_s": fits[row["space"]] * (row["dimension"] or 0),
                "transform_s": 0.02,
                "query_s": 0.01,
                "recordings": 20,
            }
            for row in knn()["rows"]
        ],
    }


def distances() -> dict:
    """Within 1 and between 3; but within `other` 5, more than to others, of one thing only."""
    mean = [[1.0, 3.0, 3.0], [3.0, 5.0, 3.0], [3.0, 3.0, 1.0]]
    sd = [[0.1] * 3] * 3
    different = [[None, 3.0, 3.0], [3.0, None, 3.0], [3.0, 3.0, 1.5]]
    unknown = [[None, 0.1, 0.1], [0.1, None, 0.1], [0.1, 0.1, 0.1]]
    things = sorted(THINGS)
    apart = [[1.0 + 2 * (a != b) for b in things] for a in things]
    one = {
        "categories": CATEGORIES,
        "mean": mean,
        "sd": sd,
        "per_run": [mean, mean],
        "other_objects": {"mean": different, "sd": unknown, "per_run": [different] * 2},
        "objects": things,
        "object_category": [THINGS[thing] for thing in things],
        "object_mean": apart,
        "object_sd": [[0.1] * 4] * 4,
    }
    return {"dimension": 4, "spaces": {"latent": one, "raw": one}}


def probe(space: str, kind: str, target: str, split: str, metric: str, mean: float) -> dict:
    chance = 0.25 if metric == "accuracy" else 0.0
    about = {"space": space, "probe": kind, "target": target, "split": split, "metric": metric}
    return {**about, "kind": "", "chance": chance, **score(mean)}


def unknown(like: dict) -> dict:
    """Angles have no rank."""
    nothing = {"mean": None, "sd": None, "per_run": [None, None], "chance": 0.0}
    return {**like, **nothing, "metric": "rank_correlation"}


def probes() -> dict:
    rows = []
    for space, better in (("latent", 0.2), ("raw", 0.0)):
        for kind in ("linear", "knn"):
            rows.append(probe(space, kind, "object", "grouped", "accuracy", 0.5 + better))
            for split in ("grouped", "unseen"):
                rows.append(probe(space, kind, "angle_deg", split, "r2", -2.0 + better))
                rows.append(unknown(rows[-1]))
    silhouette = [
        {"space": space, "label": "object", **score(mean)}
        for space, mean in (("latent", 0.3), ("raw", -0.1))
    ]
    return {"rows": rows, "silhouette": silhouette}


def retrieval() -> dict:
    return {
        "rows": [
            {"space": space, "k": k, "gallery": gallery, "chance": 0.25, **score(mean / k)}
            for space, mean in (("latent", 0.8), ("raw", 0.6))
            for gallery in ("unseen", "all")
            for k in (5, 1)
        ]
    }


def transfer() -> dict:
    levels = {"raw": 0.1, "gripper_latent": 0.4}
    grippers = ["tall", SCRIPT]
    rows = [
        {"space": s, "gripper": g, "calibration": n, **score(mean + 0.1 * n, 0.05)}
        for s, mean in levels.items()
        for g in grippers
        for n in (0, 4)
    ]
    within = [{"space": s, "gripper": g, **score(0.5)} for s in levels for g in grippers]
    return {
        "training_grippers": ["g1", "g2"],
        "held_out_grippers": grippers,
        "calibration": [0, 4],
        "dimension": 4,
        "target": "object",
        "chance": 0.25,
        "rows": rows,
        "within": within,
        "probes": [row for row in probes()["rows"] if row["split"] == "grouped"],
    }


def documents() -> dict:
    made = {
        "knn": knn(),
        "distances": distances(),
        "probes": probes(),
        "retrieval": retrieval(),
    }
    about = {"settings": {}, "provenance": PROVENANCE}
    told = {name: {**about, **document} for name, document in made.items()}
    return {**told, "cost": cost(), "knn_cost": knn_cost()}


def pictures(n: int = 32, seed: int = 0) -> Pictured:
    """Recordings of the things in turn, every fourth one held out."""
    rng = np.random.default_rng(seed)
    thing = np.resize(np.array(list(THINGS)), n)
    pairs = [(s, m) for s in ("latent", "raw") for m in ("pca", "umap", "tsne")]
    return Pictured(
        recording=np.array([f"s{i % 2}/r{i}" for i in range(n)]),
        training=np.arange(n) // 4 % 4 != 0,
        columns={
            "object": thing,
            "category": np.array([THINGS[one] for one in thing]),
            "angle_deg": np.where(np.arange(n) == 3, np.nan, np.linspace(-90, 90, n)),
            "session_id": np.array([f"s{i % 2}" for i in range(n)]),
            "grasp_id": np.array([f"g{i}" for i in range(n)]),
        },
        pictures=(
            Picture("latent", "plane", rng.standard_normal((n, 2))),
            *(Picture(*pair, rng.standard_normal((n, 2))) for pair in pairs),
        ),
    )


def sample(**changes) -> Embedded:
    return embedded(declared(**changes), "poses", "simulated", documents(), pictures())
