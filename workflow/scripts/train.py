"""Maps the names of rule `train` to a call."""

from pathlib import Path

from ajgdata.pipeline.log import logged
from ajgdata.pipeline.train import train_model

with logged(snakemake.log[0]):
    train_model(
        Path(snakemake.input.store),
        **snakemake.params.task,
        task=snakemake.wildcards.task,
        model=snakemake.wildcards.model,
        seed=snakemake.params.seed,
        folder=Path(snakemake.output.folder),
    )
