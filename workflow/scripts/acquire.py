"""Maps the names of rule `acquire` to a call."""

from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.acquire import acquire_virtual
from ajgdata.pipeline.log import logged

with logged(snakemake.log[0]):
    acquire_virtual(
        Paths(Path(snakemake.params.root)), snakemake.wildcards.dataset, snakemake.wildcards.session
    )
