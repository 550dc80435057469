"""Recipe -> grasps. Pure: which recordings a virtual session shall hold, and with which seeds."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from ajgdata.acquire.source import Grasp
from ajgdata.gripper.scene import derive_seed
from ajgdata.types import Recipe, RecipeObject
from ajgdata.types.recipe import EMPTY


def session_names(recipe: Recipe) -> list[str]:
    """Names of the sessions of a recipe, which more sessions do not change."""
    return list(_scenes(recipe))


def _scenes(recipe: Recipe) -> dict[str, dict[str, Any]]:
    """What all scenes of a session share, by its name."""
    numbers = range(1, recipe.sessions + 1)
    if not recipe.setups:
        return {f"virtual-{number:02d}": recipe.scene for number in numbers}
    return {
        f"virtual-{name}-{number:02d}": {**recipe.scene, **setup}
        for name, setup in recipe.setups.items()
        for number in numbers
    }


def plan_session(recipe: Recipe, dataset: str, session: str, code: str) -> list[Grasp]:
    """Every grasp of one session: of nothing first, then objects in turn as a person would place
    them.

    Each grasp draws from its own seed, derived from (recipe seed, data set, session, object,
    number): adding an object or a grasp changes no other. The data set is `recipe.grasps_of` where
    that is given. `code` is a digest of the gripper's sources; with scene and signal chain it makes
    the grasp's digest, so that changed physics is simulated again. What `vary` draws is a label of
    the recording, too.
    """
    scene = _scenes(recipe)[session]

    def planned(made: RecipeObject | None, number: int) -> Grasp:
        name = made.name if made else ""
        seed = derive_seed(recipe.seed, recipe.grasps_of or dataset, session, name, number)
        grasp = _grasp_settings(recipe, scene, made, seed)
        setup = {**scene, "object": made.shape if made else None, "grasp": grasp}
        drawn = {key: grasp[key] for key in sorted(recipe.vary)} if made else {}
        return Grasp(
            grasp_id=f"{session}_{name or EMPTY}_{number:02d}",
            object=name,
            samples=recipe.samples_per_grasp,
            targets={**drawn, **made.targets} if made else {},
            setup=setup,
            digest=_digest({"setup": setup, "signal": recipe.signal, "code": code}),
        )

    empty = [planned(None, number) for number in range(1, recipe.references + 1)]
    numbers = range(1, recipe.grasps_per_object + 1)
    return empty + [planned(made, number) for number in numbers for made in recipe.objects]


def yaml_place(recipe: Recipe, made: str, place: tuple[int | str, ...]) -> tuple[int | str, ...]:
    """Where in a declaration stands what is wrong at `place` of a setup of the object `made`."""
    of_setup = place and any(place[0] in setup for setup in recipe.setups.values())
    if of_setup or not made:
        return ("recipe", "setups") if of_setup else ("recipe", "scene", *place)
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
        case _:
            return ("recipe", "scene", *place)


def _grasp_settings(
    recipe: Recipe, scene: Mapping[str, Any], made: RecipeObject | None, seed: int
) -> dict[str, Any]:
    fixed = scene.get("grasp", {})
    fixed = fixed if isinstance(fixed, dict) else {}
    if made is None:
        return {**fixed, "seed": seed}
    generator = np.random.default_rng(seed)
    drawn = {
        key: round(float(generator.uniform(*limits)), 4)
        for key, limits in sorted(recipe.vary.items())
    }
    return {**fixed, **made.grasp, **drawn, "seed": seed}


def _digest(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
