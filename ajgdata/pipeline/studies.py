"""Studies of the virtual gripper, and ablations -> files of tables. Light: Snakemake imports it."""

from __future__ import annotations

import importlib
from pathlib import Path

from ajgdata.ablations import read_ablations
from ajgdata.paths import Paths
from ajgdata.store.provenance import layer_hash, software
from ajgdata.store.tables import write_tables
from ajgdata.types import NotPossibleError
from ajgdata.types.table import table_of

#: Modules of `ajgdata.studies`, in the order of the report.
STUDIES: tuple[str, ...] = ("verification", "stability", "accuracy", "omissions")
#: The verification is beside the tests, which assert the same claims on coarser grids.
VERIFICATION = "known_cases"


def study_hash(*files: str) -> str:
    """Return the hash of the code of all studies and of further `files`."""
    return layer_hash("studies", "pipeline/studies.py", *files)


def ablation_hash() -> str:
    """Return the hash of the code of all ablations."""
    return layer_hash("ablations", "pipeline/studies.py")


def run_study(name: str, out: Path, *, quick: bool = False) -> None:
    """Run the study `name` and write its tables, with what made them, to `out` (JSON).

    `quick`: coarser grids and fewer cases. The folder of the tests of the solver must be on the
    path of Python. Raises ValueError for a table whose rows do not have its columns.
    """
    module = VERIFICATION if name == "verification" else f"ajgdata.studies.{name}"
    tables = importlib.import_module(module).tables(quick)
    about = {**software(), "code": study_hash()}
    write_tables(out, tables, study=name, quick=quick, **about)


def run_ablation(paths: Paths, name: str, out: Path, *, seed: int, quick: bool = False) -> None:
    """Run the ablation `name` on the stores of its data sets and write its tables to `out` (JSON).

    Scenes that are simulated for it are kept as those of data sets are. `quick`: fewer grasps and
    the fastest model. Where data sets lack what it asks for, the reason is written instead.
    """
    from ajgdata.ablations.measure import measure

    try:
        tables = measure(paths, name, read_ablations(paths)[name], seed=seed, quick=quick)
    except NotPossibleError as error:  # too few grasps, say: a result, and the run goes on
        reason = {"reason": str(error)}
        tables = [table_of(name, f"Not made: {name}", [reason], reason="Reason")]
    about = {**software(), "code": ablation_hash()}
    write_tables(out, tables, study=name, quick=quick, **about)
