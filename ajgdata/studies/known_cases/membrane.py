"""Reciprocity of the membrane: a pressure outside it and a flow at the microphone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper import Scene, build_plan
from ajgdata.gripper.solver import at_rest, march
from ajgdata.gripper.solver_plan import Plan
from ajgdata.studies.known_cases.case import Identity

Real = NDArray[np.floating]
Chosen = NDArray[np.bool_] | int


def pressed(plan: Plan, walls: Chosen, pressure: Sequence[float] | Real, steps: int) -> Real:
    """Return the mean pressure at the microphone in each step, (steps,).

    `pressure` (n,) acts on `walls` from outside. It has the effect of a lower pressure inside, so
    it is subtracted from the momentum of the walls, half before and half after each step.
    """
    state = at_rest(plan.system)
    sound = np.zeros(steps + 1)
    push = np.zeros(len(state.momentum))
    ear = plan.microphone
    for n in range(steps):
        push[walls] = pressure[n] if n < len(pressure) else 0.0
        state.momentum[:] -= push
        (sound[n + 1],) = march(plan.system, state, ear, ear, np.zeros(0), 1)
        state.momentum[:] -= push
    return (sound[1:] + sound[:-1]) / 2


def moved(plan: Plan, steps: int) -> Real:
    """Return the mean volume velocity of each wall in each step, (steps, walls).

    The first step has a unit flow at the microphone.
    """
    system = plan.system
    walls = system.walls
    state = at_rest(system)
    area = walls.coupling / (system.capacities.yield_[walls.cell] * walls.admittance)
    flow = np.zeros((steps, len(area)))
    for n in range(steps):
        before = state.momentum.copy()
        march(system, state, plan.microphone, plan.microphone, np.ones(int(n == 0)), 1)
        flow[n] = (state.momentum + before) / walls.inertia * area / 2
    return flow


class ReciprocityOfMembrane(Identity):
    """Exchange of membrane and microphone in a complete scene, for four walls of the membrane.

    The pressure at the microphone per pressure on a wall is the volume velocity of the wall per
    flow at the microphone.
    """

    title = "a press on the membrane is heard as the membrane moves for the microphone"
    derived = "a few roundings a step, at random: 4 √steps ε, of the largest"
    steps = 300
    roundings = 4 * steps**0.5

    def deviation(self, quick: bool) -> float:
        """Return the largest difference, relative to the largest velocity of the wall."""
        numerics = {"dx_mm": 6.0, "precision": "float64"}
        solid = {"kind": "cube", "edge_mm": 20.0, "material": "styrofoam"}
        plan = build_plan(Scene.model_validate({"object": solid, "numerics": numerics}))
        velocity = moved(plan, self.steps)
        worst = 0.0
        for wall in np.random.default_rng(0).choice(velocity.shape[1], 4, replace=False):
            difference = pressed(plan, int(wall), [1.0], self.steps) - velocity[:, wall]
            worst = max(worst, float(np.max(np.abs(difference)) / np.abs(velocity[:, wall]).max()))
        return worst
