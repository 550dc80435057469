"""Subset of recordings for models that are trained on a limited number."""

from __future__ import annotations

import numpy as np
import pandas as pd


def thinned(groups: np.ndarray, limit: int, target: np.ndarray | None = None) -> np.ndarray:
    """Return `limit` sorted row numbers, with equal numbers of all parts as far as possible.

    A part has the rows with one value of `target` (n,) or (n, k) in one group of `groups` (n,). The
    rows of a part are drawn at random, with a fixed seed. If `limit` is not a multiple of the
    number of parts, the additional rows are spread over the values of the target. All rows are
    returned if there are at most `limit`.

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
    if value.ndim > 1:
        value = np.unique(value, axis=0, return_inverse=True)[1].reshape(-1)
    rows = pd.DataFrame({"group": np.asarray(groups)[order], "value": value[order]})
    # round: number of the row in its part; turn: number of the row among those of its value in
    # this round
    rows["round"] = rows.groupby(["group", "value"]).cumcount()
    rows["turn"] = rows.groupby(["round", "value"]).cumcount()
    first = rows.sort_values(["round", "turn"]).index[:limit]
    return np.sort(order[first])
