"""A protocol becomes a plan, and what of it is left follows from what is there."""

import pytest
from pydantic import ValidationError

from ajgdata.acquire.protocol import (
    grasp_id,
    next_attempt,
    plan_protocol,
    remaining,
    whole_grasps,
)
from ajgdata.types import GraspProtocol, Recording

BASE = {
    "objects": [{"name": "cube", "targets": {"label": "box"}}, {"name": "ball"}, {"name": "bar"}],
    "grasps_per_object": 4,
}


def protocol(**changes) -> GraspProtocol:
    return GraspProtocol.model_validate(BASE | changes)


def rows(grasp, attempt=1, quality="ok", samples=None):
    return [
        Recording(
            recording_id=f"{grasp_id(grasp, attempt)}_{n + 1}",
            file="audio/x.wav",
            grasp_id=grasp_id(grasp, attempt),
            sample=n,
            quality=quality,
            labels={
                "planned": grasp.name,
                "grasp_attempt": str(attempt),
                "reference": grasp.reference,
            },
        )
        for n in range(grasp.samples if samples is None else samples)
    ]


def test_rounds_go_round_the_objects():
    plan = plan_protocol(protocol(), "s1")
    assert [g.object for g in plan] == ["cube", "ball", "bar"] * 4
    assert [g.name for g in plan[:4]] == ["cube_01", "ball_01", "bar_01", "cube_02"]
    assert (plan[0].targets, plan[1].targets) == ({"label": "box"}, {})
    assert {g.samples for g in plan} == {1}


def test_a_random_order_is_one_of_each_round_and_the_same_again():
    spec = protocol(order="random", grasps_per_object=30)
    plan = [g.object for g in plan_protocol(spec, "s1")]
    rounds = [tuple(plan[at : at + 3]) for at in range(0, 90, 3)]
    assert all(sorted(names) == ["ball", "bar", "cube"] for names in rounds)
    assert len(set(rounds)) == 6  # 3! orders; that one of them is missing: 6 (5/6)^30 = 2.5 %
    assert plan == [g.object for g in plan_protocol(spec, "s1")]
    assert plan != [g.object for g in plan_protocol(spec, "s2")]
    assert plan != [g.object for g in plan_protocol(spec.model_copy(update={"seed": 1}), "s1")]


def test_references_stand_before_every_nth_grasp():
    plan = plan_protocol(protocol(references={"every": 5}), "s1")
    names = [g.name for g in plan]
    assert names[:2] == ["empty_01", "cube_01"]
    assert [n for n, g in enumerate(plan) if g.reference] == [0, 6, 12]
    assert {g.object for g in plan if g.reference} == {""}
    assert all(not g.targets for g in plan if g.reference)


def test_what_exists_is_counted():
    plan = plan_protocol(protocol(samples_per_grasp=2), "s1")
    assert remaining(plan, []) == plan
    there = rows(plan[0]) + rows(plan[1], samples=1) + rows(plan[2], quality="clipped")
    assert remaining(plan, there) == [plan[1], *plan[3:]]
    assert remaining(plan, there, skipped=[plan[1].name]) == plan[3:]
    rejected = rows(plan[0], quality="reject") + rows(plan[2])
    assert remaining(plan, rejected)[0] == plan[0]


def test_a_second_attempt_has_an_id_of_its_own_and_stands_for_the_first():
    plan = plan_protocol(protocol(samples_per_grasp=2), "s1")
    first = rows(plan[0], quality="reject")
    assert next_attempt(plan[0], []) == 1
    assert next_attempt(plan[0], first) == 2
    both = first + rows(plan[0], attempt=2)
    assert [r.grasp_id for r in whole_grasps(both)["cube_01"]] == ["cube_01-2"] * 2
    assert plan[0] not in remaining(plan, both)
    # Halves of two attempts are no grasp.
    halves = rows(plan[0], samples=1) + rows(plan[0], attempt=2, samples=1)
    assert plan[0] in remaining(plan, halves)


def test_what_a_protocol_cannot_be():
    with pytest.raises(ValidationError, match="lists one twice"):
        protocol(objects=[{"name": "a"}, {"name": "a"}])
    with pytest.raises(ValidationError, match="an object is called empty"):
        protocol(objects=[{"name": "empty"}])
