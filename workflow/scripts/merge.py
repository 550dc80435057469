"""Maps the names of rule `merge` to a call."""

from pathlib import Path

from ajgdata.pipeline.log import logged
from ajgdata.pipeline.merge import merge
from ajgdata.types import Target

with logged(snakemake.log[0]):
    merge(
        dataset=snakemake.wildcards.dataset,
        shards=[Path(path) for path in snakemake.input.shards],
        labels=[Path(path) for path in snakemake.input.labels],
        findings=[Path(path) for path in snakemake.input.findings],
        targets={name: Target(**given) for name, given in snakemake.params.targets.items()},
        store=Path(snakemake.output.store),
        quarantine=Path(snakemake.output.quarantine),
    )
