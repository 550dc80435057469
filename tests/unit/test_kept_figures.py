"""Figures that were drawn before are brought back, and only where they show the same."""

import os
from functools import partial

import numpy as np
import pytest
from matplotlib.figure import Figure

from ajgdata.paths import FIGURE_FORMATS
from ajgdata.report import kept_figures
from ajgdata.report.blocks import Illustration
from ajgdata.report.format import Caption
from ajgdata.report.kept_figures import KeptFigures, made_of
from ajgdata.report.render import draw_figures

DRAWN = []


def drawn(height):
    DRAWN.append(height)
    figure = Figure((1, height))
    figure.text(0.1, 0.5, f"{height}")
    return figure


def figure_of(height, digest="a"):
    return Illustration("one", Caption("One.", "One."), partial(drawn, height), made_of=digest)


@pytest.fixture
def draw(tmp_path):
    """Draws into a folder of its own; returns how often something was drawn, and the files."""

    def into(name, illustration, code="code"):
        DRAWN.clear()
        draw_figures([illustration], tmp_path / name, KeptFigures(tmp_path / "kept", code))
        files = [tmp_path / name / f"one.{suffix}" for suffix in FIGURE_FORMATS]
        return len(DRAWN), [file.read_bytes() for file in files]

    return into


def test_the_same_is_drawn_once_and_any_difference_anew(draw):
    times, first = draw("a", figure_of(1))
    assert times == 1 and first[0].startswith(b"<?xml") and first[2].startswith(b"%PDF")
    assert draw("b", figure_of(1)) == (0, first)
    assert draw("c", figure_of(1), code="other")[0] == 1
    times, other = draw("d", figure_of(2, "b"))
    assert times == 1 and other[0] != first[0]


def test_what_is_not_known_is_always_drawn(draw):
    for name in ("a", "b"):
        assert draw(name, figure_of(1, ""))[0] == 1
        assert draw(name, figure_of(1), code="")[0] == 1


def test_a_spoilt_figure_is_drawn_anew(draw, tmp_path):
    first = draw("a", figure_of(1))[1]
    (kept,) = (tmp_path / "kept").iterdir()
    whole = kept.read_bytes()
    spoilt = bytearray(whole)
    spoilt[whole.index(b"<?xml") + 40] ^= 1
    for content in (bytes(spoilt), whole[:-30], b""):
        kept.write_bytes(content)
        assert draw("b", figure_of(1)) == (1, first)
        assert draw("c", figure_of(1)) == (0, first)


def test_figures_that_were_not_used_for_longest_go(draw, tmp_path, monkeypatch):
    for number in range(3):
        draw("a", figure_of(1, f"{number}"))
    files = sorted((tmp_path / "kept").iterdir())
    for age, file in enumerate(files):
        os.utime(file, (1000 - age, 1000 - age))
    draw("b", figure_of(1, "0"))  # used just now
    monkeypatch.setattr(kept_figures, "MOST", 2)
    KeptFigures(tmp_path / "kept", "code").tidy()
    assert len(list((tmp_path / "kept").iterdir())) == 2
    assert draw("c", figure_of(1, "0"))[0] == 0


def test_two_processes_tidy_at_once(tmp_path, monkeypatch):
    for number in range(3):
        (tmp_path / f"{number}.zip").touch()

    def raced(folder, pattern):  # the other one was faster with the first
        return [folder / "gone.zip", *sorted(folder.iterdir())]

    monkeypatch.setattr(kept_figures, "MOST", 2)
    monkeypatch.setattr(type(tmp_path), "glob", raced)
    KeptFigures(tmp_path, "code").tidy()
    assert len(list(tmp_path.iterdir())) == 2


def test_a_digest_tells_every_digit_and_every_value():
    many = np.arange(5000.0)
    other = many.copy()
    other[2500] = np.nextafter(other[2500], np.inf)
    assert made_of(many) == made_of(many.copy()) != made_of(other)
    assert made_of(0.1) != made_of(np.nextafter(0.1, 1)) != ""
    assert made_of(object()) == ""  # it does not say what it is


def test_several_processes_draw_the_same_and_pass_on_what_is_wrong(tmp_path):
    def figures(wrong=False):
        made = [figure_of(height)._replace(name=f"{height}") for height in (1, 2, 3)]
        return [*made, made[0]._replace(name="x", draw=lambda: 1 / 0)] if wrong else made

    draw_figures(figures(), tmp_path / "alone")
    DRAWN.clear()
    kept = KeptFigures(tmp_path / "kept", "code")
    shown = draw_figures(figures(), tmp_path / "together", kept, processes=2)
    assert list(shown) == ["1", "2", "3"] and DRAWN == []  # not in this process
    assert len(list(kept.folder.iterdir())) == 3
    files = sorted((tmp_path / "alone").iterdir())
    assert len(files) == 9
    for file in files:
        assert file.read_bytes() == (tmp_path / "together" / file.name).read_bytes()
    with pytest.raises(ZeroDivisionError):
        draw_figures(figures(wrong=True), tmp_path / "wrong", processes=2)
