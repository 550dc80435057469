"""Maps the names of rule `study` to a call."""

from pathlib import Path

from ajgdata.pipeline.log import logged
from ajgdata.pipeline.studies import run_study

with logged(snakemake.log[0]):
    run_study(
        snakemake.wildcards.study,
        Path(snakemake.output.tables),
        quick=snakemake.params.quick,
    )
