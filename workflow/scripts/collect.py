"""Maps the names of rule `collect` to a call."""

from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.collect import collect
from ajgdata.pipeline.log import logged

with logged(snakemake.log[0]):
    collect(
        Paths(run=snakemake.params.run),
        [tuple(one) for one in snakemake.params.documents],
        document=Path(snakemake.output.document),
        table=Path(snakemake.output.table),
        predictions=Path(snakemake.output.predictions),
    )
