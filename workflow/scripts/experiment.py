"""Maps the names of rule `experiment` to a call."""

from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.experiments import run_experiment
from ajgdata.pipeline.log import logged
from ajgdata.pipeline.rendering import new_grasps_of, renderer
from ajgdata.types import AudioSettings, FeatureSettings

params, wildcards = snakemake.params, snakemake.wildcards
with logged(snakemake.log[0]):
    simulated = (Paths(), wildcards.dataset) if params.rendered else None
    run_experiment(
        Path(snakemake.input.store),
        kind=wildcards.kind,
        dataset=wildcards.dataset,
        task=wildcards.task,
        settings=params.settings,
        split=params.split,
        others=dict(zip(params.others, map(Path, snakemake.input.others), strict=True)),
        audio=AudioSettings(**params.audio),
        features=FeatureSettings(**params.features),
        paths=Paths(),
        encoders=[Path(path) for path in snakemake.input.encoders],
        render=renderer(*simulated) if simulated else None,
        new_grasps=new_grasps_of(*simulated) if simulated else None,
        seed=params.seed,
        tables=Path(snakemake.output.tables),
        cost=Path(snakemake.output.cost),
    )
