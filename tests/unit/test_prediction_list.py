"""Predictions that a page lists with their sounds: 10 stones, and 12 sizes."""

import shlex

import numpy as np
from result_samples import CLASSES, kinds, sizes

from ajgdata.experiments.prediction_list import LARGEST_ERRORS, prediction_list


def sound(name: str) -> str:
    """Return a link to all recordings but r3."""
    return "" if name == "r3" else f"../../data/{name}.wav"


def test_each_number_of_the_matrix_leads_to_its_recordings():
    """True basalt: 3 correct, 1 wrong (r3); true granite: 2 wrong (r4, r5), 4 correct."""
    listed = prediction_list(kinds(), sound)
    assert listed.title == "3 of 10 recordings are predicted wrongly (CNN)"
    assert listed.classes == CLASSES
    assert [[cell.text for cell in row.cells] for row in listed.matrix] == [["3", "1"], ["2", "4"]]
    correct = [[cell.is_correct for cell in row.cells] for row in listed.matrix]
    assert correct == [[True, False], [False, True]]
    wrong = [row.recording for row in listed.rows if row.is_wrong]
    assert sorted(wrong) == ["r3", "r4", "r5"]
    (of_basalt,) = [row for row in listed.rows if row.recording == "r3"]
    assert of_basalt.link == "" and of_basalt.pair == listed.matrix[0].cells[1].anchor
    filter_text = f"label={CLASSES[0]} predicted={CLASSES[1]}"
    assert shlex.split(listed.matrix[0].cells[1].command)[-1] == filter_text
    assert listed.command.endswith("--sort=-confidence") and "wrong=yes" in listed.command
    anchors = {shown.anchor: shown.prediction.recording for shown in listed.shown if shown.anchor}
    assert anchors[of_basalt.pair] == "r3" and len(anchors) == 4
    # One correct prediction of each class is listed for comparison.
    assert sorted(row.true for row in listed.rows if not row.is_wrong) == sorted(CLASSES)


def test_the_largest_errors_of_numbers_come_first():
    """The errors of each size are -1, 1, -3 and 3 mm."""
    listed = prediction_list(sizes(), sound)
    assert listed.matrix == () and len(listed.rows) == min(12, LARGEST_ERRORS)
    errors = [row.certainty for row in listed.rows]
    assert sorted(errors[:6]) == ["+3 mm"] * 3 + ["-3 mm"] * 3
    assert sorted(errors[6:]) == ["+1 mm"] * 3 + ["-1 mm"] * 3
    first = listed.rows[0]
    assert (first.recording, first.true, first.predicted) == ("r2", "10 mm", "7 mm")


def test_a_vector_has_no_list():
    assert prediction_list(sizes(axes=("x_m", "y_m")), sound) is None


def test_anchors_are_positions_so_any_name_of_a_class_is_allowed():
    names = {row.pair for row in prediction_list(kinds(), sound).rows}
    assert names == {f"predictions-stones-kind-{i}-{j}" for i, j in np.ndindex(2, 2)}
