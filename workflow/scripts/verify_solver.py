"""Runs the tests of rule `verify_solver`."""

from pathlib import Path

from ajgdata.pipeline.log import logged
from ajgdata.pipeline.verify import verify_solver

with logged(snakemake.log[0]):
    verify_solver(
        Path(snakemake.input.tests).parents[1],
        Path(snakemake.output.summary),
        log=Path(snakemake.log[0]),
    )
