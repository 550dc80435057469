"""Maps the names of rule `store` to a call."""

from pathlib import Path

from ajgdata.pipeline.log import logged
from ajgdata.store.files import link_or_copy

with logged(snakemake.log[0]):
    link_or_copy(Path(snakemake.input[0]), Path(snakemake.output[0]))
