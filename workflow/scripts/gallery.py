"""Maps the names of rule `gallery` to a call."""

from ajgdata.paths import Paths
from ajgdata.pipeline.log import logged
from ajgdata.pipeline.pages import build_gallery

with logged(snakemake.log[0]):
    build_gallery(Paths(), snakemake.params.pages, quick=snakemake.params.quick)
