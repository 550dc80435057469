"""Heads of figures, and styles of lines."""

import itertools

from drawn_figures import fits, texts

from ajgdata.report.canvas import line_style, new_figure, styled
from ajgdata.report.format import sentence


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
    assert long.get_figheight() > short.get_figheight() == 3.0
    assert fits(long) and "simulated" in texts(long)


def test_a_sentence_begins_with_a_capital_unless_it_is_a_name():
    assert sentence("ridge errs") == "Ridge errs" and sentence("k-NN errs") == "k-NN errs"
    assert sentence("") == "" and sentence("CNN, best") == "CNN, best"
    assert sentence("accuracy: 3") == "Accuracy: 3"
