"""Maps the names of rule `publish_dataset` to a call."""

from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.log import logged
from ajgdata.pipeline.publish import publish

with logged(snakemake.log[0]):
    publish(
        Paths(Path(snakemake.params.root)),
        snakemake.wildcards.dataset,
        Path(snakemake.params.tree),
        store=Path(snakemake.input.store),
        receipt=Path(snakemake.output.receipt),
    )
