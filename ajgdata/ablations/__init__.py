"""Why simulation and paper differ: experiments, each of which could refute its hypothesis.

An ablation is a file `reports/ablations/<name>.yaml`: variants of one evaluation on the same
grasps, and hypotheses on their differences. Light: Snakemake imports it.
"""

from __future__ import annotations

from collections.abc import Collection

from pydantic import ValidationError

from ajgdata.paths import Paths
from ajgdata.store.files import read_yaml
from ajgdata.types import describe
from ajgdata.types.ablation import Ablation


def read_ablations(paths: Paths) -> dict[str, Ablation]:
    """Return the ablations of a project by name. Raises DataError for a file that is wrong."""
    ablations = {}
    for file in sorted(paths.ablation_settings.glob("*.yaml")):
        try:
            ablations[file.stem] = Ablation.model_validate(read_yaml(file))
        except ValidationError as error:
            raise describe(error, str(file)) from None
    return ablations


def possible(paths: Paths, simulated: Collection[str]) -> dict[str, Ablation]:
    """Return the ablations whose data sets are all among `simulated`."""
    read = read_ablations(paths).items()
    return {name: one for name, one in read if set(one.datasets) <= set(simulated)}
