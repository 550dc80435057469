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


def test_effects_bring_hard_materials_apart_but_not_out_of_the_scatter():
    *_, before, last = STEPS
    table = distances(("80 mm sphere",), (before, last), grasps=2, dx_mm=5.5)
    free, held = table.rows
    for name in HARD:
        # Below 2.5 kHz the weight on the rubber shows once the membrane no longer drowns it.
        assert held[f"{name}_low"] > 3 * free[f"{name}_low"] > 0
        for row in table.rows:
            assert row[name] < row["scatter"] / 10 and row[f"{name}_low"] < row["scatter_low"]
            assert row[name] < row["styrofoam"] / 10
    assert held["styrofoam"] > 0.1
