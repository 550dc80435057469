"""Maps the names of rule `ablate` to a call."""

from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.log import logged
from ajgdata.pipeline.studies import run_ablation

params = snakemake.params
with logged(snakemake.log[0]):
    run_ablation(
        Paths(),
        snakemake.wildcards.ablation,
        Path(snakemake.output.tables),
        seed=params.seed,
        quick=params.quick,
    )
