"""Registry of experiments: specifications by name, and the modules that measure and draw them.

The experiments of this package are in `built_in`. Installed packages add experiments by entry
points (docs/examples/own_experiment_package). Light: Snakemake imports this.
"""

from __future__ import annotations

import functools
import importlib
import inspect
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING

from ajgdata.experiments.built_in import BUILT_IN
from ajgdata.experiments.spec import ExperimentSpec
from ajgdata.paths import PACKAGE
from ajgdata.store.code_hash import CodeSource, used_sources, with_own_imports
from ajgdata.types.registry import Registry

if TYPE_CHECKING:
    from ajgdata.experiments.base import Experiment

EXPERIMENTS: Registry[ExperimentSpec] = Registry("experiment", BUILT_IN)
#: Experiments of other packages by name.
OWN_EXPERIMENTS: dict[str, Experiment] = {}
for _point in entry_points(group="ajgdata.experiments"):
    _own = _point.load()
    if not inspect.isfunction(inspect.unwrap(_own.measure)):
        _problem = f"`measure` of the experiment {_own.spec.name!r} is not a function"
        raise ImportError(f"package {_point.module}: {_problem}")
    EXPERIMENTS.add(_own.spec.name, _own.spec, _point)
    OWN_EXPERIMENTS[_own.spec.name] = _own


def load_experiment(name: str) -> Experiment:
    """Return an experiment; the module of an experiment of this package is imported."""
    if name in OWN_EXPERIMENTS:
        return OWN_EXPERIMENTS[name]
    experiment: Experiment = importlib.import_module(f"ajgdata.experiments.{name}").EXPERIMENT
    return experiment


@functools.cache
def measuring_half(name: str) -> tuple[CodeSource, ...]:
    """Return the sources that decide what an experiment measures, without importing its module.

    An edit of its drawing half changes no result.
    """
    if name in OWN_EXPERIMENTS:
        own = OWN_EXPERIMENTS[name]
        return used_sources(_file_of(own), inspect.unwrap(own.measure).__name__)
    return used_sources(PACKAGE / "experiments" / f"{name}.py", "measure")


def own_experiment_files() -> list[Path]:
    """Return the files of experiments of other packages, with what they import from there."""
    return with_own_imports(_file_of(experiment) for experiment in OWN_EXPERIMENTS.values())


def _file_of(experiment: Experiment) -> Path:
    """Return the file with the function `measure` of an experiment."""
    return Path(str(inspect.getsourcefile(inspect.unwrap(experiment.measure))))
