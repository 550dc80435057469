"""What a recording cannot distinguish, and what to record next."""

import pytest

from ajgdata.evaluate.design import recording_design

SESSIONS = ["1", "1", "2", "2"] * 2
VALUES = ["a"] * 4 + ["b"] * 4


@pytest.mark.parametrize(
    ("placements", "sessions", "problem", "fix"),
    [
        (["p1", "p1", "p2", "p2", "q1", "q1", "q2", "q2"], SESSIONS, "one placement", "in rounds"),
        (list("ABCDEFGH"), SESSIONS, "", ""),
        (list("ABCDEFGH"), ["1"] * 8, "all recordings are of one session", "another session"),
        (None, SESSIONS, "placements are unknown", "add the column placement_id"),
        (["", *"BCDEFGH"], SESSIONS, "placements are unknown", "add the column"),
        (["p"] * 4 + ["q"] * 4, ["1"] * 8, "one placement", "another session"),
    ],
)
def test_problem_and_fix_of_a_design(placements, sessions, problem, fix):
    design = recording_design(VALUES, sessions, placements)
    assert problem in design.problem
    assert fix in design.fix
    assert bool(design.problem) == bool(problem) == bool(design.fix)


def test_a_class_of_one_recording_is_this_recording():
    design = recording_design(["a", "b", "b"], ["1", "2", "2"], ["p", "q", "r"])
    assert "a class has one recording" in design.problem
    assert "in rounds" in design.fix


def test_the_number_of_placements_is_that_of_the_class_with_the_fewest():
    placements = ["p1", "p2", "p3", "p3", "q1", "q1", "q1", "q1"]
    assert recording_design(VALUES, ["1"] * 8, placements).placements == 1
    more = ["p1", "p2", "p3", "p3", "q1", "q1", "q2", "q2"]
    assert recording_design(VALUES, ["1"] * 8, more).placements == 2
    # two in its better session: the other one can be held out
    assert recording_design(VALUES, ["1", "1", "1", "2"] * 2, more).placements == 2
