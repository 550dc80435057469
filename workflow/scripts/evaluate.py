"""Maps the names of rule `evaluate` to a call."""

from pathlib import Path

from ajgdata.pipeline.evaluate import evaluate_task
from ajgdata.pipeline.log import logged

with logged(snakemake.log[0]):
    evaluate_task(
        Path(snakemake.input.store),
        **snakemake.params.task,
        model=snakemake.wildcards.model,
        seed=snakemake.params.seed,
        metrics=Path(snakemake.output.metrics),
        cost=Path(snakemake.output.cost),
        predictions=Path(snakemake.output.predictions),
    )
