"""float32 is enough: the response of a scene is that of float64."""

from ajgdata.studies.verification.endurance import SinglePrecision


def test_single_precision_agrees_with_double():
    finding = SinglePrecision().run(quick=True)
    assert finding.passed, finding
    assert finding.value > 0  # the two really differ in precision
