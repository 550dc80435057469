"""Time that the omissions of a scene save and their error, measured on the scene."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np

from ajgdata.gripper.scene import Scene
from ajgdata.gripper.signal_chain import ImpulseResponse
from ajgdata.gripper.simulation import simulate
from ajgdata.gripper.solver_plan import Plan, build_plan
from ajgdata.studies.noise_free import relative_error, timed

#: Number of simulations of a plan, of which the shortest time counts.
REPEATS = 2
#: Upper end of the modes of a complete plan (Hz).
ALL_MODES_HZ = 21_000.0


class Savings(NamedTuple):
    """Omitted physics of a scene.

    `time` is the saved share of the CPU time. `error` is the relative error (L2) of the magnitude
    spectrum of the response.
    """

    omitted: tuple[str, ...]
    time: float
    error: float

    def __str__(self) -> str:
        """Return the savings as a line for the console.

        >>> str(Savings(("modes above 8 kHz",), 0.123, 0.00312))
        'left out: modes above 8 kHz; time -12 %; error 0.003'
        """
        omitted = ", ".join(self.omitted)
        return f"left out: {omitted}; time {-100 * self.time:+.0f} %; error {self.error:.1g}"


def complete(scene: Scene) -> Scene:
    """Return the scene with all modes and all parts of the object."""
    numerics = scene.numerics.model_copy(update={"modes_hz": ALL_MODES_HZ, "omit": ()})
    return scene.model_copy(update={"numerics": numerics})


def measured_savings(scene: Scene) -> Savings | None:
    """Return the savings of a scene; None if its plan leaves nothing out.

    The scene is simulated four times. Raises SceneError if the object does not fit.
    """
    plan, plan_s = timed(partial(build_plan, scene), 1)
    full_plan, full_plan_s = timed(partial(build_plan, complete(scene)), 1)
    omitted = omitted_physics(plan, full_plan)
    if not omitted:
        return None
    response, march_s = timed(partial(simulate, plan), REPEATS)
    reference, full_march_s = timed(partial(simulate, full_plan), REPEATS)
    ratio = (plan_s + march_s) / (full_plan_s + full_march_s)
    return Savings(omitted, 1 - ratio, _error(response, reference))


def omitted_physics(plan: Plan, full_plan: Plan) -> tuple[str, ...]:
    """Return the parts of the object that a plan omits, else the modes that it omits, as words.

    >>> scene = Scene.model_validate({"object": "cube_20p7"})
    >>> omitted_physics(build_plan(scene), build_plan(complete(scene)))
    ('elastic', 'frame', 'motion')
    """
    solved = {part.name for part in full_plan.parts if part.is_solved}
    parts = solved - {part.name for part in plan.parts if part.is_solved}
    if parts:
        return tuple(sorted(parts))
    if plan.system.modes.inertia.size < full_plan.system.modes.inertia.size:
        return (f"modes above {plan.scene.numerics.modes_hz / 1e3:g} kHz",)
    return ()


def _error(response: ImpulseResponse, reference: ImpulseResponse) -> float:
    """Return the relative error (L2) of the magnitude spectrum."""
    length = max(len(response.samples), len(reference.samples))
    own, true = (np.abs(np.fft.rfft(each.samples, length)) for each in (response, reference))
    return relative_error(own, true)
