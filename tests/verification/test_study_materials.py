"""What the paper estimates of contact effects say, and that they say why."""

from ajgdata.studies.materials.contact_estimates import HARD, SHAPES, WORTH, estimates
from ajgdata.studies.materials.material_distances import STEPS, distances


def test_estimates_separate_what_is_worth_simulating():
    table = estimates()
    change = {(row["shape"], row["effect"]): row["change"] for row in table.rows}
    for shape in SHAPES:
        through = change[shape, "grain on object through the membrane"]
        assert WORTH < through < change[shape, "grain on object, no membrane"] / 10
        for small in (
            "depth of the imprint",
            "heat into a bare surface",
            "micro-slip at 100 dB",
            "stiffening by sound at 100 dB",
        ):
            assert change[shape, small] < WORTH
        assert change[shape, "weight on 5 mm of rubber"] > 10 * WORTH
    assert change["5 mm plate", "bending on 5 mm of rubber"] > 10 * WORTH
    assert change["80 mm sphere", "weight on its Hertz contact, hard ground"] > 10 * WORTH
    assert all(row["worth"] == (row["change"] > WORTH) for row in table.rows)


def test_hard_balls_lie_apart_by_how_light_they_are_but_not_out_of_the_scatter():
    *_, before, last = STEPS
    table = distances(("80 mm sphere",), (before, last), grasps=2, dx_mm=5.5)
    for row in table.rows:
        # Low sound moves a ball on its rubber by 1/mass: wood, plastic, aluminium, from steel.
        assert row["wood_low"] > row["plastic_low"] > row["aluminium_low"] > 0
        for name in HARD:
            assert row[name] < row["scatter"] / 10 and row[f"{name}_low"] < row["scatter_low"]
            assert row[name] < row["styrofoam"] / 10
    assert table.rows[-1]["styrofoam"] > 0.1
