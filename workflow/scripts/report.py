"""Maps the names of rule `report` to a call."""

from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.log import logged
from ajgdata.pipeline.report import build_report

with logged(snakemake.log[0]):
    build_report(
        Paths(Path(snakemake.params.root)),
        datasets=snakemake.params.datasets,
        runs=[tuple(run) for run in snakemake.params.runs],
        pages=snakemake.params.pages,
    )
