"""Maps the names of the rules in embed.smk to calls."""

from pathlib import Path

from ajgdata.pipeline import embed, embed_measures, embed_transfer, projections
from ajgdata.pipeline.log import logged
from ajgdata.types import Embedding

calls = {
    "embed": embed.train_embedding,
    "embed_knn": embed_measures.knn_task,
    "embed_measure": embed_measures.measure_task,
    "embed_projections": projections.make_projections,
    "transfer": embed_transfer.transfer_task,
}
files = {**snakemake.input, **snakemake.output}
values = {name: value for name, value in snakemake.params.items() if name != "code"}
values["settings"] = Embedding.model_validate(values["settings"])
with logged(snakemake.log[0]):
    calls[snakemake.rule](**{name: Path(file) for name, file in files.items()}, **values)
