"""A report as one file: two pages with equal anchors, a figure, and two sounds."""

import base64
import re

import numpy as np
import pytest
import soundfile
from bs4 import BeautifulSoup

from ajgdata.paths import Paths
from ajgdata.pipeline import one_file as written
from ajgdata.report.one_file import NOT_CONTAINED, one_file
from ajgdata.store.audio import mp3_bytes

NAVIGATION = (
    '<nav class="site"><a class="skip" href="#body">To the content</a><ul>'
    '<li><a href="{0}index.html">Overview</a></li>'
    '<li><a href="{0}experiments/size.html">Size</a></li></ul></nav>'
)
PAGE = (
    "<html><head><style></style></head>"
    "<body>{0}<div class='content' id='body'>{1}</div></body></html>"
)
FIRST = (
    '<h1 id="top">First</h1><a href="experiments/size.html#top">size</a> <a href="run.csv">run</a>'
    '<a href="https://arxiv.org/abs/2603.00351">paper</a><img src="figures/a.svg" loading="lazy">'
    '<p class="phone"><img src="figures/a.svg"></p>'
)
SECOND = (
    '<h1 id="top">Second</h1><a href="../index.html">back</a><a href="#top">top</a>'
    '<section aria-labelledby="top"></section>'
    '<audio src="../../data/long%20file.wav#t=0.5,1"></audio><audio src="../../data/b.wav"></audio>'
)
PAGES = {
    "index.html": PAGE.format(NAVIGATION.format(""), FIRST),
    "experiments/size.html": PAGE.format(NAVIGATION.format("../"), SECOND),
}


@pytest.fixture
def joined():
    return one_file(PAGES, lambda link: f"data:{link}", lambda link: None)


def test_links_stay_inside_and_other_files_become_text(joined):
    document = BeautifulSoup(joined.html, "html.parser")
    anchors = [element["id"] for element in document.select("[id]")]
    assert len(set(anchors)) == len(anchors)
    links = [element["href"] for element in document.select("a[href]")]
    inside = {link[1:] for link in links if link.startswith("#")}
    assert inside <= set(anchors)
    assert "page-experiments-size--top" in inside and "page-index" in inside
    outside = [link for link in links if not link.startswith("#")]
    assert outside == ["https://arxiv.org/abs/2603.00351"]
    assert "run" in document.text and "run.csv" not in joined.html
    labels = [element["aria-labelledby"] for element in document.select("[aria-labelledby]")]
    assert labels == ["page-experiments-size--top"]


def test_each_image_is_contained_once_and_missing_sounds_are_named(joined):
    document = BeautifulSoup(joined.html, "html.parser")
    assert [image["src"] for image in document.select("img")] == ["data:figures/a.svg"]
    assert not document.select("audio") and document.text.count(NOT_CONTAINED) == 2
    assert (joined.n_sounds, joined.n_omitted) == (0, 2)


def test_a_repeated_sound_is_contained_once_with_links_to_its_player():
    twice = '<audio src="../data/a.wav"></audio>'
    pages = {
        "index.html": PAGE.format(NAVIGATION.format(""), twice * 2),
        "experiments/size.html": PAGE.format(
            NAVIGATION.format("../"), '<audio src="../../data/a.wav"></audio>'
        ),
    }
    joined = one_file(pages, lambda link: "", lambda link: f"data:{link}")
    document = BeautifulSoup(joined.html, "html.parser")
    assert [audio["src"] for audio in document.select("audio")] == ["data:../data/a.wav"]
    assert len(document.select("a[href='#sound-1']")) == 2
    assert document.select_one("#sound-1").name == "audio"
    assert (joined.n_sounds, joined.n_omitted) == (1, 0)


@pytest.fixture
def project(tmp_path):
    """A project whose report has both pages, and a sound of 2 s at 48 kHz."""
    report = tmp_path / "results/report"
    (report / "experiments").mkdir(parents=True)
    (report / "figures").mkdir()
    (report / "figures/a.svg").write_text("<svg/>")
    for name, text in PAGES.items():
        (report / name).write_text(text)
    (tmp_path / "results/data").mkdir()
    tone = 0.5 * np.sin(2 * np.pi * 1000 * np.arange(96_000) / 48_000)
    soundfile.write(tmp_path / "results/data/long file.wav", tone, 48_000)
    return tmp_path


def test_the_contained_sound_is_the_segment_of_its_link(project, tmp_path):
    result = written.write_one_file(Paths(project), tmp_path / "sent.html")
    html = (tmp_path / "sent.html").read_text()
    assert result == (len(html.encode()), 1, 1)  # b.wav does not exist
    (content,) = re.findall(r'src="data:audio/mpeg;base64,([^"]+)"', html)
    (tmp_path / "a.mp3").write_bytes(base64.b64decode(content))
    samples, rate = soundfile.read(tmp_path / "a.mp3")
    assert rate == 44_100 and len(samples) == pytest.approx(0.5 * rate, abs=2 * 1152)
    spectrum = np.abs(np.fft.rfft(samples))
    assert np.argmax(spectrum) * rate / len(samples) == pytest.approx(1000, abs=5)


def test_players_count_for_the_limit(project, tmp_path, monkeypatch):
    """The second sound does not fit, because the first one has a player as well."""
    empty = one_file(PAGES, lambda link: f"data:{link}", lambda link: "")
    joined = one_file(PAGES, lambda link: f"data:{link}", lambda link: None)
    assert len(empty.html) > len(joined.html)
    written.write_one_file(Paths(project), tmp_path / "sent.html")
    size = (tmp_path / "sent.html").stat().st_size
    monkeypatch.setattr(written, "MAX_BYTES", size)
    result = written.write_one_file(Paths(project), tmp_path / "again.html")
    assert result.n_sounds == 0 and result.n_bytes <= size


def test_sounds_that_make_the_file_too_large_are_omitted(project, tmp_path, monkeypatch):
    monkeypatch.setattr(written, "MAX_BYTES", 5_000)
    result = written.write_one_file(Paths(project), tmp_path / "sent.html")
    assert (result.n_sounds, result.n_omitted) == (0, 2)
    assert result.n_bytes < 5_000 < len(mp3_bytes(np.zeros(22_050), 44_100)) * 2
