"""What UMAP compiles is kept between processes: without, each takes some ten seconds to do it."""

from __future__ import annotations

import contextlib
import sys
import warnings
from collections.abc import Iterable
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from umap import UMAP


def umap() -> type[UMAP]:
    """Return UMAP, whose functions numba keeps on disk once they are compiled, and which takes
    distances of pairs from `pair_distances`."""
    with warnings.catch_warnings():  # about TensorFlow, which only parametric UMAP needs
        warnings.filterwarnings("ignore", "Tensorflow not installed", ImportWarning)
        from umap import UMAP, umap_

    from ajgdata.embed import pair_distances

    umap_.pairwise_distances = pair_distances.pair_distances
    theirs = [m for n, m in sys.modules.items() if n.split(".")[0] in ("umap", "pynndescent")]
    keep_compiled([*theirs, pair_distances])
    return UMAP


def keep_compiled(modules: Iterable[ModuleType]) -> None:
    """Let numba keep on disk what it compiles of the functions in `modules`, which do not ask for
    it themselves: beside them or, where it may not write there, in the user's folder for caches.

    It compiles again when a function's file or numba changes.
    """
    from numba.core.dispatcher import Dispatcher

    found = {id(f): f for m in modules for f in vars(m).values() if isinstance(f, Dispatcher)}
    for function in found.values():
        if function.stats.cache_path is None:
            with contextlib.suppress(RuntimeError):  # nowhere to keep it
                function.enable_caching()
