"""Why simulation and paper differ: experiments, each of which could refute its hypothesis.

An ablation changes one thing (a setting of the scene, the split, what is trained on) and compares
errors on the same grasps before and after. Light: Snakemake imports it.
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence

from ajgdata.ablations.base import Ablation

#: Modules of this package, in the order of the page.
ABLATIONS = ("variance", "mirror", "grouped_vs_random", "repeatability", "materials", "noise")


def ablation(name: str) -> Ablation:
    """Return an ablation by name. Raises ValueError for an unknown one."""
    if name not in ABLATIONS:
        raise ValueError(f"there is no ablation {name!r}: choose among {', '.join(ABLATIONS)}")
    found: Ablation = importlib.import_module(f"ajgdata.ablations.{name}").ABLATION
    return found


def possible(simulated: Sequence[str]) -> list[str]:
    """Return the ablations whose data sets are all among `simulated`."""
    return [name for name in ABLATIONS if set(ablation(name).datasets) <= set(simulated)]
