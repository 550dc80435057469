"""Maps the names of rule `collect` to a call."""

from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.collect import collect
from ajgdata.pipeline.log import logged

params = snakemake.params
with logged(snakemake.log[0]):
    collect(
        Paths(Path(params.root)),
        runs=[tuple(run) for run in params.runs],
        curves=[tuple(run) for run in params.curves],
        permuted=[tuple(task) for task in params.permuted],
        stfts=[tuple(task) for task in params.stfts],
        sorting=[tuple(run) for run in params.sorting],
        document=Path(snakemake.output.document),
        table=Path(snakemake.output.table),
    )
