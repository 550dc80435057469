"""Studies of the virtual gripper, and ablations -> files of tables. Light: Snakemake imports it."""

from __future__ import annotations

import importlib
from pathlib import Path

from ajgdata.ablations import read_ablations
from ajgdata.models.device import device_facts
from ajgdata.paths import Paths
from ajgdata.store.provenance import software
from ajgdata.store.tables import write_tables
from ajgdata.types import NotPossibleError
from ajgdata.types.table import table_of

#: Modules of `ajgdata.studies`, in the order of the report.
STUDIES: tuple[str, ...] = ("verification", "validation", "stability", "accuracy", "omissions")
#: Studies of the first target: error against run time, stability, and what is left out.
REQUESTED_STUDIES = STUDIES[2:]
#: Page on all ablations: why simulation and paper differ.
ABLATIONS_PAGE = "ablations"


def run_study(study: str, tables: Path, *, code: str, quick: bool = False) -> None:
    """Run a study and write its tables and their provenance to `tables` (JSON).

    `quick` selects coarser grids and fewer cases. Raises ValueError for a table whose rows do not
    have its columns.
    """
    results = importlib.import_module(f"ajgdata.studies.{study}").tables(quick)
    write_tables(tables, results, study=study, quick=quick, code=code, **software())


def run_ablation(paths: Paths, ablation: str, tables: Path, *, code: str, seed: int) -> None:
    """Run an ablation on the stores of its data sets and write its results to `tables` (JSON).

    Scenes that are simulated for it are kept as those of data sets are. If data sets lack what it
    asks for, the reason is written instead.
    """
    from ajgdata.ablations.measure import measure, measure_grid

    try:
        settings = read_ablations(paths)[ablation]
        results = [measure(paths, ablation, settings, seed=seed)]
        if settings.grid is not None:
            results.append(measure_grid(paths, settings, settings.grid, seed=seed))
    except NotPossibleError as error:  # for example too few grasps
        reason = {"reason": str(error)}
        results = [table_of(ablation, f"Not made: {ablation}", [reason], reason="Reason")]
    about = {**software(), "code": code, **device_facts()}
    write_tables(tables, results, study=ablation, quick=False, **about)
