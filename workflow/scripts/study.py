"""Maps the names of rule `study` to a call."""

import sys
from pathlib import Path

from ajgdata.pipeline.log import logged
from ajgdata.pipeline.studies import run_study

sys.path.append(snakemake.params.tests)
with logged(snakemake.log[0]):
    run_study(
        snakemake.wildcards.study,
        Path(snakemake.output.tables),
        quick=snakemake.params.quick,
    )
