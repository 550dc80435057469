"""Maps the names of the rules in embed.smk to calls: parameter `call` says which."""

from pathlib import Path

from ajgdata.pipeline import embed, embed_measures, embed_transfer, projections
from ajgdata.pipeline.log import logged
from ajgdata.types import Embedding

calls = [
    embed.train_embedding,
    embed_measures.knn_task,
    embed_measures.measure_task,
    embed_transfer.transfer_task,
    projections.make_projections,
]
call = {one.__name__: one for one in calls}[snakemake.params.call]
files = {**snakemake.input, **snakemake.output}
values = {name: value for name, value in snakemake.params.items() if name not in ("call", "code")}
values["settings"] = Embedding.model_validate(values["settings"])
with logged(snakemake.log[0]):
    call(**{name: Path(file) for name, file in files.items()}, **values)
