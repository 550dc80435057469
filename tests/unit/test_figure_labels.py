"""Heads of figures, legends, and names of points."""

import itertools

import numpy as np
import pytest
from drawn_figures import fits, texts
from matplotlib.colors import to_rgb

from ajgdata.report.canvas import (
    COLOURS,
    WIDTH_IN,
    encode,
    line_style,
    new_figure,
    styled,
)
from ajgdata.report.format import sentence
from ajgdata.report.labels import (
    CONTRAST,
    ink,
    label_end,
    reference_line,
    width_in,
    wrapped,
)


def contrast_with_white(colour):
    rgb = np.array(to_rgb(colour))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return 1.05 / (0.05 + 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2])


@styled
def lines_with_names(ends):
    figure = new_figure((WIDTH_IN, 3.0), "Lines", "", ["simulated"])
    axes = figure.subplots()
    for i, end in enumerate(ends):
        axes.plot([0, 1], [0, end], **line_style(i))
        label_end(axes, 1, end, f"line {i}", line_style(i)["color"])
    reference_line(axes, "chance", 0.98 * max(ends), "chance")
    return figure


@pytest.mark.parametrize("ends", [[1.0] * 9, [1.0], [0.5, 0.51, 1.0, 1.01], [1e-3, 1.0]])
def test_lines_and_references_are_named_in_a_legend_beside_the_axes(ends):
    figure = lines_with_names(ends)
    (axes,) = figure.axes
    legend = axes.get_legend()
    names = [text.get_text() for text in legend.get_texts()]
    assert names == [*(f"line {i}" for i in range(len(ends))), "chance"]
    for line, shown in zip(axes.lines, legend.legend_handles, strict=True):
        assert shown.get_color() == line.get_color()
        assert shown.get_linestyle() == line.get_linestyle()
    assert legend.get_window_extent().x0 >= axes.bbox.x1
    assert fits(figure)


def test_of_two_lines_of_one_colour_the_one_that_ends_there_is_named():
    figure = new_figure((WIDTH_IN, 3.0), "Lines", "", ["simulated"])
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], color="#0072B2", ls="--")
    axes.errorbar([0, 1], [0, 5], 4, color="#0072B2", ls=":")
    label_end(axes, 1, 5, "upper", "#0072B2")
    label_end(axes, None, 1, "lower", "#0072B2")
    upper, lower = axes.get_legend().legend_handles
    assert (upper.get_linestyle(), lower.get_linestyle()) == (":", "--")


@pytest.mark.parametrize("colour", [*COLOURS, "white", "#56B4E9"])
def test_text_can_be_read_on_white(colour):
    assert contrast_with_white(ink(colour)) >= CONTRAST - 0.01
    if contrast_with_white(colour) >= CONTRAST:
        assert to_rgb(ink(colour)) == pytest.approx(to_rgb(colour), abs=1 / 255)


def test_neighbouring_styles_differ_without_their_colour():
    looks = [(line_style(i)["marker"], str(line_style(i)["ls"])) for i in range(12)]
    assert all(a[0] != b[0] and a[1] != b[1] for a, b in itertools.pairwise(looks))
    assert len(set(looks)) == len(looks)


def test_a_long_title_takes_more_lines_and_leaves_the_panels_their_size():
    def drawn(title):
        figure = styled(lambda: new_figure((4.0, 3.0), title, "of it", ["simulated"]))()
        return figure, [text.get_text() for text in figure.texts if text.get_size() == 11]

    short, _ = drawn("Short")
    long, lines = drawn("CNN errs by 0.72 ± 0.12 mm where the grasp is new; chance is 6.42 mm")
    assert len(lines) > 1 and " ".join(lines).startswith("CNN errs by 0.72 ± 0.12 mm where")
    assert all(width_in(line, 11, "bold") <= 3.9 for line in lines)
    assert long.get_figheight() > short.get_figheight() == 3.0
    assert fits(long) and "simulated" in texts(long)


def test_no_line_is_wider_than_asked_and_no_word_is_lost():
    text = "CNN errs by 0.72 ± 0.12 mm of 6.42 mm and is right in 79 % of all held-out grasps"
    for width in np.linspace(1.0, 4, 30):
        lines = wrapped(text, width, 11)
        assert " ".join(lines) == text
        assert all(width_in(line, 11) <= max(1.15 * width, 1.4) for line in lines)
        assert not any(line.startswith(("±", "mm", "%", "0.12")) for line in lines)


def test_a_sentence_begins_with_a_capital_unless_it_is_a_name():
    assert sentence("ridge errs") == "Ridge errs" and sentence("k-NN errs") == "k-NN errs"
    assert sentence("") == "" and sentence("CNN, best") == "CNN, best"
    assert sentence("accuracy: 3") == "Accuracy: 3"


def test_the_same_labels_give_the_same_bytes():
    ends = [1.0, 1.0, 0.2]
    assert encode(lines_with_names(ends), "svg") == encode(lines_with_names(ends), "svg")
