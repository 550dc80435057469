"""Heads of figures, and labels that stand beside what they name: they keep clear of one another."""

import itertools

import numpy as np
import pytest
from drawn_figures import fits, texts
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.colors import to_rgb
from matplotlib.text import Text

from ajgdata.report.canvas import (
    COLOURS,
    WIDTH_IN,
    encode,
    line_style,
    model_line,
    new_figure,
    styled,
)
from ajgdata.report.format import sentence
from ajgdata.report.labels import (
    CONTRAST,
    EndLabel,
    PointLabel,
    balanced,
    ink,
    label_end,
    label_point,
    reference_line,
    spread_out,
    width_in,
    wrapped,
)

places = st.lists(st.floats(-50, 150), min_size=1, max_size=9)


def contrast_with_white(colour):
    rgb = np.array(to_rgb(colour))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return 1.05 / (0.05 + 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2])


@given(places)
def test_spread_labels_do_not_overlap_and_stay_within(wanted):
    found = spread_out(np.array(wanted), np.full(len(wanted), 10.0), 0.0, 100.0)
    assert np.all(np.diff(np.sort(found)) >= 10 - 1e-9)
    assert found.min() >= 5 - 1e-9 and found.max() <= 95 + 1e-9
    for (a, x), (b, y) in itertools.combinations(zip(wanted, found, strict=True), 2):
        assert (a - b) * (x - y) >= 0 or a == b  # in the order of what they name


def test_labels_that_are_apart_already_stay_where_they_are():
    wanted = np.array([80.0, 20.0, 50.0])
    np.testing.assert_allclose(spread_out(wanted, np.full(3, 10.0), 0, 100), wanted)
    assert len(spread_out(np.array([]), np.array([]), 0, 1)) == 0


def test_of_two_labels_at_one_place_each_gives_way_by_half():
    np.testing.assert_allclose(
        spread_out(np.array([50.0, 50]), np.array([8.0, 8]), 0, 100), [46, 54]
    )


def boxes(figure, kind):
    """The boxes of labels of one kind in the pixels of a figure."""
    found = figure.findobj(kind)
    renderer = figure.canvas.get_renderer()
    return [Text.get_window_extent(label, renderer) for label in found]


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
def test_names_at_the_ends_of_lines_do_not_cover_one_another(ends):
    figure = lines_with_names(ends)
    names = boxes(figure, EndLabel)
    assert len(names) == len(ends) + 1
    assert not [
        1 for a, b in itertools.combinations(names, 2) if a.y0 < b.y1 - 0.5 and b.y0 < a.y1 - 0.5
    ]
    assert min(box.x0 for box in names) > figure.axes[0].bbox.x1
    assert fits(figure)


def test_names_beside_points_keep_clear_of_one_another():
    @styled
    def drawn():
        figure = new_figure((WIDTH_IN, 3.0), "Points", "", ["recorded"])
        axes = figure.subplots()
        for i, (x, y) in enumerate([(0, 0), (0.02, 0.02), (1, 1), (0.98, 1), (1, 0.5)]):
            axes.plot(x, y, "o")
            label_point(axes, x, y, f"point {i}", COLOURS[i])
        return figure

    figure = drawn()
    for a, b in itertools.combinations(boxes(figure, PointLabel), 2):
        assert not (a.x0 < b.x1 and b.x0 < a.x1 and a.y0 < b.y1 and b.y0 < a.y1)
    assert fits(figure)


@pytest.mark.parametrize("colour", [*COLOURS, "white", "#56B4E9"])
def test_text_can_be_read_on_white(colour):
    assert contrast_with_white(ink(colour)) >= CONTRAST - 0.01
    if contrast_with_white(colour) >= CONTRAST:
        assert to_rgb(ink(colour)) == pytest.approx(to_rgb(colour), abs=1 / 255)


def test_neighbouring_styles_differ_without_their_colour():
    for style in (model_line, line_style):
        looks = [(style(i)["marker"], str(style(i)["ls"])) for i in range(12)]
        assert all(a[0] != b[0] and a[1] != b[1] for a, b in itertools.pairwise(looks))
        assert len(set(looks)) == len(looks)


def test_a_long_title_takes_more_lines_and_leaves_the_panels_their_size():
    def drawn(title):
        figure = styled(lambda: new_figure((4.0, 3.0), title, "of it", ["simulated"]))()
        return figure, [text.get_text() for text in figure.texts if text.get_size() == 11]

    short, _ = drawn("Short")
    long, lines = drawn("CNN errs by 0.72 ± 0.12 mm where the grasp is new; chance is 6.42 mm")
    assert len(lines) > 1 and " ".join(lines).startswith("CNN errs by 0.72 ± 0.12 mm where")
    assert all(width_in(line, 11, "bold") <= 3.8 for line in lines)
    assert long.get_figheight() > short.get_figheight() == 3.0
    assert fits(long) and "simulated" in texts(long)


def test_a_title_of_one_endless_word_is_made_smaller():
    figure = styled(lambda: new_figure((3.0, 2.0), "x" * 30, "y" * 20, ["recorded"]))()
    assert fits(figure)


def test_lines_end_neither_before_a_spread_nor_before_a_unit():
    text = "errs by 0.72 ± 0.12 mm of 6.42 mm and is right in 79 %"
    for width in np.linspace(0.5, 4, 30):
        lines = wrapped(text, width, 11)
        assert " ".join(lines) == text
        assert not any(line.startswith(("±", "mm", "%", "0.12")) for line in lines)
    even = balanced("one two three four five six", width_in("one two three four five", 9), 9)
    assert even == ["one two three", "four five six"]


def test_a_sentence_begins_with_a_capital_unless_it_is_a_name():
    assert sentence("ridge errs") == "Ridge errs" and sentence("k-NN errs") == "k-NN errs"
    assert sentence("") == "" and sentence("CNN, best") == "CNN, best"
    assert sentence("accuracy: 3") == "Accuracy: 3"


def test_the_same_labels_give_the_same_bytes():
    ends = [1.0, 1.0, 0.2]
    assert encode(lines_with_names(ends), "svg") == encode(lines_with_names(ends), "svg")
