"""Studies of the virtual gripper -> files of figures, and back. Light: Snakemake imports it."""

from __future__ import annotations

import importlib
from pathlib import Path

from ajgdata.store.provenance import code_digest, software
from ajgdata.store.tables import write_tables

#: Modules of `ajgdata.studies`, in the order of the report.
STUDIES: tuple[str, ...] = ("verification", "stability", "accuracy", "omissions", "materials")
#: Those that measure run time: nothing else shall run beside them.
TIMED = ("accuracy", "omissions")
GALLERY = "gallery"
#: What the gallery and the studies' figures depend on.
GALLERY_CODE = ("gripper", "report", "pipeline/pages", "pipeline/show")
STUDY_CODE = ("gripper", "studies", "features", "types", "pipeline/studies")


def run_study(name: str, out: Path, *, quick: bool = False) -> None:
    """Run the study `name` and write its tables, with what made them, to `out` (JSON).

    `quick`: coarser grids and fewer cases. Raises ValueError for a table whose rows do not have
    its columns.
    """
    tables = importlib.import_module(f"ajgdata.studies.{name}").tables(quick)
    code = code_digest(*STUDY_CODE)
    write_tables(out, tables, study=name, quick=quick, code=code, **software())
