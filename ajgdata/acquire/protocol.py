"""Protocol -> grasps, and what of them is left. Pure: knows recordings, opens nothing."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ajgdata.types import GraspProtocol, Recording
from ajgdata.types.protocol import Reference

#: Columns of recordings.csv that say which grasp of the plan a recording is of.
PLANNED, ATTEMPT, REFERENCE = "planned", "grasp_attempt", "reference"
#: Column that says what speaks against a recording, be it kept.
DOUBT = "doubt"


@dataclass(frozen=True)
class PlannedGrasp:
    """One grasp that a protocol asks for. `object` is "" for a reference, which holds nothing."""

    name: str
    object: str
    number: int
    samples: int
    targets: Mapping[str, float | str]
    reference: Reference | None = None


def plan_protocol(protocol: GraspProtocol, session: str) -> list[PlannedGrasp]:
    """Return every grasp of a session, in order.

    Each round holds each object once, so that the day's drift does not look like an object, and a
    session that ends early has as many grasps of each. The random order is drawn from the
    protocol's seed and the session's name.
    """
    generator = np.random.default_rng([protocol.seed, *session.encode()])
    rounds = range(1, protocol.grasps_per_object + 1)
    width = max(2, len(str(protocol.grasps_per_object)))
    grasps = []
    for number in rounds:
        order = np.arange(len(protocol.objects))
        if protocol.order == "random":
            order = generator.permutation(len(protocol.objects))
        for made in (protocol.objects[at] for at in order):
            name = f"{made.name}_{number:0{width}d}"
            grasps.append(
                PlannedGrasp(name, made.name, number, protocol.samples_per_grasp, made.targets)
            )
    return list(_with_references(protocol, grasps))


def _with_references(
    protocol: GraspProtocol, grasps: Sequence[PlannedGrasp]
) -> Iterator[PlannedGrasp]:
    asked = protocol.references
    for at, grasp in enumerate(grasps):
        if asked and at % asked.every == 0:
            number = at // asked.every + 1
            for kind in asked.kinds:
                name = f"{kind}_{number:02d}"
                yield PlannedGrasp(name, "", number, protocol.samples_per_grasp, {}, kind)
        yield grasp


def whole_grasps(recordings: Collection[Recording]) -> dict[str, list[Recording]]:
    """Return the recordings that count of each grasp of a plan: those of its last attempt that are
    not rejected (silence always is).

    A grasp of which fewer than its samples count is not whole.
    """
    counted: dict[str, dict[int, list[Recording]]] = {}
    for one in recordings:
        name = one.labels.get(PLANNED, "")
        if name and (one.quality.lower() != "reject" or one.labels.get(REFERENCE) == "silence"):
            attempts = counted.setdefault(name, {})
            attempts.setdefault(int(one.labels[ATTEMPT]), []).append(one)
    return {name: attempts[max(attempts)] for name, attempts in counted.items()}


def remaining(
    planned: Sequence[PlannedGrasp],
    recordings: Collection[Recording],
    skipped: Collection[str] = (),
) -> list[PlannedGrasp]:
    """Return the grasps of a plan that are neither whole nor skipped, in order."""
    whole = whole_grasps(recordings)
    return [
        grasp
        for grasp in planned
        if grasp.name not in skipped and len(whole.get(grasp.name, ())) < grasp.samples
    ]


def next_attempt(grasp: PlannedGrasp, recordings: Collection[Recording]) -> int:
    """Return the number of the attempt that comes after every one in `recordings`."""
    numbers = (int(r.labels[ATTEMPT]) for r in recordings if r.labels.get(PLANNED) == grasp.name)
    return 1 + max(numbers, default=0)


def grasp_id(grasp: PlannedGrasp, attempt: int) -> str:
    """Return the identity of one attempt at a grasp; the first one has the grasp's name."""
    return grasp.name if attempt == 1 else f"{grasp.name}-{attempt}"
