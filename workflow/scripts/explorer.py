"""Maps the names of rule `explorer` to a call."""

from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.explorer import build_explorer
from ajgdata.pipeline.log import logged
from ajgdata.report.navigation import parsed

with logged(snakemake.log[0]):
    build_explorer(
        Path(snakemake.input.projections),
        dataset=snakemake.wildcards.dataset,
        embedding=snakemake.wildcards.embedding,
        paths=Paths(run=snakemake.params.run),
        page=Path(snakemake.output.page),
        nav=parsed(snakemake.params.nav),
    )
