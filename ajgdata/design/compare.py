"""Designs of a gripper, compared by how well sizes, angles and materials are read from them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, JsonValue, TypeAdapter, field_validator, model_validator
from scipy.stats import qmc

from ajgdata.design.readings import Reading, readings_of, value_of
from ajgdata.design.recordings import merged, record_dataset
from ajgdata.design.rows import BY_NAME, CHEAP, COPIES, REDUCED, reduced
from ajgdata.gripper import derive_seed
from ajgdata.gripper.parameters import overrides
from ajgdata.types import DatasetSpec, ExcitationSpec, NotPossibleError, Recipe
from ajgdata.types.base import ModelName, Name, Strict
from ajgdata.types.table import Column, Table, Value

Real = NDArray[np.float64]
Ranking = Literal["skill", "per_second"]
RESAMPLES = 1000
#: CPU seconds of one scene of the default gripper, about; for what is not run yet.
SCENE_S = 0.15
#: A setting of what is played, which is none of the scene.
PLAYED = "excitation"


class DesignSpec(Strict):
    """What a designer may choose, and what designs are compared by."""

    designs: dict[Name, dict[str, JsonValue]] = Field(
        {},
        description="by name, what differs from the default: parts of a scene (gripper, medium, …),"
        " `signal` and `excitation`",
    )
    ranges: dict[str, tuple[float, float]] = Field(
        {}, description="low and high of settings by path, e.g. gripper.bed_depth_mm: [25, 45]"
    )
    choices: dict[str, tuple[JsonValue, ...]] = Field(
        {}, description="options of settings by path, e.g. medium.kind: [plastic, coffee]"
    )
    draws: int = Field(8, ge=1, le=200, description="designs drawn from `ranges` and `choices`")
    rows: tuple[str, ...] = Field(
        ("size_withheld", "angle_withheld", "sphere80"), min_length=1, description="what is read"
    )
    model: ModelName = Field(CHEAP, description="what reads it")
    sessions: int = Field(2, ge=1, le=10, description="of each data set")
    grasps: int = Field(2, ge=1, le=20, description="of each object and session")
    seed: int = Field(0, ge=0, description="of what is drawn from ranges, and of the bootstrap")
    quick: bool = Field(False, description="fewer objects on a coarse grid, for a first look")

    @field_validator("rows")
    @classmethod
    def _known(cls, rows: tuple[str, ...]) -> tuple[str, ...]:
        if wrong := [name for name in rows if name not in BY_NAME]:
            raise ValueError(f"unknown row {wrong[0]!r}: choose of {', '.join(BY_NAME)}")
        return rows

    @model_validator(mode="after")
    def _several(self) -> DesignSpec:
        for setting in (*self.ranges, *self.choices):
            if not setting.startswith(f"{PLAYED}."):
                try:
                    overrides({setting: 0.0})
                except (KeyError, IndexError, ValueError):
                    raise ValueError(f"{setting} is no setting: see docs/parameters.md") from None
        if len(designs_of(self)) < 2:
            raise ValueError("name two designs at least, or give ranges to draw them from")
        return self


def designs_of(spec: DesignSpec) -> dict[str, dict[str, Any]]:
    """Return what of each design differs from the default: those named, then those drawn.

    Keys of each are parts of a scene, "signal" and "excitation".
    """
    found: dict[str, dict[str, Any]] = {name: dict(one) for name, one in spec.designs.items()}
    if not spec.ranges and not spec.choices:
        return found
    columns = {
        setting: stratified(spec.draws, setting, spec.seed)
        for setting in (*spec.ranges, *spec.choices)
    }
    for number in range(spec.draws):
        settings: dict[str, Any] = {}
        for setting, (low, high) in spec.ranges.items():
            settings[setting] = float(f"{low + (high - low) * columns[setting][number]:.6g}")
        for setting, options in spec.choices.items():
            settings[setting] = options[int(columns[setting][number] * len(options))]
        played = {
            key.partition(".")[2]: value
            for key, value in settings.items()
            if key.startswith(f"{PLAYED}.")
        }
        rest = {key: value for key, value in settings.items() if not key.startswith(f"{PLAYED}.")}
        made = overrides(rest)
        one = {**made.pop("scene", {}), **made}
        found[f"drawn_{number:02d}"] = {**one, **({PLAYED: played} if played else {})}
    return found


def stratified(count: int, setting: str, seed: int) -> Real:
    """Return one number in [0, 1) for each of `count` designs, (count,): one in each `count`-th.

    Columns of different settings are independent permutations, which together are a Latin
    hypercube (McKay, Beckman & Conover 1979, Technometrics 21, 239). The seed of a column depends
    on the name of its setting, so that a further setting does not change the others.
    """
    sampler = qmc.LatinHypercube(1, rng=derive_seed("draws", seed, setting))
    return np.asarray(sampler.random(count)[:, 0], np.float64)


def scenes_of(spec: DesignSpec, specs: Mapping[str, DatasetSpec]) -> int:
    """Return how many scenes each design takes, without solving any."""
    total = 0
    for dataset in _datasets(spec):
        recipe = _recipe(spec, specs[dataset], {})
        variants = max(1, len(recipe.variants))
        total += variants * recipe.sessions * recipe.grasps_per_object * len(recipe.objects)
    return total


@dataclass(frozen=True)
class Compared:
    """A design with its readings by row, and CPU seconds of simulating and recording it."""

    name: str
    settings: Mapping[str, Any]
    readings: Mapping[str, Reading]
    scenes: int
    seconds: float
    missing: str = ""


def compare_designs(
    spec: DesignSpec,
    specs: Mapping[str, DatasetSpec],
    progress: Callable[[str], None] = lambda name: None,
) -> list[Compared]:
    """Record and read every design on the same grasps; `specs` are declarations by data set.

    A design that cannot hold an object says so in `missing`.
    """
    found = []
    for name, settings in designs_of(spec).items():
        found.append(_measured(spec, specs, name, settings))
        progress(name)
    return found


def _measured(
    spec: DesignSpec, specs: Mapping[str, DatasetSpec], name: str, settings: Mapping[str, Any]
) -> Compared:
    readings: dict[str, Reading] = {}
    scenes, seconds = 0, 0.0
    for dataset in _datasets(spec):
        by = REDUCED[dataset]
        declared = _declared(specs[dataset], settings)
        recipe = _recipe(spec, declared, settings)
        noisy = specs[by.noisy].recipe if "noise" in _parts(spec, dataset) else None
        task, begin = declared.tasks[by.task], time.process_time()
        try:
            signal = noisy.signal if noisy else None
            recorded = record_dataset(declared, recipe, task.target, signal)
            seconds += time.process_time() - begin
            scenes += recorded.scenes
            for one in readings_of(dataset, recorded, task, spec.model, spec.rows):
                readings[one.row] = one
        except NotPossibleError as error:
            return Compared(name, settings, {}, scenes, seconds, str(error))
    return Compared(name, settings, readings, scenes, seconds)


def _datasets(spec: DesignSpec) -> list[str]:
    return list(dict.fromkeys(BY_NAME[row].dataset for row in spec.rows))


def _parts(spec: DesignSpec, dataset: str) -> set[str]:
    """Return the parts of a data set that the rows are measured on."""
    return {BY_NAME[row].part for row in spec.rows if BY_NAME[row].dataset == dataset}


def _declared(spec: DatasetSpec, settings: Mapping[str, Any]) -> DatasetSpec:
    """Return the data set with what a design plays."""
    if PLAYED not in settings:
        return spec
    given = merged(spec.excitation.model_dump(mode="json"), settings[PLAYED])
    played: Any = TypeAdapter(ExcitationSpec).validate_python(given)
    return spec.model_copy(update={"excitation": played})


def _recipe(spec: DesignSpec, dataset: DatasetSpec, settings: Mapping[str, Any]) -> Recipe:
    """Return the recipe of a design; the gripper comes out of its drawing alike in all."""
    if dataset.recipe is None:
        raise NotPossibleError(f"{dataset.name} has no recipe: only simulated data are compared")
    samples = COPIES if "copies" in _parts(spec, dataset.name) else 1
    by = REDUCED[dataset.name]
    amount = {"sessions": spec.sessions, "grasps": spec.grasps, "samples": samples}
    recipe = reduced(dataset.recipe, by, **amount, quick=spec.quick)
    scene = {k: v for k, v in settings.items() if k not in (PLAYED, "signal")}
    variation = None
    if recipe.variation is not None:
        variation = merged(recipe.variation, {"gripper": {"name": "design"}})
    changes = {
        "scene": merged(recipe.scene, scene), "variation": variation,
        "signal": merged(recipe.signal, settings.get("signal", {})),
    }  # fmt: skip
    return recipe.model_copy(update=changes)


def skills(compared: list[Compared], rows: tuple[str, ...], seed: int) -> tuple[Real, Real]:
    """Return the skill of each design (designs,), and of bootstrap samples (designs, RESAMPLES).

    The skill of a row is 1 for no error and 0 for chance (1 - error / chance; of accuracies what is
    above chance, of what chance leaves); of a design it is the mean over rows. Each sample draws
    grasps with replacement, the same for all designs. NaN for a design without readings.
    """
    generator = np.random.default_rng(seed)
    told, drawn = [], []
    for row in rows:
        known = [one.readings[row] for one in compared if row in one.readings]
        names = sorted(set().union(*(one.group for one in known)))
        picked = generator.integers(0, len(names), (RESAMPLES, len(names))) if names else None
        of_row = [_skill(one.readings.get(row), names, picked) for one in compared]
        told.append([one[0] for one in of_row])
        drawn.append([one[1] for one in of_row])
    return np.mean(told, axis=0), np.mean(drawn, axis=0)


def _skill(
    reading: Reading | None, names: list[str], picked: NDArray[np.int64] | None
) -> tuple[float, Real]:
    if reading is None or picked is None:
        return float("nan"), np.full(RESAMPLES, np.nan)
    unit, place = BY_NAME[reading.row].unit, {name: n for n, name in enumerate(names)}
    count = np.zeros((RESAMPLES, len(names)))
    np.add.at(count, (np.arange(RESAMPLES)[:, None], picked), 1.0)
    mine = count[:, [place[name] for name in reading.group]]
    loss = np.array(reading.loss)
    mean = mine @ loss / np.maximum(mine.sum(axis=1), 1)
    values = value_of(np.append(mean, loss.mean())[:, None], unit)
    if unit == "%":
        scaled = (values - reading.chance) / (100 - reading.chance)
    else:
        scaled = 1 - values / reading.chance
    return float(scaled[-1]), scaled[:-1]


def ranked(compared: list[Compared], spec: DesignSpec, by: Ranking = "skill") -> Table:
    """Return the designs, best first: by skill, or by skill per CPU second of a scene."""
    skill, drawn = skills(compared, spec.rows, spec.seed)
    per_scene = np.array([one.seconds / max(one.scenes, 1) for one in compared])
    with np.errstate(divide="ignore", invalid="ignore"):
        key = skill if by == "skill" else skill / per_scene
        sampled = drawn if by == "skill" else drawn / per_scene[:, None]
    first = np.zeros(len(compared))
    if np.isfinite(sampled).any():
        best = np.argmax(np.where(np.isfinite(sampled), sampled, -np.inf), axis=0)
        first = np.bincount(best, minlength=len(compared)) / sampled.shape[1]
    order = np.argsort(-np.where(np.isfinite(key), key, -np.inf), kind="stable")
    rows: list[dict[str, Value]] = []
    for place in order:
        one = compared[place]
        known = np.isfinite(skill[place])
        low, high = np.percentile(drawn[place], [2.5, 97.5]) if known else (None, None)
        rows.append(
            {
                "design": one.name, "skill": float(skill[place]) if known else None,
                "low": None if low is None else float(low),
                "high": None if high is None else float(high),
                "first": 100 * float(first[place]),
                "scene_s": float(per_scene[place]) if one.scenes else None,
                "per_second": float(skill[place] / per_scene[place]) if known else None,
                **{row: one.readings[row].value if row in one.readings else None
                   for row in spec.rows},
                "settings": ", ".join(in_words(one.settings)) or "the default",
                "missing": one.missing,
            }
        )  # fmt: skip
    heads = (
        Column("design", "Design"), Column("skill", "Skill"), Column("low", "2.5 %"),
        Column("high", "97.5 %"), Column("first", "First", "%"), Column("scene_s", "Scene", "s"),
        Column("per_second", "Skill per second"),
        *(Column(row, BY_NAME[row].title, BY_NAME[row].unit) for row in spec.rows),
        Column("settings", "Settings"), Column("missing", "Cannot"),
    )  # fmt: skip
    note = (
        "Skill: 1 for no error, 0 for chance, mean over rows; with the 95 % interval of a bootstrap"
        " over grasps, and in how many of its samples a design is first. Scene: CPU time of one."
        f" Ranked by {'skill' if by == 'skill' else 'skill per second'}; all on the same grasps."
    )
    return Table("designs", "Designs of a gripper, simulated", note, heads, tuple(rows))


def in_words(settings: Mapping[str, Any], before: str = "") -> list[str]:
    """Return settings as `gripper.height_mm = 40`."""
    found = []
    for key, value in settings.items():
        if isinstance(value, Mapping):
            found += in_words(value, f"{before}{key}.")
        else:
            found.append(f"{before}{key} = {value}")
    return found
