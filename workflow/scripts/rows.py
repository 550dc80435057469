"""Maps the names of the rules in rows.smk to calls: parameter `call` says which."""

from pathlib import Path

from ajgdata.pipeline import rows
from ajgdata.pipeline.log import logged

names = dict(snakemake.wildcards.items())
with logged(snakemake.log[0]):
    getattr(rows, snakemake.params.call)(
        Path(snakemake.input.store),
        **snakemake.params.task,
        **snakemake.params.more,
        **{name: names[name] for name in names if name == "model"},
        output=Path(snakemake.output.document),
    )
