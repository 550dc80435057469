"""Maps the names of rules `report` and `experiment` to a call."""

from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.log import logged
from ajgdata.pipeline.report import build_report

with logged(snakemake.log[0]):
    build_report(
        Paths(),
        datasets=snakemake.params.datasets,
        tasks=[tuple(task) for task in snakemake.params.tasks],
        page=Path(snakemake.output.page),
        embeddings=[tuple(one) for one in snakemake.params.embeddings],
        pages=snakemake.params.pages,
        ablations=snakemake.params.ablations,
        published=snakemake.params.published,
    )
