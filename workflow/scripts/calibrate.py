"""Maps the names of rule `calibrate` to a call."""

from pathlib import Path

from ajgdata.pipeline.log import logged
from ajgdata.pipeline.rows import calibrate_task

params = snakemake.params
with logged(snakemake.log[0]):
    calibrate_task(
        Path(snakemake.input.store),
        **params.task,
        model=snakemake.wildcards.model,
        others=dict(zip(params.on, map(Path, snakemake.input.others), strict=True)),
        grasps=params.grasps,
        seed=params.seed,
        output=Path(snakemake.output.document),
    )
