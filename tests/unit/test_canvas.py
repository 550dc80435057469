"""Figures as files: drawn once for each, and with fonts that publishers take."""

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


def test_a_pdf_embeds_truetype():
    pdf = encode(draw(illustration()), "pdf")
    assert b"/CIDFontType2" in pdf  # Type 3 is what publishers refuse
    assert b"/Type3" not in pdf


def test_each_figure_is_saved_in_each_format(tmp_path):
    assert list(draw_figures([illustration()], tmp_path)) == ["one"]
    assert {path.name for path in tmp_path.iterdir()} == {"one.svg", "one.png", "one.pdf"}
