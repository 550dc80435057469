"""Scenes that differ in something unused are the same to the last bit."""

from ajgdata.studies.verification.identities import Unused


def test_what_a_scene_does_not_use_changes_no_bit():
    finding = Unused().run(quick=True)
    assert finding.passed, finding
