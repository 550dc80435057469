"""Maps the names of rule `complete` to a call."""

from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.log import logged
from ajgdata.pipeline.run_summary import complete
from ajgdata.store.sessions import read_dataset

with logged(snakemake.log[0]):
    paths = Paths(run=snakemake.params.run)
    complete(
        paths,
        {name: read_dataset(paths, name) for name in snakemake.params.datasets},
        [tuple(key) for key in snakemake.params.documents],
        Path(snakemake.output.summary),
    )
