"""Maps the names of rule `store` to a call."""

from pathlib import Path

from ajgdata.pipeline.log import logged
from ajgdata.store.files import copy

with logged(snakemake.log[0]):
    # Snakemake gives what it made a new time, which a link would give the merged store, too.
    copy(Path(snakemake.input[0]), Path(snakemake.output[0]))
