"""Recipe -> grasps. Pure: which recordings a virtual session shall hold, and with which seeds."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ajgdata.acquire.source import Grasp
from ajgdata.gripper.scene import derive_seed
from ajgdata.types import Recipe, RecipeObject


class _Session(NamedTuple):
    drawn: str  #: the name that its grasps are drawn by, shared by all variants
    variant: str  #: "" if the recipe has none


def _sessions(recipe: Recipe) -> dict[str, _Session]:
    numbers = [f"{number:02d}" for number in range(1, recipe.sessions + 1)]
    return {
        f"virtual-{variant}-{n}" if variant else f"virtual-{n}": _Session(f"virtual-{n}", variant)
        for variant in recipe.variants or [""]
        for n in numbers
    }


def session_names(recipe: Recipe) -> list[str]:
    """Names of the sessions of a recipe, which more sessions do not change."""
    return list(_sessions(recipe))


def plan_session(recipe: Recipe, dataset: str, session: str, code: str) -> list[Grasp]:
    """Every grasp of one session, objects in turn as a person would place them.

    Each grasp draws from its own seed, derived from (recipe seed, data set, session, object,
    number): adding an object or a grasp changes no other, and variants share their seeds. The data
    set is `recipe.grasps_of` where that is given. `code` is a digest of the gripper's sources; with
    scene and signal chain it makes the grasp's digest, so that changed physics is simulated again.
    """
    drawn_by, variant = _sessions(recipe)[session]
    scene = {**recipe.scene, **recipe.variants.get(variant, {})}
    grasps = []
    for number in range(1, recipe.grasps_per_object + 1):
        for made in recipe.objects:
            drawn_for = recipe.grasps_of or dataset
            seed = derive_seed(recipe.seed, drawn_for, drawn_by, made.name, number)
            grasp = _grasp_settings(scene, recipe, made, seed)
            setup = {**scene, "object": made.shape, "grasp": grasp}
            grasps.append(
                Grasp(
                    grasp_id=f"{session}_{made.name}_{number:02d}",
                    object=made.name,
                    samples=recipe.samples_per_grasp,
                    targets=made.targets,
                    setup=setup,
                    digest=_digest({"setup": setup, "signal": recipe.signal, "code": code}),
                )
            )
    return grasps


def shares_scenes(name: str, recipe: Recipe, other: str, others: Recipe) -> bool:
    """Whether sessions of one name of two recipes, of data sets `name` and `other`, have scenes in
    common: then the second to be recorded finds the responses of the first."""

    def drawn(of: str, by: Recipe) -> tuple[object, ...]:
        return by.seed, by.grasps_of or of, by.scene, by.variants, by.vary

    mine, theirs = ({m.name: (m.shape, m.grasp) for m in r.objects} for r in (recipe, others))
    common = any(theirs.get(made) == settings for made, settings in mine.items())
    return common and drawn(name, recipe) == drawn(other, others)


def yaml_place(
    recipe: Recipe, session: str, made: str, place: tuple[int | str, ...]
) -> tuple[int | str, ...]:
    """Where in a declaration stands what is wrong at `place` of a setup of the object `made`."""
    variant = _sessions(recipe)[session].variant
    number = [one.name for one in recipe.objects].index(made)
    match place:
        case ():
            return ("recipe", "objects", number)
        case ("object", *rest):
            return ("recipe", "objects", number, "shape", *rest)
        case ("grasp", str(key), *_) if key in recipe.vary:
            return ("recipe", "vary", key)
        case ("grasp", str(key), *rest) if key in recipe.objects[number].grasp:
            return ("recipe", "objects", number, "grasp", key, *rest)
        case (str(key), *_) if key in recipe.variants.get(variant, {}):
            return ("recipe", "variants", variant, *place)
        case _:
            return ("recipe", "scene", *place)


def _grasp_settings(
    scene: Mapping[str, Any], recipe: Recipe, made: RecipeObject, seed: int
) -> dict[str, Any]:
    generator = np.random.default_rng(seed)
    drawn = {
        key: round(float(generator.uniform(*limits)), 4)
        for key, limits in sorted(recipe.vary.items())
    }
    fixed = scene.get("grasp", {})
    fixed = fixed if isinstance(fixed, dict) else {}
    return {**fixed, **made.grasp, **drawn, "seed": seed}


def _digest(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
