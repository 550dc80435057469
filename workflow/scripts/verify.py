"""Runs the tests of rule `verify` on what was built."""

from pathlib import Path

from ajgdata.pipeline.log import logged
from ajgdata.pipeline.verify import verify

with logged(snakemake.log[0]):
    verify(Path(snakemake.params.tests), Path(snakemake.output[0]))
