"""Maps the names of rule `page` to a call."""

from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.log import logged
from ajgdata.pipeline.pages import build_page
from ajgdata.report.navigation import parsed

with logged(snakemake.log[0]):
    build_page(
        Paths(),
        snakemake.wildcards.page,
        [Path(file) for file in snakemake.input],
        parsed(snakemake.params.nav),
    )
