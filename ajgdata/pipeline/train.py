"""Feature store -> a model trained on every recording of a task, for use on new ones."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ajgdata.evaluate.task_data import task_data
from ajgdata.store.features import read_store
from ajgdata.store.files import json_bytes, write_bytes
from ajgdata.store.models import ABOUT_FILE, write_estimator, write_network
from ajgdata.store.tables import plain
from ajgdata.types import Kind, NotPossibleError


def train_model(
    store: Path,
    *,
    target: str,
    kind: Kind,
    unit: str,
    groups: str,
    model: str,
    seed: int,
    folder: Path,
    period_deg: float | None = None,
) -> None:
    """Fit `model` on all recordings of `store` that have `target` and write it into `folder`.

    How well it will do on new recordings is what the evaluation says, not its fit to these. A model
    that cannot be trained is written as such with the reason.
    """
    from threadpoolctl import threadpool_limits

    from ajgdata.models import make_model, network_state

    shard = read_store(store)
    about: dict[str, Any] = {"target": target, "kind": kind, "unit": unit, "model": model}
    about |= {"period": period_deg, "seed": seed, "provenance": dict(shard.attrs)}
    try:
        features, values, _, names = task_data(shard, target, kind, groups)
        with threadpool_limits(limits=1):
            estimator = make_model(model, kind, seed, period_deg).fit(features, values)
    except NotPossibleError as error:
        write_bytes(folder / ABOUT_FILE, json_bytes({**about, "skipped": str(error)}))
        return
    about |= {"recordings": len(names), "frequency_hz": shard.frequency_hz}
    if state := network_state(estimator):
        arrays, about["network"] = state
        write_network(folder, arrays)
    else:
        write_estimator(folder, estimator)
    write_bytes(folder / ABOUT_FILE, json_bytes(plain(about)))
