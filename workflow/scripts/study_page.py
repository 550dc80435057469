"""Maps the names of rule `study_page` to a call."""

from ajgdata.paths import Paths
from ajgdata.pipeline.log import logged
from ajgdata.pipeline.pages import build_study_page

with logged(snakemake.log[0]):
    build_study_page(Paths(), snakemake.wildcards.study, snakemake.params.pages)
