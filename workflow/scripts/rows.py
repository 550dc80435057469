"""Maps the names of rules `curve`, `permute`, `sort` and `energy` to calls."""

from pathlib import Path

from ajgdata.pipeline import rows
from ajgdata.pipeline.log import logged

names = dict(snakemake.wildcards.items())
with logged(snakemake.log[0]):
    getattr(rows, f"{snakemake.rule}_task")(
        Path(snakemake.input.store),
        **snakemake.params.task,
        **snakemake.params.more,
        **{name: names[name] for name in names if name == "model"},
        output=Path(snakemake.output.document),
    )
