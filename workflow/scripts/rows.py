"""Maps the names of rules `curve`, `permute` and `sort` to calls."""

from pathlib import Path

from ajgdata.pipeline import rows
from ajgdata.pipeline.log import logged

calls = {"curve": rows.curve_task, "permute": rows.permute_task, "sort": rows.sort_task}
names = dict(snakemake.wildcards.items())
with logged(snakemake.log[0]):
    calls[snakemake.rule](
        Path(snakemake.input.store),
        **snakemake.params.task,
        **snakemake.params.more,
        **{name: names[name] for name in names if name == "model"},
        seed=snakemake.params.seed,
        output=Path(snakemake.output.document),
    )
