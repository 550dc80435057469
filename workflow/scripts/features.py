"""Maps the names of rule `features` to a call."""

from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.extract_features import extract_features
from ajgdata.pipeline.log import logged
from ajgdata.types import AudioSettings, FeatureSettings

paths = Paths()
with logged(snakemake.log[0]):
    extract_features(
        root=paths.root,
        manifest=Path(snakemake.input.manifest),
        audio=AudioSettings(**snakemake.params.audio),
        features=FeatureSettings(**snakemake.params.features),
        code=snakemake.params.code,
        shard=Path(snakemake.output.shard),
        findings=Path(snakemake.output.findings),
        cache=paths.shard_cache(snakemake.wildcards.dataset, snakemake.wildcards.session),
    )
