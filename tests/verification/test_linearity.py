"""The response to a sum is the sum of the responses."""

from ajgdata.studies.verification.identities import Linearity


def test_among_grains_and_walls():
    finding = Linearity().run(quick=True)
    assert finding.passed, finding
