"""Figures as files, mean spectra, numbers as people write them, and the paper's own numbers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from report_samples import dataset

from ajgdata.paths import Paths
from ajgdata.pipeline.dataset_summary import mean_spectra
from ajgdata.report.canvas import draw, encode, new_figure
from ajgdata.report.comparison import parse_paper
from ajgdata.report.figures import spectra_figure
from ajgdata.report.format import Caption, Score, mean_sd, number
from ajgdata.report.marks import pareto_front
from ajgdata.report.report_data import Illustration
from ajgdata.store.feature_array import frequency_axis
from ajgdata.store.features import FeatureRows, text_column
from ajgdata.store.report_files import read_paper
from ajgdata.types import DataError, DatasetSpec

points = st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=1, max_size=12)


@given(points)
def test_pareto_front_agrees_with_its_definition(pairs):
    cost, error = np.array(pairs, float).T
    expected = [not any(a <= c and b <= e and (a, b) != (c, e) for a, b in pairs) for c, e in pairs]
    assert pareto_front(cost, error).tolist() == expected


def test_numbers_as_people_write_them():
    assert number(1234.5) == "1,234" and number(0.012345) == "0.0123" and number(20.0) == "20"
    assert number(0) == "0" and number(float("nan")) == "—" and number(-0.5) == "-0.5"
    assert mean_sd(Score(2.634, 0.214), "mm") == "2.63 ± 0.21 mm"
    assert mean_sd(Score(12.6, 3.4), "°") == "12.6 ± 3.4°"
    assert mean_sd(Score(123.4, 25.0)) == "123 ± 25"
    assert mean_sd(Score(2.5, 0.0), "mm") == "2.5 mm"
    assert mean_sd(Score(float("nan"), 0.1)) == "—"


def paper_content():
    return read_paper(Paths())


def test_paper_figures_with_a_mistake_are_refused_in_one_line():
    content = paper_content()
    content["figures"][0]["valeu"] = 3
    with pytest.raises(DataError, match=r"paper.yaml: unknown key figures.0.valeu. Correct"):
        parse_paper(content)
    content = paper_content()
    content["figures"].append(content["figures"][1])
    with pytest.raises(DataError, match="listed twice: size"):
        parse_paper(content)


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


def test_spectra_are_decibels_of_the_highest_and_an_empty_bin_is_silent():
    data = dataset("size", "simulated")
    mean = data.spectra.mean
    mean[:, 5] = 0
    picture = spectra_figure(data, data.spectra).draw.args[1]
    for label, own in zip(data.spectra.labels, mean[:, 1:], strict=True):  # no 0 Hz on a log axis
        expected = 20 * np.log10(np.maximum(own / mean[:, 1:].max(), 1e-6))
        levels = [point.score.mean for point in picture.of("", label)]
        assert levels == pytest.approx(expected, abs=1e-9)


FEATURE = np.asarray([[1, 3], [3, 5], [9, 9]], np.float32)
SPEC = DatasetSpec.model_validate(
    {"name": "d", "tasks": {"t": {"target": "y"}}, "targets": {"y": {"kind": "classification"}}}
)


def test_mean_of_each_class_without_those_that_have_none():
    store = FeatureRows(
        FEATURE, (frequency_axis(np.asarray([0.0, 1.0])),), {"y": text_column(["a", "a", ""])}, {}
    )
    spectra = mean_spectra(store, SPEC)
    assert spectra.labels == ("a",)
    np.testing.assert_array_equal(spectra.mean, [[2, 4]])


def test_a_line_of_a_title_does_not_end_between_a_number_and_its_unit():
    title = f"{'A' * 30} {'b' * 25} 0.3 ± 0.1 mm {'c' * 30}"  # the first line holds 63 letters
    figure = new_figure((7.2, 3.0), title, "", [])
    lines = [text.get_text() for text in figure.texts if text.get_text()]
    assert lines == [f"{'A' * 30} {'b' * 25}", f"0.3 ± 0.1 mm {'c' * 30}"]
