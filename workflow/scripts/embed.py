"""Maps the names of rule `embed` to a call."""

from pathlib import Path

from ajgdata.pipeline.embed import train_embedding
from ajgdata.pipeline.log import logged
from ajgdata.types import Embedding

output, params = snakemake.output, snakemake.params
with logged(snakemake.log[0]):
    train_embedding(
        Path(snakemake.input.store),
        settings=Embedding.model_validate(params.settings),
        seed=params.seed,
        latents=Path(output.latents),
        cost=Path(output.cost),
    )
