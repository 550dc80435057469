"""Maps the names of rule `merge` to a call."""

from pathlib import Path

from ajgdata.pipeline.log import logged
from ajgdata.pipeline.merge import merge
from ajgdata.pipeline.progress import tell
from ajgdata.store.findings import read_findings
from ajgdata.types import Target, left_out

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
    quarantine = Path(snakemake.output.quarantine)
    if excluded := left_out(read_findings(quarantine)):
        dataset = snakemake.wildcards.dataset
        tell(f"left out  {len(excluded)} of {dataset}: {quarantine} says why")
