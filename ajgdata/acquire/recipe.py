"""Recipe -> grasps. Pure: the recordings of a virtual session and their seeds."""

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

#: Stands for the session of grasps that belong to none.
NEW = "new"


@dataclass(frozen=True)
class RecipeGrasp:
    """One grasp of one object, and how often it is recorded.

    `placement_id` is "" for a reference, for which no object is placed.
    `setup` is its scene, as keys of gripper.Scene; `digest` identifies what its recordings follow
    from, so that no recording is simulated twice.
    """

    grasp_id: str
    placement_id: str
    object: str
    samples: int
    targets: Mapping[str, float | str]
    setup: Mapping[str, Any]
    digest: str

    def recording_id(self, sample: int) -> str:
        """Return the name of one of its recordings; `sample` counts from 0."""
        return f"{self.grasp_id}_{sample + 1}"


class _Session(NamedTuple):
    drawn: str  #: the name that its grasps are drawn by
    variant: str  #: "" if the recipe has none


def _sessions(recipe: Recipe) -> dict[str, _Session]:
    numbers = [f"{number:02d}" for number in range(1, recipe.sessions + 1)]
    return {
        name: _Session(f"virtual-{number}" if recipe.same_grasps else name, variant)
        for variant in recipe.variants or [""]
        for number in numbers
        for name in [f"virtual-{variant}-{number}" if variant else f"virtual-{number}"]
    }


def session_names(recipe: Recipe | None) -> list[str]:
    """Return names of the sessions of a recipe, which more sessions do not change; none without a
    recipe."""
    return list(_sessions(recipe)) if recipe else []


def recipe_hash(recipe: Recipe, session: str, played: ExcitationSpec) -> str:
    """Return the hash of all settings that one session of a recipe follows from."""
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

    Each grasp draws from its own seed, derived from (recipe seed, data set or `grasps_of`, session,
    object, number): a new object or grasp changes no other, except later ones in a bed with memory.
    Variants share their seeds unless each draws its own grasps. `code` is the hash of the gripper's
    sources; with scene, signal chain and excitation (unless it is the default) it makes the digest,
    so that changed physics is simulated again. Drawn settings are also labels of the recording.
    Raises ValidationError for an invalid variation.
    """
    drawn_by, variant = _sessions(recipe)[session]
    scene = {**recipe.scene, **recipe.variants.get(variant, {})}
    sound = {} if played == DEFAULT_EXCITATION else {"excitation": played.model_dump(mode="json")}
    names = (recipe.seed, recipe.grasps_of or dataset, drawn_by)
    varied = _Varied.of(recipe, scene, *names)

    def planned(held: RecipeObject | None, number: int, before: int) -> RecipeGrasp:
        name = held.name if held else ""
        seed = derive_seed(*names, name, number)
        setup = _setup(scene, recipe, held, seed)
        grasp = setup["grasp"]
        drawn = {key: grasp[key] for key in sorted(recipe.vary)} if held else {}
        placement = placement_number(recipe, number)
        # The draw of a single placement has no number.
        put_down = () if placements(recipe) == 1 else (placement,)
        setup = varied.setup(setup, (*names, name, *put_down), names, before)
        return RecipeGrasp(
            grasp_id=f"{session}_{name or EMPTY}_{number:02d}",
            placement_id=f"{session}_{name}_placement_{placement:02d}" if held else "",
            object=name,
            samples=recipe.samples_per_grasp,
            targets={**drawn, **held.targets} if held else {},
            setup=setup,
            digest=_digest({"setup": setup, "signal": recipe.signal, "code": code, **sound}),
        )

    return [planned(*item, before) for before, item in enumerate(_in_order(recipe))]


def placements(recipe: Recipe) -> int:
    """Return how often each object is placed in a session."""
    return recipe.placements if recipe.order == "blocks" else recipe.grasps_per_object


def placement_number(recipe: Recipe, number: int) -> int:
    """Return the placement, from 1, of an object's grasp `number` of a session, from 1.

    The grasps of an object are divided among its placements as evenly as possible, in order.
    """
    return (number - 1) * placements(recipe) // recipe.grasps_per_object + 1


def _in_order(recipe: Recipe) -> Iterator[tuple[RecipeObject | None, int]]:
    """What is grasped, and for which time, from first to last; None is nothing."""
    yield from ((None, number) for number in range(1, recipe.references + 1))
    numbers = range(1, recipe.grasps_per_object + 1)
    for placement in range(1, placements(recipe) + 1):
        block = [number for number in numbers if placement_number(recipe, number) == placement]
        yield from ((item, number) for item in recipe.objects for number in block)


class _Varied(NamedTuple):
    """What a recipe's variation adds to the setups of one session; nothing if it has none."""

    variation: Variation | None
    assembly: Mapping[str, Any]
    offsets: Mapping[str, Any]

    @classmethod
    def of(cls, recipe: Recipe, scene: Mapping[str, Any], *names: str | int) -> _Varied:
        """Draw gripper and session, which `names` stand for."""
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
        put_down: tuple[str | int, ...],
        bed: tuple[str | int, ...],
        before: int,
    ) -> dict[str, Any]:
        """Return `setup` with what differs, which it says itself excepted.

        `put_down` are names of the placement of its object, `bed` those of the history of the bed
        and of the drift of the air, which `before` grasps went through.
        """
        if self.variation is None:
            return dict(setup)
        grasp = setup["grasp"]
        placed = self.variation.placement(*put_down) if setup["object"] is not None else {}
        nuisance = {"nuisance": self.variation.nuisance(grasp.get("nuisance", {}))}
        state = {**self.variation.bed(before, *bed), **self.variation.air(before, *bed)}
        grasp = {**placed, **state, **grasp, **nuisance}
        assembly = {**self.assembly, **setup.get("assembly", {})}
        offsets = {**self.offsets, **setup.get("session", {})}
        return {**setup, "grasp": grasp, "assembly": assembly, "session": offsets}


def new_setup(
    recipe: Recipe, name: str, pose_seed: int, seed: int, session: tuple[str | int, ...] = (NEW,)
) -> dict[str, Any]:
    """Return the setup of a grasp of the object `name` ("": empty gripper), in the pose that
    `pose_seed` draws, with the nuisances of `seed`.

    `session` are names of a session outside the recipe; the bed is newly poured. Raises
    NotPossibleError for an object that the recipe lacks, and for a recipe of variants, whose scenes
    differ.
    """
    if recipe.variants:
        raise NotPossibleError("it needs a recipe without variants: new grasps are of one scene")
    held = next((item for item in recipe.objects if item.name == name), None)
    if name and held is None:
        known = ", ".join(item.name for item in recipe.objects)
        raise NotPossibleError(f"the recipe has no object {name!r}: it has {known}")
    setup = _setup(recipe.scene, recipe, held, pose_seed)
    setup = {**setup, "grasp": {**setup["grasp"], "seed": seed}}
    varied = _Varied.of(recipe, recipe.scene, *session)
    return varied.setup(setup, (*session, pose_seed), (*session, seed), 0)


def _setup(
    scene: Mapping[str, Any], recipe: Recipe, held: RecipeObject | None, seed: int
) -> dict[str, Any]:
    """Setup of a grasp as it is meant: `scene` with what is held, and how."""
    fixed = scene.get("grasp", {})
    fixed = fixed if isinstance(fixed, dict) else {}
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
