"""Maps the names of rule `draws_tables` to a call."""

from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.draws import draws_tables
from ajgdata.pipeline.log import logged

with logged(snakemake.log[0]):
    draws_tables(
        Paths(),
        Path(snakemake.input.table),
        Path(snakemake.input.about),
        Path(snakemake.output.tables),
    )
