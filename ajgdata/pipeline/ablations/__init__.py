"""Why simulation and paper differ: experiments, each of which could refute its hypothesis.

An ablation changes one thing (a setting of the scene, the split, what is trained on) and compares
errors on the same grasps before and after. Light: Snakemake imports it.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from ajgdata.paths import Paths
from ajgdata.store.code_digest import code_digest
from ajgdata.store.provenance import software
from ajgdata.store.tables import write_tables


class Ablation(NamedTuple):
    """A module of this package: the data sets that it needs, in the order of its questions."""

    datasets: tuple[str, ...]


#: By module, in the order of the page.
ABLATIONS: Mapping[str, Ablation] = {
    "mirror": Ablation(("orientation",)),
    "copies": Ablation(("ycb",)),
    "repeatability": Ablation(("ycb", "size")),
    "materials": Ablation(("sphere80", "plate")),
    "noise": Ablation(("size", "size_60dba", "size_70dba", "size_80dba", "size_90dba")),
}


def ablation_code(name: str) -> tuple[str, ...]:
    """Return what the tables of the ablation `name` follow from, for `code_digest`."""
    package = "ajgdata.pipeline.ablations"
    return (f"{package}:run_ablation", f"{package}.{name}:tables")


def possible(simulated: Sequence[str]) -> list[str]:
    """Ablations whose data sets are all among `simulated`."""
    return [name for name, one in ABLATIONS.items() if set(one.datasets) <= set(simulated)]


def run_ablation(paths: Paths, name: str, out: Path, *, seed: int, quick: bool = False) -> None:
    """Run the ablation `name` on the stores of its data sets and write its tables to `out` (JSON).

    Scenes that are simulated for it are kept as those of data sets are. `quick`: fewer grasps and
    the fastest model. Where data sets lack what it asks for, the reason is written instead.
    """
    from ajgdata.pipeline.ablations.bench import Bench
    from ajgdata.types.table import Column, Table, Value

    module = importlib.import_module(f"ajgdata.pipeline.ablations.{name}")
    try:
        tables = module.tables(Bench(paths, seed=seed, quick=quick))
    except ValueError as error:  # too few grasps, say: a result, and the run goes on
        row: dict[str, Value] = {"reason": str(error)}
        tables = [Table(name, f"Not made: {name}", "", (Column("reason", "Reason"),), (row,))]
    code = code_digest(*ablation_code(name))
    write_tables(out, tables, study=name, quick=quick, code=code, **software())
