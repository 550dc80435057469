"""Maps the names of rule `ablations_page` to a call."""

from ajgdata.paths import Paths
from ajgdata.pipeline.log import logged
from ajgdata.pipeline.pages import build_ablations_page

params = snakemake.params
with logged(snakemake.log[0]):
    build_ablations_page(Paths(), params.ablations, params.pages)
