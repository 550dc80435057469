"""Maps the names of rule `ablate` to a call."""

from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.ablations import run_ablation
from ajgdata.pipeline.log import logged

params = snakemake.params
with logged(snakemake.log[0]):
    run_ablation(
        Paths(),
        snakemake.wildcards.ablation,
        Path(snakemake.output.tables),
        seed=params.seed,
        quick=params.quick,
    )
