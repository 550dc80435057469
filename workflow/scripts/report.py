"""Maps the names of rules `report` and `report_alone` to a call."""

from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.log import logged
from ajgdata.pipeline.progress import tell
from ajgdata.pipeline.report import build_report
from ajgdata.report.navigation import parsed

with logged(snakemake.log[0]):
    build_report(
        Paths(run=snakemake.params.run),
        datasets=snakemake.params.datasets,
        tasks=[tuple(task) for task in snakemake.params.tasks],
        page=Path(snakemake.output.page),
        nav=parsed(snakemake.params.nav),
        pages=snakemake.params.pages,
        ablations=snakemake.params.ablations,
        published=snakemake.params.published,
        opening=Paths().opening if snakemake.params.opening else None,
    )
    tell(f"report: {snakemake.output.page}")
