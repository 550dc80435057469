"""One draw: its gripper, recorded and read row by row."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ajgdata.draws import DEFAULT, draw_names
from ajgdata.draws.readings import Reading, models_for, readings_of
from ajgdata.draws.recordings import recipe_with, record_dataset
from ajgdata.draws.rows import REDUCED, reduced
from ajgdata.draws.sampling import SEED, values_of
from ajgdata.gripper import derive_seed
from ajgdata.types import DatasetSpec, NotPossibleError, Recipe


@dataclass(frozen=True)
class Draw:
    """What was drawn, and what was read of it; all but `seconds` is the same each time.

    `missing` says by data set why its rows have no reading; `refused` counts grasps that could not
    be made.
    """

    name: str
    count: int
    seed: int
    values: Mapping[str, float]
    readings: tuple[Reading, ...]
    scenes: int
    refused: int
    missing: Mapping[str, str]
    seconds: float


def measure_draw(
    specs: Mapping[str, DatasetSpec], number: int, count: int, seed: int = SEED, quick: bool = False
) -> Draw:
    """Return the draw `number` of `count`, all data sets of REDUCED recorded and read.

    `specs` are their declarations, and those of data sets whose noise they are recorded in. The
    gripper came out of its drawing as its own name says, and its grasps are its own. `quick`: a
    few coarse scenes and the fastest model.
    """
    name, values = draw_names(count)[number], values_of(number, count, seed)
    own = derive_seed("draw", seed, name)
    return _measured(
        specs,
        name,
        count,
        seed,
        values,
        lambda recipe: recipe_with(recipe, values, name, own),
        quick,
    )


def measure_default(
    specs: Mapping[str, DatasetSpec], count: int, seed: int = SEED, quick: bool = False
) -> Draw:
    """Return the gripper of the declarations, read by the same reduced rows as `count` draws."""
    return _measured(specs, DEFAULT, count, seed, {}, lambda recipe: recipe, quick)


def _measured(
    specs: Mapping[str, DatasetSpec],
    name: str,
    count: int,
    seed: int,
    values: Mapping[str, float],
    drawn: Callable[[Recipe], Recipe],
    quick: bool,
) -> Draw:
    begin = time.process_time()
    readings: list[Reading] = []
    scenes, refused, missing = 0, 0, {}
    for dataset, by in REDUCED.items():
        spec = specs[dataset]
        if spec.recipe is None:
            raise NotPossibleError(f"{dataset} has no recipe: only what is simulated can be drawn")
        recipe = drawn(reduced(spec.recipe, by, quick))
        task = spec.tasks[by.task]
        noisy = specs[by.noisy].recipe if by.noisy else None
        try:
            recorded = record_dataset(spec, recipe, task.target, noisy.signal if noisy else None)
            scenes, refused = scenes + recorded.scenes, refused + recorded.refused
            readings += readings_of(dataset, recorded, task, models_for(quick))
        except NotPossibleError as error:  # a gripper too small for a large object, say
            missing[dataset] = str(error)
    seconds = time.process_time() - begin
    return Draw(name, count, seed, values, tuple(readings), scenes, refused, missing, seconds)
