"""Maps the names of rule `train` to a call."""

from pathlib import Path

from ajgdata.pipeline.log import logged
from ajgdata.pipeline.progress import lines
from ajgdata.pipeline.train import train_models

params = snakemake.params
with logged(snakemake.log[0]):
    train_models(
        Path(snakemake.input.store),
        tasks=params.tasks,
        seed=params.seed,
        folder=Path(snakemake.output.folder),
        progress=lines(f"models of {snakemake.wildcards.dataset}", parts=4),
    )
