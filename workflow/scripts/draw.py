"""Maps the names of rule `draw` to a call."""

from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.draws import run_draw
from ajgdata.pipeline.log import logged

with logged(snakemake.log[0]):
    run_draw(
        Paths(),
        snakemake.wildcards.draw,
        snakemake.params.of,
        Path(snakemake.output.draw),
        Path(snakemake.output.cost),
        quick=snakemake.params.quick,
    )
