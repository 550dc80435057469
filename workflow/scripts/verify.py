"""Runs the tests of rule `verify` on what was built."""

from pathlib import Path

from ajgdata.pipeline.log import logged
from ajgdata.pipeline.verify import verify

with logged(snakemake.log[0]):
    verify(
        Path(snakemake.input.tests).parents[1],
        Path(snakemake.output.summary),
        run=snakemake.params.run,
        log=Path(snakemake.log[0]),
    )
