"""Figures as files: drawn once for each, and with fonts that publishers take."""

import pytest
from matplotlib.figure import Figure

from ajgdata.report.blocks import Illustration
from ajgdata.report.canvas import draw, encode, new_figure
from ajgdata.report.format import Caption
from ajgdata.report.render import draw_figures


def illustration():
    def drawn():
        figure = new_figure((4, 3), "Error falls with size", "of cubes", ["simulated"])
        axes = figure.subplots()
        axes.plot([1, 2, 3], [3, 1, 2])
        axes.set(xlabel="Edge, mm", ylabel="Error, mm")
        return figure

    return Illustration("one", Caption("One.", "One."), drawn)


def test_a_file_takes_one_drawing_of_its_figure(monkeypatch):
    figure, drawings = draw(illustration()), []
    once = Figure.draw
    monkeypatch.setattr(
        Figure, "draw", lambda self, renderer: drawings.append(once(self, renderer))
    )
    for number, suffix in enumerate(("svg", "png", "pdf"), 1):
        encode(figure, suffix)
        assert len(drawings) == number


def test_axes_stand_clear_of_the_head_before_anything_is_saved():
    figure = draw(illustration())
    (axes,) = figure.axes
    head = min(text.get_window_extent().y0 for text in figure.texts)
    box = axes.get_tightbbox()
    assert box.y1 < head
    assert 0 <= box.x0 < box.x1 <= figure.bbox.width


def test_a_pdf_embeds_truetype():
    pdf = encode(draw(illustration()), "pdf")
    assert b"/CIDFontType2" in pdf  # Type 3 is what publishers refuse
    assert b"/Type3" not in pdf


def test_several_processes_draw_the_same_and_pass_on_errors(tmp_path):
    listed = [illustration()._replace(name=name) for name in ("a", "b", "c")]
    assert list(draw_figures(listed, tmp_path / "alone")) == ["a", "b", "c"]
    draw_figures(listed, tmp_path / "together", processes=2)
    files = sorted((tmp_path / "alone").iterdir())
    assert len(files) == 9
    for file in files:
        assert file.read_bytes() == (tmp_path / "together" / file.name).read_bytes()
    wrong = [*listed, listed[0]._replace(name="x", draw=lambda: 1 / 0)]
    with pytest.raises(ZeroDivisionError):
        draw_figures(wrong, tmp_path / "wrong", processes=2)
