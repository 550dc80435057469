"""Planned and remaining grasps of a protocol. This module opens no file."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ajgdata.types import GraspProtocol, Recording
from ajgdata.types.recipe import EMPTY

#: Columns of recordings.csv with the planned grasp of a recording.
PLANNED = "planned"
ATTEMPT = "grasp_attempt"
REFERENCE = "reference"
#: Column with the problems of a recording, also of one that is kept.
DOUBT = "doubt"


@dataclass(frozen=True)
class PlannedGrasp:
    """One grasp of a protocol. `object` is "" for a reference: the empty gripper."""

    name: str
    object: str
    number: int
    samples: int
    targets: Mapping[str, float | str]
    reference: str = ""


def plan_protocol(protocol: GraspProtocol, session: str) -> list[PlannedGrasp]:
    """Return every grasp of a session, in order.

    Each round has each object once. Slow drift then affects all objects equally, and a session that
    ends early has as many grasps of each object. The random order is drawn from the protocol's seed
    and the session's name.
    """
    generator = np.random.default_rng([protocol.seed, *session.encode()])
    width = max(2, len(str(protocol.grasps_per_object)))
    grasps = []
    for number in range(1, protocol.grasps_per_object + 1):
        order = np.arange(len(protocol.objects))
        if protocol.order == "random":
            order = generator.permutation(len(protocol.objects))
        for item in (protocol.objects[at] for at in order):
            name = f"{item.name}_{number:0{width}d}"
            grasps.append(
                PlannedGrasp(name, item.name, number, protocol.samples_per_grasp, item.targets)
            )
    return list(_with_references(protocol, grasps))


def _with_references(
    protocol: GraspProtocol, grasps: Sequence[PlannedGrasp]
) -> Iterator[PlannedGrasp]:
    for at, grasp in enumerate(grasps):
        if protocol.references and at % protocol.references.every == 0:
            number = at // protocol.references.every + 1
            name = f"{EMPTY}_{number:02d}"
            yield PlannedGrasp(name, "", number, protocol.samples_per_grasp, {}, EMPTY)
        yield grasp


def whole_grasps(recordings: Collection[Recording]) -> dict[str, list[Recording]]:
    """Return the recordings of each planned grasp: those of its last attempt, if not rejected.

    A grasp with fewer recordings than its samples is not complete.
    """
    accepted: dict[str, dict[int, list[Recording]]] = {}
    for row in recordings:
        name = row.labels.get(PLANNED, "")
        if name and row.quality.lower() != "reject":
            attempts = accepted.setdefault(name, {})
            attempts.setdefault(int(row.labels[ATTEMPT]), []).append(row)
    return {name: attempts[max(attempts)] for name, attempts in accepted.items()}


def remaining(
    planned: Sequence[PlannedGrasp],
    recordings: Collection[Recording],
    skipped: Collection[str] = (),
) -> list[PlannedGrasp]:
    """Return the grasps of a plan that are neither complete nor skipped, in order."""
    whole = whole_grasps(recordings)
    return [
        grasp
        for grasp in planned
        if grasp.name not in skipped and len(whole.get(grasp.name, ())) < grasp.samples
    ]


def next_attempt(grasp: PlannedGrasp, recordings: Collection[Recording]) -> int:
    """Return the number of the attempt after all attempts in `recordings`."""
    numbers = (int(r.labels[ATTEMPT]) for r in recordings if r.labels.get(PLANNED) == grasp.name)
    return 1 + max(numbers, default=0)


def grasp_id(grasp: PlannedGrasp, attempt: int) -> str:
    """Return the identity of one attempt at a grasp. The first attempt has the grasp's name."""
    return grasp.name if attempt == 1 else f"{grasp.name}-{attempt}"
