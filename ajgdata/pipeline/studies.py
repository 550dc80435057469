"""The jobs of simulation studies: names, and tables in files. Light: Snakemake imports this."""

from __future__ import annotations

import importlib
from pathlib import Path

from ajgdata.store.provenance import software
from ajgdata.store.tables import write_tables

#: Modules of `ajgdata.studies`, in the order of the report.
STUDIES: tuple[str, ...] = ("verification", "validation", "stability", "accuracy", "omissions")
#: Studies of the default target: stability, error against run time, and omitted parts.
REQUESTED_STUDIES = STUDIES[2:]


def run_study(study: str, tables: Path, *, code: str, quick: bool = False) -> None:
    """Run a study and write its tables and their provenance to `tables` (JSON).

    `quick` selects coarser grids and fewer cases. Raises ValueError for a table whose rows do not
    have its columns.
    """
    results = importlib.import_module(f"ajgdata.studies.{study}").tables(quick)
    write_tables(tables, results, study=study, quick=quick, code=code, **software())
