"""The virtual gripper as a sound card, by the names of its scenes.

Switching should be quick: what solves scenes is imported where one has to be solved.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ajgdata.acquire.simulated_card import jack_server, own_server, run_card, switch
from ajgdata.gripper import Scene, SceneError, SignalChain
from ajgdata.paths import Paths
from ajgdata.types import DataError

#: Scene of a gripper that holds nothing.
EMPTY = "empty"


def simulate_card(
    scenes: Sequence[str],
    *,
    grasps: int = 0,
    noise: bool = True,
    ready: Callable[[str], object] = lambda _: None,
) -> None:
    """Be a sound card in which the first of `scenes` is heard, until ended.

    They are named as for `ajgdata gripper show`; "empty" is a gripper that holds nothing. `grasps`
    of each are ready to be switched to. Runs a JACK server of its own. `ready` is told the server's
    name when the card can be used. Raises DataError.
    """
    from ajgdata.acquire.plant import Plant, noise_floor

    chain = SignalChain()
    placed = [None, *range(1, grasps + 1)]
    wanted = [(name, grasp) for name in scenes for grasp in placed]
    responses = {_title(*one): _response(*one, chain) for one in wanted}
    plant = Plant(responses[scenes[0]], noise_floor(chain) if noise else 0.0)
    with jack_server():
        run_card(plant, responses, lambda: ready(own_server()))


def switch_scene(name: str, grasp: int | None = None) -> None:
    """Let the simulated card play another scene: that of `name`, placed anew for each `grasp`.

    A scene that the card does not have is solved here. Raises DataError.
    """
    title = _title(name, grasp)
    if not switch(title):
        switch(title, _response(name, grasp, SignalChain()))


def robot_step(step: Mapping[str, Any]) -> None:
    """Do what a step of the robot `command` means for the simulated card: place the object.

    Raises DataError for an object that the library does not have.
    """
    if step.get("step") == "approach":
        switch_scene(str(step.get("object") or EMPTY), int(step.get("number", 0)))


def _title(name: str, grasp: int | None) -> str:
    return name if grasp is None else f"{name} grasp {grasp}"


def _response(name: str, grasp: int | None, chain: SignalChain) -> Any:
    from ajgdata.acquire.plant import scene_response
    from ajgdata.acquire.solving import SerialSolver
    from ajgdata.pipeline.show import open_scene

    scene = Scene() if name == EMPTY else open_scene(name)[1]
    if grasp is not None:
        placed = {**scene.model_dump(), "grasp": {**scene.grasp.model_dump(), "seed": grasp}}
        scene = Scene.model_validate(placed)
    try:
        return scene_response(SerialSolver(Paths().responses).solve(scene), chain)
    except SceneError as error:
        problem, _, fix = str(error).partition(": ")
        raise DataError(name, problem, fix or "change the scene") from None
