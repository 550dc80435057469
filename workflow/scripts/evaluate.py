"""Maps the names of rule `evaluate` to a call."""

from pathlib import Path

from ajgdata.pipeline.evaluate import evaluate_task
from ajgdata.pipeline.log import logged

task = dict(snakemake.params.task)
others = zip(task.pop("test_on"), map(Path, snakemake.input.others), strict=True)
with logged(snakemake.log[0]):
    evaluate_task(
        Path(snakemake.input.store),
        **task,
        others=dict(others),
        model=snakemake.wildcards.model,
        seed=snakemake.params.seed,
        metrics=Path(snakemake.output.metrics),
        cost=Path(snakemake.output.cost),
        predictions=Path(snakemake.output.predictions),
    )
