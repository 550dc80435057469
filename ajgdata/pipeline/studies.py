"""Studies of the virtual gripper -> files of figures, and back. Light: Snakemake imports it."""

from __future__ import annotations

import importlib
from pathlib import Path

from ajgdata.store.code_digest import code_digest
from ajgdata.store.provenance import software
from ajgdata.store.tables import write_tables

#: Modules of `ajgdata.studies`, in the order of the report.
STUDIES: tuple[str, ...] = ("verification", "stability", "accuracy", "omissions", "materials")
#: Those that measure run time: nothing else shall run beside them.
TIMED = ("accuracy", "omissions")
GALLERY = "gallery"
#: The function that makes the gallery.
GALLERY_CODE = "ajgdata.pipeline.pages:build_gallery"
EMBEDDING = "embedding"
#: The function that makes the page on embeddings.
EMBEDDING_CODE = "ajgdata.pipeline.embed_page:build_embedding_page"


def study_code(name: str) -> tuple[str, ...]:
    """Return what the tables of the study `name` follow from, for `code_digest`."""
    return ("ajgdata.pipeline.studies:run_study", f"ajgdata.studies.{name}:tables")


def run_study(name: str, out: Path, *, quick: bool = False) -> None:
    """Run the study `name` and write its tables, with what made them, to `out` (JSON).

    `quick`: coarser grids and fewer cases. Raises ValueError for a table whose rows do not have
    its columns.
    """
    tables = importlib.import_module(f"ajgdata.studies.{name}").tables(quick)
    code = code_digest(*study_code(name))
    write_tables(out, tables, study=name, quick=quick, code=code, **software())
