"""Measure CPU time and memory of training on many recordings, with and without a limit.

    python benchmarks/models.py results/features/ycb.nc --target object [--models knn_plain,cnn]
        [--sizes 500,5000,50000] [--most-s 60]

If a size exceeds the number of recordings in the file, recordings are repeated with 5 % of noise,
as other recordings of the same grasps. The errors of these models have no meaning. Each model and
size is measured in a separate process with one thread: CPU time and the increase of peak memory.

The limit of a model is `most_recordings` of the registry. The time without the limit is
extrapolated from the last two sizes with a power law. If it is more than `--most-s` seconds, the
model is not trained, and the table has the extrapolated time with a ~.
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
REQUESTS = 1_000  #: number of predicted recordings
MODELS = "linear_plain,ridge_plain,knn_plain,svm_plain,boosting,forest,mlp,cnn,knn,svm,linear"


def peak_mb() -> float:
    """Return the peak memory of this process in MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6


def repeated(store: Path, target: str, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return features (count, bins), labels (count,) and grasps (count,) of repeated recordings."""
    table = read_store(store)
    labels = table.columns[target].values.astype(str)
    grasps = table.columns["grasp_id"].values.astype(str)
    labelled = np.flatnonzero(~np.isin(labels, ["", "nan"]))
    generator = np.random.default_rng(0)
    rows = generator.permutation(labelled)[np.arange(count) % len(labelled)]
    features = table.feature[rows]
    features *= 1 + NOISE * generator.standard_normal(features.shape, np.float32)
    return features, labels[rows], grasps[rows]


def cost_of(store: Path, target: str, model: str, count: int, limited: bool) -> dict[str, float]:
    """Return CPU times, memory and the number of training recordings of a model.

    `train_s` is the time of training, `predict_s` the time of REQUESTS predictions, and `memory_mb`
    the increase of peak memory.
    """
    features, y, grasp = repeated(store, target, count)
    limit = REGISTRY[model].most_recordings if limited else None
    memory_before = peak_mb()
    with threadpool_limits(limits=1):
        start = time.process_time()
        unfitted = make_model(model, "classification")
        if not limited and "search_rows" in unfitted.get_params():
            unfitted.set_params(search_rows=sys.maxsize)
        fitted = fit_model(unfitted, features, y, grasp, limit)
        trained = time.process_time()
        fitted.predict(features[:REQUESTS])
        predicted = time.process_time()
    return {
        "train_s": trained - start,
        "predict_s": predicted - trained,
        "memory_mb": peak_mb() - memory_before,
        "used": min(count, limit or count),
    }


def in_process(*arguments: object) -> dict[str, float]:
    """Return the result of `cost_of` in a new process."""
    texts = json.dumps([str(argument) for argument in arguments])
    command = [sys.executable, __file__, "--alone", texts]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def rows_of(
    store: Path, target: str, model: str, sizes: list[int], most_s: float
) -> list[tuple[str, ...]]:
    """Return a row of the table for each size."""
    free: dict[int, float] = {}  # time of training without a limit, by size
    rows = []
    for count in sizes:
        cost = in_process(store, target, model, count, "limited")
        used = int(cost["used"])
        expected = extrapolated(free, count)
        search_limit = getattr(make_model(model, "classification"), "search_rows", sys.maxsize)
        if used == count <= search_limit:  # no limit applies
            free[count] = cost["train_s"]
            without = ""
        elif expected is None or expected <= most_s:
            free[count] = in_process(store, target, model, count, "free")["train_s"]
            without = f"{free[count]:.3g}"
        else:
            without = f"~{expected:.2g}"
        row = (
            model,
            f"{count:,}",
            f"{used:,}",
            f"{cost['train_s']:.3g}",
            f"{cost['predict_s']:.2g}",
            f"{cost['memory_mb']:.0f}",
            without,
        )
        rows.append(row)
    return rows


def extrapolated(free: dict[int, float], count: int) -> float | None:
    """Return the time of training on `count` recordings by a power law through the last two sizes.

    `free` are measured times by size. Returns None for fewer than two sizes.
    """
    if len(free) < 2:
        return None
    (size, time_s), (last_size, last_time_s) = sorted(free.items())[-2:]
    exponent = np.log(last_time_s / time_s) / np.log(last_size / size)
    return last_time_s * (count / last_size) ** exponent


def main(
    store: Annotated[Path | None, typer.Argument(help="features of a data set")] = None,
    target: str = "object",
    models: str = MODELS,
    sizes: str = "500,5000,50000",
    most_s: float = 60.0,
    alone: Annotated[str, typer.Option(hidden=True)] = "",
) -> None:
    """Print one row per model and size."""
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
