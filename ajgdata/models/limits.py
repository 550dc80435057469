"""How many recordings a model is trained on at most, because its cost would otherwise run away.

Support vectors and neighbours cost as the square of the recordings, and a choice among candidates
consists of many such fits. `types.registry.MODELS` gives the limit of each model; a task may set
other limits (`most_recordings` in dataset.yaml). `benchmarks/models.py` measures the cost of
training at a limit and beyond it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ajgdata.types import MODELS

#: Key of a task's limits for the recordings on which tuned models choose their settings.
CHOOSING = "choosing"


def most_recordings(name: str, declared: Mapping[str, int]) -> int | None:
    """Return the limit of a model of the registry; what a task has `declared` comes first.

    Plain and other variants of a model share its limit. None: it is trained on all recordings.
    """
    family = name.removesuffix("_plain").removesuffix("_one_scale")
    return declared.get(family, MODELS[name].most_recordings)


def thinned(groups: np.ndarray, most: int, target: np.ndarray | None = None) -> np.ndarray:
    """Return `most` sorted row numbers, equally many of every part, as far as possible.

    A part is a value of `target` (n,) in a group of `groups` (n,). The rows of a part are a random
    choice, which is the same each time; if some parts get a row more, these have all values alike.

    >>> from ajgdata.models.limits import thinned
    >>> groups = np.array([7, 7, 7, 7, 8, 8, 9])
    >>> groups[thinned(groups, 5)].tolist()
    [7, 7, 8, 8, 9]
    """
    import pandas as pd

    if most >= len(groups):
        return np.arange(len(groups))
    order = np.random.default_rng(0).permutation(len(groups))
    value = np.zeros(len(groups)) if target is None else np.asarray(target)
    rows = pd.DataFrame({"group": np.asarray(groups)[order], "value": value[order]})
    rows["round"] = rows.groupby(["group", "value"]).cumcount()
    rows["turn"] = rows.groupby(["round", "value"]).cumcount()
    return np.sort(order[rows.sort_values(["round", "turn"]).index[:most]])
