"""Results on a small embedding, as they are stored, and what is made of them."""

import numpy as np
from report_samples import SCRIPT

from ajgdata.experiments.base import Result, TaskResults, score_table
from ajgdata.experiments.embedding import by_run
from ajgdata.report.projections import Projection, Projections
from ajgdata.types import Embedding
from ajgdata.types.table import Table, table_of

#: Of the things, two are spherical; one has a hostile name.
THINGS = {"apple": "spherical", "orange": "spherical", "pen": "cylindrical", SCRIPT: "other"}
CATEGORIES = ["cylindrical", "other", "spherical"]
DIMENSIONS = (2, 4)
SETTINGS = {
    "supervision": f"Which things are the same, and {SCRIPT}.",
    "target": "object",
    "category": "category",
    "dimensions": DIMENSIONS,
    "shown": 4,
    "folds": 2,
    "inits": 1,
}


def listed(name: str, rows: list[dict], **columns: str) -> Table:
    """A table whose columns are called as their keys."""
    return table_of(name, name, rows, **{key: key for key in rows[0]} | columns)


def runs(mean: float) -> list[float]:
    """Two runs, 0.1 above and below the mean."""
    return [mean - 0.1, mean + 0.1]


def knn(best: dict[str, list[float]] | None = None) -> tuple[list[Table], list[Table]]:
    """Raw takes 0.03 s a fold, a latent of d dimensions d + 0.03 s, and so on."""
    rows = [{"space": "raw", "dimension": None, "values": runs(0.5)}]
    for space, high in (("latent", 0.6), ("pca", 0.4), ("umap", 0.3)):
        rows += [
            {"space": space, "dimension": d, "values": runs(high - 0.2 / d)}
            for d in reversed(DIMENSIONS)
        ]
    for row in rows:
        if row["dimension"] in (4, None):
            row["values"] = (best or {}).get(row["space"], row["values"])
    fits = {"raw": 0.0, "latent": 1.0, "pca": 0.1, "umap": 10.0}
    times = [
        {
            "space": row["space"], "dimension": row["dimension"],
            "fit_s": fits[row["space"]] * (row["dimension"] or 0),
            "transform_s": 0.02, "query_s": 0.01, "recordings": 20,
        }
        for row in rows
    ]  # fmt: skip
    columns = {"space": "Space", "dimension": "Dimension", "run": "Run", "accuracy": "Accuracy"}
    cost = {"networks": 4, "cpu_s": 20.0}
    spent = [("", "cost of training", name, "measured", value) for name, value in cost.items()]
    found = table_of("knn", "k-NN", by_run(rows, "accuracy"), **columns)
    return [found], [score_table(spent, "Cost"), listed("times", times)]


def distances(within: dict[str, float] | None = None, narrower: float = 0.0) -> list[Table]:
    """Two runs: within 1 and between 3; but within `other` 5, more than to others, of one thing
    only. The first run is `narrower` within cylindrical."""
    own = within or {"cylindrical": 1.0, "other": 5.0, "spherical": 1.0}
    rows = []
    for space in ("latent", "raw"):
        for pairs in ("all", "different things"):
            for i, first in enumerate(CATEGORIES):
                for second in CATEGORIES[i:]:
                    for run, off in enumerate((-0.0708, 0.0708)):
                        value = (own[first] if first == second else 3.0) + off
                        if first == second == "cylindrical" and run == 0:
                            value -= narrower
                        if pairs != "all" and first == second:
                            value = 1.5 + off if first == "spherical" else None
                        rows.append({
                            "space": space, "pairs": pairs, "first": first, "second": second,
                            "run": run, "distance": value,
                        })  # fmt: skip
    return [listed("categories", rows)]


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


TABLES = {
    "embedding_knn": knn,
    "embedding_distances": distances,
}


def results(experiment, tables=None, paper=None):
    """The results of an experiment, as they are read."""
    tables = TABLES[experiment]() if tables is None else tables
    tables, cost = tables if experiment == "embedding_knn" else (tables, ())
    stored = [{one.name: one for one in some} for some in (tables, cost)]
    about = {"chance": 0.25} if experiment == "embedding_knn" else {}
    return TaskResults(
        experiment=experiment,
        dataset="d",
        dataset_title="Things",
        task="poses",
        kind="classification",
        target="object",
        unit="",
        groups="grasp_id",
        source="simulated",
        settings=Embedding.model_validate(SETTINGS),
        results=(Result("", "", about, *stored),),
        papers={experiment: paper} if paper else {},
    )
