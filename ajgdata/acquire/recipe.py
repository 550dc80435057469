"""Grasps of a recipe, with the scene and the seed of each. This module opens no file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ajgdata.gripper.scene import derive_seed
from ajgdata.gripper.variation import Variation
from ajgdata.types import DEFAULT_EXCITATION, ExcitationSpec, NotPossibleError, Recipe, RecipeObject
from ajgdata.types.recipe import EMPTY

#: Session of grasps that are not in the recipe.
NEW = "new"


@dataclass(frozen=True)
class RecipeGrasp:
    """One grasp of one object, with `samples` recordings.

    `placement_id` is "" for a reference, for which no object is placed. `setup` is the scene, as
    keys of gripper.Scene. `digest` is a hash of all inputs of the recordings: a recording with the
    same digest is not simulated again.
    """

    grasp_id: str
    placement_id: str
    object: str
    samples: int
    targets: Mapping[str, float | str]
    setup: Mapping[str, Any]
    digest: str

    def recording_id(self, sample: int) -> str:
        """Return the name of a recording; `sample` counts from 0."""
        return f"{self.grasp_id}_{sample + 1}"


class _Session(NamedTuple):
    """The name from which the grasps of a session are drawn, and its variant ("": none)."""

    drawn: str
    variant: str


def _sessions(recipe: Recipe) -> dict[str, _Session]:
    """Return the sessions of a recipe by name."""
    sessions = {}
    for variant in recipe.variants or [""]:
        for number in range(1, recipe.sessions + 1):
            without_variant = f"virtual-{number:02d}"
            name = f"virtual-{variant}-{number:02d}" if variant else without_variant
            drawn = without_variant if recipe.same_grasps else name
            sessions[name] = _Session(drawn, variant)
    return sessions


def session_names(recipe: Recipe | None) -> list[str]:
    """Return the names of the sessions of a recipe; none without a recipe.

    A larger number of sessions adds names, and changes no name.
    """
    return list(_sessions(recipe)) if recipe else []


def recipe_hash(recipe: Recipe, session: str, played: ExcitationSpec) -> str:
    """Return the hash of all settings that decide one session of a recipe."""
    settings = recipe.model_dump(mode="json", exclude={"sessions", "variants"})
    settings["variant"] = recipe.variants.get(_sessions(recipe)[session].variant, {})
    return _digest({**settings, "excitation": played.model_dump(mode="json")})


def plan_session(
    recipe: Recipe,
    dataset: str,
    session: str,
    code: str,
    played: ExcitationSpec = DEFAULT_EXCITATION,
) -> list[RecipeGrasp]:
    """Return every grasp of one session: references first, then the objects in the recipe's order.

    Each grasp has its own seed, derived from (recipe seed, data set or `grasps_of`, session,
    object, number). A new object or grasp therefore changes no other grasp, except later grasps in
    a bed with memory. Variants share their seeds unless each draws its own grasps. Drawn settings
    are also labels of the recording.

    `code` is the hash of the gripper's sources. The digest of a grasp follows from it, the scene,
    the signal chain, and an excitation other than the default, so changed physics is simulated
    again. Raises ValidationError for an invalid variation.
    """
    drawn, variant = _sessions(recipe)[session]
    scene = {**recipe.scene, **recipe.variants.get(variant, {})}
    sound = {} if played == DEFAULT_EXCITATION else {"excitation": played.model_dump(mode="json")}
    names = (recipe.seed, recipe.grasps_of or dataset, drawn)
    varied = _Varied.draw(recipe, scene, *names)

    grasps = []
    for before, (held, number) in enumerate(_in_order(recipe)):
        name = held.name if held else ""
        setup = _setup(scene, recipe, held, derive_seed(*names, name, number))
        placement = placement_number(recipe, number)
        targets: dict[str, float | str] = {}
        placement_id = ""
        if held:
            drawn_pose = {key: setup["grasp"][key] for key in sorted(recipe.vary)}
            targets = {**drawn_pose, **held.targets}
            placement_id = f"{session}_{name}_placement_{placement:02d}"
        placement_names: tuple[str | int, ...] = (*names, name)
        if placements(recipe) > 1:
            placement_names = (*placement_names, placement)
        setup = varied.setup(setup, placement_names, names, before)
        grasps.append(
            RecipeGrasp(
                grasp_id=f"{session}_{name or EMPTY}_{number:02d}",
                placement_id=placement_id,
                object=name,
                samples=recipe.samples_per_grasp,
                targets=targets,
                setup=setup,
                digest=_digest({"setup": setup, "signal": recipe.signal, "code": code, **sound}),
            )
        )
    return grasps


def placements(recipe: Recipe) -> int:
    """Return how often each object is placed in a session."""
    return recipe.placements if recipe.order == "blocks" else recipe.grasps_per_object


def placement_number(recipe: Recipe, number: int) -> int:
    """Return the placement, from 1, of an object's grasp `number` of a session, from 1.

    The grasps of an object are divided among its placements as evenly as possible, in order.
    """
    return (number - 1) * placements(recipe) // recipe.grasps_per_object + 1


def _in_order(recipe: Recipe) -> Iterator[tuple[RecipeObject | None, int]]:
    """Yield the object and the number of each grasp in order; the object of a reference is None."""
    yield from ((None, number) for number in range(1, recipe.references + 1))
    numbers = range(1, recipe.grasps_per_object + 1)
    for placement in range(1, placements(recipe) + 1):
        block = [number for number in numbers if placement_number(recipe, number) == placement]
        yield from ((item, number) for item in recipe.objects for number in block)


class _Varied(NamedTuple):
    """The drawn variation of one session: gripper, and offsets of the session.

    Without a variation, setups stay as they are.
    """

    variation: Variation | None
    assembly: Mapping[str, Any]
    offsets: Mapping[str, Any]

    @classmethod
    def draw(cls, recipe: Recipe, scene: Mapping[str, Any], *names: str | int) -> _Varied:
        """Draw the gripper and the session with these `names`, of which the last is the session."""
        if recipe.variation is None:
            return cls(None, {}, {})
        variation = Variation.model_validate(recipe.variation)
        design = scene.get("gripper", "default")
        together = variation.session.one_sitting and names[-1] != NEW
        sitting = names[:-1] if together else names
        return cls(variation, variation.assembly(design), variation.offsets(*sitting))

    def setup(
        self,
        setup: Mapping[str, Any],
        placement: tuple[str | int, ...],
        session: tuple[str | int, ...],
        before: int,
    ) -> dict[str, Any]:
        """Return `setup` with drawn values of the keys that it does not set.

        `placement` are the names from which the placement of the object is drawn, `session` those
        of the bed and the air. `before` is the number of earlier grasps in the session.
        """
        if self.variation is None:
            return dict(setup)
        placed = {}
        if setup["object"] is not None:
            placed = self.variation.placement(*placement)
        grasp = {
            **placed,
            **self.variation.bed(before, *session),
            **self.variation.air(before, *session),
            **setup["grasp"],
            "nuisance": self.variation.nuisance(setup["grasp"].get("nuisance", {})),
        }
        assembly = {**self.assembly, **setup.get("assembly", {})}
        offsets = {**self.offsets, **setup.get("session", {})}
        return {**setup, "grasp": grasp, "assembly": assembly, "session": offsets}


def new_setup(
    recipe: Recipe, name: str, pose_seed: int, seed: int, session: tuple[str | int, ...] = (NEW,)
) -> dict[str, Any]:
    """Return the setup of a new grasp of the object `name` ("": empty gripper).

    `pose_seed` draws the pose, and `seed` the nuisances. `session` are names of a session outside
    the recipe, and the bed is newly poured. Raises NotPossibleError for an object that is not in
    the recipe, and for a recipe of variants, whose scenes differ.
    """
    if recipe.variants:
        raise NotPossibleError("it needs a recipe without variants: new grasps are of one scene")
    held = next((item for item in recipe.objects if item.name == name), None)
    if name and held is None:
        known = ", ".join(item.name for item in recipe.objects)
        raise NotPossibleError(f"the recipe has no object {name!r}: it has {known}")
    setup = _setup(recipe.scene, recipe, held, pose_seed)
    setup = {**setup, "grasp": {**setup["grasp"], "seed": seed}}
    varied = _Varied.draw(recipe, recipe.scene, *session)
    return varied.setup(setup, (*session, pose_seed), (*session, seed), 0)


def _setup(
    scene: Mapping[str, Any], recipe: Recipe, held: RecipeObject | None, seed: int
) -> dict[str, Any]:
    """Return the setup of a grasp without variation: `scene` with object, pose and seed."""
    fixed = scene.get("grasp", {})
    if not isinstance(fixed, dict):
        fixed = {}
    if held is None:
        return {**scene, "object": None, "grasp": {**fixed, "seed": seed}}
    generator = np.random.default_rng(seed)
    drawn = {
        key: round(float(generator.uniform(*limits)), 4)
        for key, limits in sorted(recipe.vary.items())
    }
    return {**scene, "object": held.shape, "grasp": {**fixed, **held.grasp, **drawn, "seed": seed}}


def _digest(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
