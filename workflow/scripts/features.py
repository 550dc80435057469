"""Maps the names of rule `features` to a call."""

from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.extract_features import extract_features
from ajgdata.pipeline.log import logged
from ajgdata.types import AudioSettings, FeatureSettings

wildcards, output = snakemake.wildcards, snakemake.output
with logged(snakemake.log[0]):
    extract_features(
        folder=Paths().session(wildcards.dataset, wildcards.session),
        audio=AudioSettings(**snakemake.params.audio),
        features=FeatureSettings(**snakemake.params.features),
        code=snakemake.params.code,
        shard=Path(output.shard),
        findings=Path(output.findings),
        labels=Path(output.labels),
    )
