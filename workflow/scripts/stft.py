"""Maps the names of rule `stft` to a call."""

from pathlib import Path

from ajgdata.pipeline.log import logged
from ajgdata.pipeline.stft import stft_task
from ajgdata.types import AudioSettings, FeatureSettings

params = snakemake.params
with logged(snakemake.log[0]):
    stft_task(
        Path(snakemake.input.store),
        **params.task,
        root=Path(params.root),
        manifests=[Path(path) for path in snakemake.input.manifests],
        audio=AudioSettings(**params.audio),
        settings=[FeatureSettings(**one) for one in params.settings],
        models=params.models,
        seed=params.seed,
        output=Path(snakemake.output.document),
        cost=Path(snakemake.output.cost),
    )
