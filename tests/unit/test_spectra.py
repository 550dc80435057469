"""Mean spectra of a data set as they are drawn, and files of figures that never vary."""

import dataclasses

import numpy as np
import pytest
from matplotlib.text import Text

from ajgdata.report.canvas import encode, save_figure
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


def test_spectra_are_decibels_about_their_mean():
    data = dataset()
    mean = data.spectra.mean
    upper, lower = spectra_figure(data).axes[:2]
    level = upper.get_lines()[0].get_ydata()
    overall = mean.mean(axis=0)[1:]  # 0 Hz has no place on a log axis
    assert level == pytest.approx(20 * np.log10(overall / overall.max()), abs=1e-9)
    shown = np.asarray(lower.collections[0].get_array()).reshape(2, -1)
    assert shown == pytest.approx(20 * np.log10(mean[:, 1:] / overall), abs=1e-9)


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
    spectra_figure(dataclasses.replace(data, spectra=one))


def test_an_empty_bin_is_silence_not_infinity():
    data = dataset()
    data.spectra.mean[:, 5] = 0
    level = spectra_figure(data).axes[0].get_lines()[0].get_ydata()
    assert level.min() == pytest.approx(-120)


def test_the_same_figure_gives_the_same_bytes(tmp_path):
    figure = spectra_figure(dataset())
    first = [p.read_bytes() for p in save_figure(figure, tmp_path / "a" / "one.figure")]
    again = [p.read_bytes() for p in save_figure(figure, tmp_path / "b")]
    assert first == again
    assert encode(spectra_figure(dataset()), "svg") == first[0]
    assert [c[:5] for c in first] == [b"<?xml", b"\x89PNG\r", b"%PDF-"]
    assert b"<dc:date>" not in first[0] and b"CreationDate" not in first[2]
    names = sorted(p.name for p in (tmp_path / "a").iterdir())
    assert names == ["one.figure.pdf", "one.figure.png", "one.figure.svg"]
