"""Maps the names of rule `join_draws` to a call."""

from pathlib import Path

from ajgdata.pipeline.draws import join_draws
from ajgdata.pipeline.log import logged

with logged(snakemake.log[0]):
    join_draws(
        [Path(file) for file in snakemake.input.draws],
        [Path(file) for file in snakemake.input.costs],
        Path(snakemake.output.table),
        Path(snakemake.output.about),
        quick=snakemake.params.quick,
    )
