"""Studies of the virtual gripper, and ablations -> files of tables. Light: Snakemake imports it."""

from __future__ import annotations

import importlib
from pathlib import Path

from ajgdata.ablations import ABLATIONS, ablation
from ajgdata.paths import ABLATIONS_PAGE, Paths
from ajgdata.store.code_digest import OMISSIONS_TABLE, code_digest
from ajgdata.store.provenance import software
from ajgdata.store.tables import write_tables
from ajgdata.types import NotPossibleError
from ajgdata.types.table import table_of

#: Modules of `ajgdata.studies`, in the order of the report.
STUDIES: tuple[str, ...] = (
    "verification",
    "stability",
    "accuracy",
    "omissions",
    "acoustics",
    "materials",
    "effects",
)


def study_code(name: str) -> tuple[str, ...]:
    """Return what the tables of the study `name` follow from, for `code_digest`."""
    return (
        "ajgdata.pipeline.studies:run_study",
        f"ajgdata.studies.{name}:tables",
        OMISSIONS_TABLE,
    )


def ablation_code(name: str) -> tuple[str, ...]:
    """Return what the tables of the ablation `name` follow from, for `code_digest`."""
    entries = ("ajgdata.pipeline.studies:run_ablation", f"ajgdata.ablations.{name}:measure")
    return (*entries, OMISSIONS_TABLE)


def page_code(name: str) -> tuple[str, ...]:
    """Return what the page `name`, and its figures, follow from, for `code_digest`."""
    modules = [f"ajgdata.ablations.{one}" for one in ABLATIONS] if name == ABLATIONS_PAGE else []
    return ("ajgdata.pipeline.pages:build_page", *modules)


def run_study(name: str, out: Path, *, quick: bool = False) -> None:
    """Run the study `name` and write its tables, with what made them, to `out` (JSON).

    `quick`: coarser grids and fewer cases. Raises ValueError for a table whose rows do not have
    its columns.
    """
    tables = importlib.import_module(f"ajgdata.studies.{name}").tables(quick)
    code = code_digest(*study_code(name))
    write_tables(out, tables, study=name, quick=quick, code=code, **software())


def run_ablation(paths: Paths, name: str, out: Path, *, seed: int, quick: bool = False) -> None:
    """Run the ablation `name` on the stores of its data sets and write its tables to `out` (JSON).

    Scenes that are simulated for it are kept as those of data sets are. `quick`: fewer grasps and
    the fastest model. Where data sets lack what it asks for, the reason is written instead.
    """
    from ajgdata.ablations.data import AblationData

    try:
        tables = ablation(name).measure(AblationData(paths, seed=seed, quick=quick))
    except NotPossibleError as error:  # too few grasps, say: a result, and the run goes on
        reason = {"reason": str(error)}
        tables = [table_of(name, f"Not made: {name}", [reason], reason="Reason")]
    code = code_digest(*ablation_code(name))
    write_tables(out, tables, study=name, quick=quick, code=code, **software())
