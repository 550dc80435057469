"""Grasps of a recipe, simulated again with another scene, scatter or pose."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import JsonValue

from ajgdata.acquire.recipe import RecipeGrasp, plan_session, session_names
from ajgdata.acquire.virtual import VirtualGripper
from ajgdata.gripper.scene import Nuisance
from ajgdata.gripper.variation import Variation
from ajgdata.store.responses import ResponseStore
from ajgdata.types import ExcitationSpec, Recipe
from ajgdata.types.base import overridden
from ajgdata.types.variants import ChosenGrasps

#: Amounts that are drawn again for each grasp; correlation lengths are no amounts.
NUISANCES = ("roughness_mm", "slope_deg", "packing", "force", "grain_force")


@dataclass(frozen=True)
class GraspSimulator:
    """Simulator of the grasps that the recipe of a data set plans.

    `responses` is the folder of the solved scenes. `project` is the folder to which the path of a
    sound file is relative.
    """

    dataset: str
    recipe: Recipe
    excitation: ExcitationSpec
    responses: Path
    project: Path = Path()

    def planned(self, chosen: ChosenGrasps) -> list[RecipeGrasp]:
        """Return the chosen grasps in the order of their names, which are those of the features."""
        grasps = []
        for session in session_names(self.recipe)[: chosen.sessions]:
            counts: Counter[str] = Counter()
            for grasp in plan_session(self.recipe, self.dataset, session, ""):
                counts[grasp.object] += 1
                if grasp.object and (chosen.each is None or counts[grasp.object] <= chosen.each):
                    name = f"{session}/{grasp.grasp_id}"
                    grasps.append(dataclasses.replace(grasp, grasp_id=name))
        return sorted(grasps, key=lambda grasp: grasp.grasp_id)

    def recordings(
        self, grasps: Sequence[RecipeGrasp], change: ChosenGrasps
    ) -> Iterator[np.ndarray]:
        """Yield the first recording (n,) of each grasp with a change."""
        # One source for all grasps: the played sound is filtered once.
        source = VirtualGripper(
            grasps[0].setup,
            ResponseStore(self.responses),
            self.recipe.signal,
            self.excitation,
            self.project,
        )
        for grasp in grasps:
            setup = changed_setup(grasp.setup, change, self.recipe.vary)
            yield source.take(dataclasses.replace(grasp, setup=setup), 0).samples


def nuisances(factor: float) -> dict[str, JsonValue]:
    """Return the scatter of grasps, `factor` times the default."""
    base = Nuisance(**Variation().nuisance({}))
    return {name: factor * getattr(base, name) for name in NUISANCES}


def changed_setup(
    setup: Mapping[str, Any], change: ChosenGrasps, varied: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the setup of a grasp with a changed scene, scatter and pose.

    `varied` are the pose keys that the recipe draws.
    """
    changes: dict[str, Any] = dict(change.scene)
    if change.scatter is not None:
        scatter = {"nuisance": nuisances(change.scatter)}
        changes["grasp"] = overridden(changes.get("grasp", {}), scatter)
    merged = overridden(dict(setup), changes)
    grasp = merged["grasp"]
    scaled = {key: change.pose * grasp[key] for key in (*varied, "placed_deg") if key in grasp}
    if change.scatter is not None and "temperature_k" in grasp:
        scaled["temperature_k"] = change.scatter * grasp["temperature_k"]
    if "placed_mm" in grasp:
        scaled["placed_mm"] = [change.pose * offset for offset in grasp["placed_mm"]]
    return {**merged, "grasp": {**grasp, **scaled}}
