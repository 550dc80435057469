"""What a cavity settles at when air is pushed in: air, grains, walls and modes share the volume."""

from ajgdata.studies.verification.moving import StaticPressure


def test_it_settles_where_the_springs_hold():
    finding = StaticPressure().run(quick=True)
    assert finding.passed, finding
