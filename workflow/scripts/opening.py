"""Maps the names of rule `opening` to a call."""

from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.log import logged
from ajgdata.pipeline.opening import build_opening
from ajgdata.types import AudioSettings

with logged(snakemake.log[0]):
    build_opening(
        Paths(),
        store=Path(snakemake.input.store),
        tables=[Path(file) for file in snakemake.input.tables],
        audio=AudioSettings(**snakemake.params.audio),
        code=snakemake.params.code,
    )
