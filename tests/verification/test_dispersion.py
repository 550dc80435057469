"""The discrete dispersion relation of a box mode."""

import numpy as np

from ajgdata.studies.verification.identities import BoxDispersion, WaveDispersion


class SecondOrder(WaveDispersion):
    """The relation of the plain scheme."""

    def _symbol(self, k):
        return np.sin(k * self.h / 2)


class Wrong(BoxDispersion):
    """The relation of the continuous medium, which the grid does not have."""

    def _symbol(self, k):
        return k * self.h / 2


def test_a_box_mode_has_the_dispersion_of_the_scheme():
    finding = BoxDispersion().run(quick=True)
    assert finding.passed, finding


def test_a_plane_wave_has_the_dispersion_of_the_wide_scheme():
    finding = WaveDispersion().run(quick=True)
    assert finding.passed, finding
    assert not SecondOrder().run(quick=True).passed


def test_a_neighbouring_relation_is_told_apart():
    assert not Wrong().run(quick=True).passed
