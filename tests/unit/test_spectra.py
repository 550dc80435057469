"""Mean spectra of a data set as they are drawn, and files of figures that never vary."""

import dataclasses

import numpy as np
import pytest
from matplotlib.text import Text

from ajgdata.report.format import number
from ajgdata.report.report_data import DatasetSummary, Provenance, Spectra
from ajgdata.report.spectra import spectra_caption, spectra_figure, spectra_finding
from ajgdata.types import FeatureSettings


def dataset(source: str = "simulated") -> DatasetSummary:
    frequency_hz = np.arange(33) * 44_100 / 64
    mean = np.stack([np.exp(-frequency_hz / 9_000), np.exp(-frequency_hz / 7_000)])
    return DatasetSummary(
        name="size",
        title="Cube size",
        source=source,
        description="One-second sweeps.",
        n_recordings=1200,
        n_sessions=1,
        sample_rate_hz=44_100,
        licence="CC-BY-4.0",
        citation="The authors, 2026.",
        features=FeatureSettings(band_hz=(100.0, 18_000.0)),
        provenance=Provenance("0.1.0", "abc1234", "c0ffee", "f00d"),
        spectra=Spectra(frequency_hz, ("basalt", "<b>granite</b>"), mean, "kind"),
    )


@pytest.mark.parametrize("source", ["simulated", "recorded"])
def test_spectra_say_where_they_come_from_within_the_figure(source):
    figure = spectra_figure(dataset(source))
    texts = {text.get_text() for text in figure.findobj(Text)}
    assert {"simulated", "recorded"} & texts == {source}
    box, size = figure.get_tightbbox(), figure.get_size_inches()
    assert box.min.min() >= -0.5 / 72 and np.all(box.max <= size + 0.5 / 72)
    assert "each kind: basalt, <b>granite</b>" in spectra_caption(dataset(source)).alt


def test_spectra_are_decibels_of_the_highest_and_an_empty_bin_is_silent():
    data = dataset()
    mean = data.spectra.mean
    mean[:, 5] = 0
    (axes,) = spectra_figure(data).axes
    for line, own in zip(axes.get_lines(), mean[:, 1:], strict=False):  # 0 Hz is not on a log axis
        expected = 20 * np.log10(np.maximum(own / mean[:, 1:].max(), 1e-6))
        assert line.get_ydata() == pytest.approx(expected, abs=1e-9)


def test_the_title_says_where_the_means_differ_most():
    data = dataset()
    mean = data.spectra.mean
    loud = 3 + int(np.argmax(mean.mean(axis=0)[3:]))
    mean[:, loud] = [1e3, 1e4]  # 20 dB apart, and the loudest by far
    frequency = number(float(data.spectra.frequency_hz[loud]), 2)
    told = f"Means per kind differ most at {frequency} Hz, by 20 dB"
    assert spectra_caption(data).alt.startswith(told)
    one = Spectra(data.spectra.frequency_hz, ("a",), mean[:1], "kind")
    assert spectra_finding(dataclasses.replace(data, spectra=one)) == "Mean spectrum of one kind"
