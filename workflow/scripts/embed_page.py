"""Maps the names of rules `explorer` and `report_embedding` to calls."""

from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.embed_page import build_embedding_page, build_explorer
from ajgdata.pipeline.log import logged

paths, files = Paths(Path(snakemake.params.root)), snakemake.input
with logged(snakemake.log[0]):
    if "embedding" in dict(snakemake.wildcards.items()):
        names = snakemake.wildcards.dataset, snakemake.wildcards.embedding
        build_explorer(paths, *names, [Path(file) for file in files.manifests])
    else:
        embeddings = [tuple(one) for one in snakemake.params.embeddings]
        build_embedding_page(paths, embeddings, snakemake.params.pages)
