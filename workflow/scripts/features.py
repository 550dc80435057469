"""Maps the names of rule `features` to a call."""

from pathlib import Path

from ajgdata.pipeline.extract_features import extract_features
from ajgdata.pipeline.log import logged
from ajgdata.types import AudioSettings, FeatureSettings

with logged(snakemake.log[0]):
    extract_features(
        root=Path(snakemake.params.root),
        manifest=Path(snakemake.input.manifest),
        audio=AudioSettings(**snakemake.params.audio),
        features=FeatureSettings(**snakemake.params.features),
        code=snakemake.params.code,
        shard=Path(snakemake.output.shard),
        findings=Path(snakemake.output.findings),
        cache=Path(snakemake.params.cache),
    )
