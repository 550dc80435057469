"""Maps the names of rule `features` to a call."""

from pathlib import Path

from ajgdata.pipeline.log import logged
from ajgdata.pipeline.shard import make_shard
from ajgdata.types import AudioSettings, FeatureSettings

with logged(snakemake.log[0]):
    make_shard(
        root=Path(snakemake.params.root),
        manifest=Path(snakemake.input.manifest),
        audio=AudioSettings(**snakemake.params.audio),
        features=FeatureSettings(**snakemake.params.features),
        code=snakemake.params.code,
        shard=Path(snakemake.output.shard),
        findings=Path(snakemake.output.findings),
        cache=Path(snakemake.params.cache),
    )
