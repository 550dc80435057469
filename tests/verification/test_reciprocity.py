"""Speaker and microphone may change places."""

from ajgdata.studies.verification.identities import Reciprocity


def test_in_a_whole_scene():
    finding = Reciprocity().run(quick=True)
    assert finding.passed, finding
