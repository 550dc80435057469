"""Drawn grippers -> one file each, one table of all, and tables beside the paper. Light to import:
the workflow does."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.store.code_digest import code_digest
from ajgdata.store.files import (
    csv_bytes,
    json_bytes,
    read_csv,
    read_json,
    sha256_of,
    write_bytes,
)
from ajgdata.store.provenance import software
from ajgdata.store.report_files import read_paper, report_file
from ajgdata.store.sessions import read_dataset
from ajgdata.store.tables import plain, write_tables
from ajgdata.types import DataError, NotPossibleError
from ajgdata.types.table import table_of

#: The page, and the folder of `reports/` that keeps what it is made of.
DRAWS = "draws"
#: Of a whole sweep, kept with the sources as it takes hours: tables, of draws, and what made them.
KEPT = (f"{DRAWS}/tables.json", f"{DRAWS}/draws.csv", f"{DRAWS}/draws.json")


def draw_code() -> tuple[str, ...]:
    """Return what a draw follows from, for `code_digest`."""
    return ("ajgdata.pipeline.draws:run_draw",)


def tables_code() -> tuple[str, ...]:
    """Return what the tables beside the paper follow from, for `code_digest`."""
    return ("ajgdata.pipeline.draws:draws_tables",)


def sampled() -> tuple[str, ...]:
    """Return the data sets that a draw takes after."""
    from ajgdata.draws.rows import datasets_of

    return tuple(datasets_of())


def kept_files(paths: Paths) -> list[Path]:
    """Return the files of the sweep that is kept in `reports/`, its tables first; or none."""
    found = [report_file(paths, name) for name in KEPT]
    whole = all(path.is_file() for path in found) and len({path.parent for path in found}) == 1
    return found if whole else []


def run_draw(
    paths: Paths, name: str, count: int, out: Path, cost: Path, *, quick: bool = False
) -> None:
    """Measure the draw `name` of `count`, or DEFAULT; write its readings to `out`, cost to `cost`.

    Raises DataError for a project without the data sets that it takes after.
    """
    from ajgdata.draws import DEFAULT, draw_names
    from ajgdata.draws.measuring import measure_default, measure_draw
    from ajgdata.draws.sweep import as_json

    specs = {one: read_dataset(paths, one) for one in sampled()}
    if name == DEFAULT:
        draw = measure_default(specs, count, quick=quick)
    else:
        draw = measure_draw(specs, draw_names(count).index(name), count, quick=quick)
    write_bytes(out, json_bytes(as_json(draw)))
    write_bytes(cost, json_bytes({"cpu_s": draw.seconds, **software()}))


def join_draws(
    draws: Sequence[Path], costs: Sequence[Path], table: Path, about: Path, *, quick: bool
) -> None:
    """Write the table of all draws (CSV), the same bytes each time, and what made it.

    The last is the default gripper, which is no draw.
    """
    from ajgdata.draws.sampling import SEED
    from ajgdata.draws.sweep import joined

    read = [read_json(path) for path in draws]
    spent = [read_json(path) for path in costs]
    header, rows = joined(read)
    write_bytes(table, csv_bytes(header, rows))
    content = {
        "command": f"snakemake draws --config draws={len(draws) - 1}" + (" quick=True" * quick),
        "git_commit": sorted({one["git_commit"] for one in spent}),
        "code": code_digest(*draw_code()),
        "seed": SEED,
        "draws": len(draws) - 1,
        "quick": quick,
        "cpu_s": round(sum(one["cpu_s"] for one in spent)),
        "missing": {one["name"]: one["missing"] for one in read if one["missing"]},
    }
    write_bytes(about, json_bytes(content))


def draws_tables(paths: Paths, table: Path, about: Path, out: Path) -> None:
    """Write the tables of a kept sweep beside the paper to `out` (JSON).

    Where there are too few draws the reason is written instead. Raises DataError for a table that
    no sweep wrote, or one of other parameters.
    """
    from ajgdata.draws.sweep import Sweep
    from ajgdata.draws.tables import sweep_tables
    from ajgdata.report.paper import parse_paper

    made = read_json(about)
    targets = {name: one.value for name, one in parse_paper(read_paper(paths)).items()}
    try:
        tables = sweep_tables(Sweep.of(read_csv(table, ["draw"])[1]), targets)
    except NotPossibleError as error:
        tables = [table_of(DRAWS, "Not made: draws", [{"reason": str(error)}], reason="Reason")]
    except (KeyError, ValueError) as error:
        fix = f"make it again: {made.get('command', 'snakemake draws')}"
        raise DataError(table, f"is not of today's draws ({error})", fix) from None
    commits = " ".join(made.get("git_commit", []))
    about_all = {"study": DRAWS, "quick": made["quick"], "command": made["command"]}
    known = {
        **software(),
        "of_sha256": sha256_of(table.read_bytes()),
        "code": made["code"],
        "git_commit": commits,
        "seed": made["seed"],
    }
    write_tables(out, tables, **plain({**known, **about_all, "cpu_s": made["cpu_s"]}))
