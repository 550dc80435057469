"""Who moves the gripper and who listens, in live use: a sound card, or the virtual gripper."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from pydantic import JsonValue

from ajgdata.acquire.card import Card, card_settings
from ajgdata.acquire.line import open_card
from ajgdata.acquire.robot import Confirm, Robot, open_robot
from ajgdata.acquire.virtual_line import VirtualTable
from ajgdata.paths import Paths
from ajgdata.types import DataError, DatasetSpec

VIRTUAL = "virtual"


@contextmanager
def open_hands(
    paths: Paths,
    spec: DatasetSpec,
    *,
    source: str,
    card: Mapping[str, Any],
    robot: str,
    robot_settings: Mapping[str, JsonValue],
    seed: int,
    confirm: Confirm,
) -> Iterator[tuple[Robot, Card, dict[str, str]]]:
    """Yield robot and sound card, and `gripper` and `medium` as session.yaml has them.

    `source` is `soundcard` (`card` has its settings, but the rate, which the data set declares) or
    `virtual`: the virtual gripper over the objects of the data set's recipe, drawn by `seed`, which
    no person needs to move. Raises DataError.
    """
    if source == VIRTUAL:
        if spec.recipe is None:
            fix = "name a data set that has one, or use a sound card"
            raise DataError(paths.dataset(spec.name), "has no recipe to simulate", fix)
        about = {"gripper": "virtual", "medium": "virtual"}
        if robot == "manual":
            table = VirtualTable(spec.recipe, seed, paths.responses)
            yield table, table, about
            return
        with open_robot(robot, robot_settings, confirm) as mover:
            table = VirtualTable(spec.recipe, seed, paths.responses, mover)
            yield table, table, about
        return
    settings = card_settings(**{**card, "sample_rate_hz": spec.audio.sample_rate_hz})
    protocol = spec.protocol
    about = {
        "gripper": protocol.gripper if protocol else "unknown",
        "medium": protocol.medium if protocol else "unknown",
    }
    with open_robot(robot, robot_settings, confirm) as mover, open_card(settings) as opened:
        yield mover, opened, about
