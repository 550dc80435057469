"""Maps the names of rule `acquire` to a call."""

from ajgdata.paths import Paths
from ajgdata.pipeline.acquire import acquire_virtual
from ajgdata.pipeline.log import logged
from ajgdata.pipeline.progress import lines

dataset, session = snakemake.wildcards.dataset, snakemake.wildcards.session
with logged(snakemake.log[0]):
    said = lines(f"recording {dataset}/{session}")
    done = acquire_virtual(Paths(), dataset, session, said)
    print(f"{done.recorded} recorded, {done.kept} already there, {done.solved} scenes solved")
    for grasp, reason in done.skipped.items():
        print(f"skipped {grasp}: {reason}")
