"""An even subset of recordings, for models that use only a limited number."""

from __future__ import annotations

import numpy as np
import pandas as pd


def thinned(groups: np.ndarray, limit: int, target: np.ndarray | None = None) -> np.ndarray:
    """Return `limit` sorted row numbers, equally many of every part, as far as possible.

    A part is a value of `target` (n,) in a group of `groups` (n,). The rows of a part are a random
    choice, which is the same each time; if some parts get a row more, these have all values alike.

    >>> import numpy as np
    >>> from ajgdata.models.thinning import thinned
    >>> groups = np.array([7, 7, 7, 7, 8, 8, 9])
    >>> groups[thinned(groups, 5)].tolist()
    [7, 7, 8, 8, 9]
    """
    if limit >= len(groups):
        return np.arange(len(groups))
    order = np.random.default_rng(0).permutation(len(groups))
    value = np.zeros(len(groups)) if target is None else np.asarray(target)
    rows = pd.DataFrame({"group": np.asarray(groups)[order], "value": value[order]})
    rows["round"] = rows.groupby(["group", "value"]).cumcount()
    rows["turn"] = rows.groupby(["round", "value"]).cumcount()
    return np.sort(order[rows.sort_values(["round", "turn"]).index[:limit]])
