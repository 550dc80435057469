"""Maps the names of rule `publish_dataset` to a call."""

from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.log import logged
from ajgdata.pipeline.publish import publish

paths, dataset = Paths(), snakemake.wildcards.dataset
with logged(snakemake.log[0]):
    publish(
        paths,
        dataset,
        paths.published(dataset),
        store=Path(snakemake.input.store),
    )
