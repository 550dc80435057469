"""What training a model on many recordings costs, with its limit and without.

    python benchmarks/models.py results/features/ycb.nc --target object [--models knn_plain,cnn]
        [--sizes 500,5000,50000] [--most-s 60]

Recordings beyond those of the file are the same with 5 % of noise, as further recordings of the
same grasps: a test of scale, which says nothing of errors. Each model and size runs in a process
of its own; processor time of one thread, and the largest memory. Without its limit a model is
tried only as far as `--most-s` s let expect, by the exponent of its last two sizes; what is not
tried is estimated by that exponent, and marked by ~.
"""

import json
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table
from threadpoolctl import threadpool_limits

from ajgdata.models import fit_model, make_model
from ajgdata.store.features import read_store
from ajgdata.types import MODELS as REGISTRY

NOISE = 0.05
REQUESTS = 1_000  # recordings that are predicted
MODELS = "linear_plain,ridge_plain,knn_plain,svm_plain,boosting,forest,mlp,cnn,knn,svm,linear"


def peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6


def repeated(store: Path, target: str, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return features (count, bins), target and grasp (count,)."""
    shard = read_store(store)
    column = shard.columns[target].values.astype(str)
    known = np.flatnonzero(~np.isin(column, ["", "nan"]))
    generator = np.random.default_rng(0)
    rows = generator.permutation(known)[np.arange(count) % len(known)]
    features = shard.feature[rows]
    features *= 1 + NOISE * generator.standard_normal(features.shape, np.float32)
    return features, column[rows], shard.columns["grasp_id"].values.astype(str)[rows]


def cost_of(store: Path, target: str, model: str, count: int, limited: bool) -> dict[str, float]:
    """Return s of training, s of predicting a thousand, and the largest memory in MB."""
    features, y, grasp = repeated(store, target, count)
    most = REGISTRY[model].most_recordings if limited else None
    before = peak_mb()
    with threadpool_limits(limits=1):
        begun = time.process_time()
        unfitted = make_model(model, "classification")
        if not limited and "search_rows" in unfitted.get_params():
            unfitted.set_params(search_rows=sys.maxsize)
        fitted = fit_model(unfitted, features, y, grasp, most)
        trained = time.process_time()
        fitted.predict(features[:REQUESTS])
        predicted = time.process_time()
    return {
        "train_s": trained - begun,
        "predict_s": predicted - trained,
        "memory_mb": peak_mb() - before,
        "used": min(count, most or count),
    }


def apart(*named: object) -> dict[str, float]:
    """Return `cost_of` of its own process."""
    call = [sys.executable, __file__, "--alone", json.dumps([str(name) for name in named])]
    return json.loads(subprocess.run(call, check=True, capture_output=True, text=True).stdout)


def rows_of(
    store: Path, target: str, model: str, sizes: list[int], most_s: float
) -> list[tuple[str, ...]]:
    """Return a row of the table for each size."""
    free: dict[int, float] = {}
    rows = []
    for count in sizes:
        cost = apart(store, target, model, count, "limited")
        used = int(cost["used"])
        expected = extrapolated(free, count)
        chosen = count > getattr(make_model(model, "classification"), "search_rows", sys.maxsize)
        if used == count and not chosen:
            free[count] = cost["train_s"]
            without = ""
        elif expected is None or expected <= most_s:
            free[count] = apart(store, target, model, count, "free")["train_s"]
            without = f"{free[count]:.3g}"
        else:
            without = f"~{expected:.2g}"
        texts = (f"{cost['train_s']:.3g}", f"{cost['predict_s']:.2g}", f"{cost['memory_mb']:.0f}")
        rows.append((model, f"{count:,}", f"{used:,}", *texts, without))
    return rows


def extrapolated(free: dict[int, float], count: int) -> float | None:
    """Return s of training without a limit by the exponent of the last two sizes, if there are."""
    if len(free) < 2:
        return None
    (n, s), (m, t) = sorted(free.items())[-2:]
    return t * (count / m) ** (np.log(t / s) / np.log(m / n))


def main(
    store: Annotated[Path | None, typer.Argument(help="features of a data set")] = None,
    target: str = "object",
    models: str = MODELS,
    sizes: str = "500,5000,50000",
    most_s: float = 60.0,
    alone: Annotated[str, typer.Option(hidden=True)] = "",
) -> None:
    if alone:
        path, target, model, count, limited = json.loads(alone)
        print(json.dumps(cost_of(Path(path), target, model, int(count), limited == "limited")))
        return
    if store is None:
        raise typer.BadParameter("name the file of features")
    heads = (
        "Model",
        "Recordings",
        "Trained on",
        "Training, s",
        "1,000 rows, s",
        "Memory, MB",
    )
    table = Table(*heads, "Without limit, s")
    for model in models.split(","):
        for row in rows_of(store, target, model, [int(n) for n in sizes.split(",")], most_s):
            table.add_row(*row)
            print(*row, sep="\t", file=sys.stderr, flush=True)
    Console().print(table)


if __name__ == "__main__":
    typer.run(main)
