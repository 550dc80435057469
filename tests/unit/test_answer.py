"""Sentences on the results at the end of a run."""

from dataclasses import replace

from report_samples import PAPER, sample_report

from ajgdata.report.answer import answer, placebo_sentence
from ajgdata.report.comparison import Change, Mark, PaperComparison, Reason

OURS = Mark("ours", 0.7249, 0.6, 0.9)
CHANCE = Mark("chance", 6.4, 6.4, 6.4)


def compared(name, value=2.7, marks=(CHANCE, OURS), **changes):
    paper = PAPER.model_copy(update={"id": name, "panel": name.title(), "value": value, **changes})
    where = "size", "size", "simulated"
    return PaperComparison(paper, *where, "1 mm; 2 of 3", "CNN", "better", marks=marks)


def test_objects_size_and_angle_come_first():
    names = ("a", "orientation", "size-known", "b", "ycb")
    rows = [compared(name) for name in names] + [compared("ycb", value=9.0)]
    sentences = answer(replace(sample_report(), comparisons=tuple(rows)))
    assert [text.split(" (")[0] for text in sentences] == ["Ycb", "Size-Known", "Orientation"]
    assert sentences[1] == (
        "Size-Known (CNN, simulated): RMSE 0.725 mm (95 % interval 0.6 to 0.9, chance level "
        "6.4 mm); the paper reports 2.7 mm. Our result is better."
    )
    assert "the paper reports 2.7 mm" in sentences[0]


def test_a_difference_gives_its_supported_cause_or_that_no_tested_cause_is_supported():
    up = Change("repeated grasps", "CNN", 0.5, 0.9, supported=True)  # RMSE moves to 2.7 mm
    supported = Reason(("ycb",), "grasps differ too little", "x.html", (up,))
    row = replace(compared("ycb"), reasons=(supported,))
    assert answer(replace(sample_report(), comparisons=(row,)))[0].endswith(
        "Our result is better. Supported cause: grasps differ too little."
    )
    down = Reason(("ycb",), "noise", "x.html", (replace(up, supported=False),))
    row = replace(compared("ycb"), reasons=(down,))
    assert answer(replace(sample_report(), comparisons=(row,)))[0].endswith(
        "Our result is better. No tested cause is supported."
    )


def test_without_published_values_the_best_model_of_each_task():
    rows = (compared("a", value=None), compared("b", marks=(CHANCE,)))
    assert answer(replace(sample_report(), comparisons=rows)) == [
        "Cube size · edge (best model CNN, simulated): RMSE 2.2 (1.75 to 2.65) mm, "
        "chance level 8.2 mm."
    ]


def test_the_placebo_of_each_result_is_one_sentence():
    placebo = Mark("placebo", 5.5, 5.0, 6.0)
    rows = (compared("a", marks=(CHANCE, OURS, placebo)), compared("b"))
    assert placebo_sentence(replace(sample_report(), comparisons=rows)) == (
        "Placebo, one object under several names: A 5.5 mm (chance level 6.4 mm)."
    )
    assert placebo_sentence(replace(sample_report(), comparisons=rows[1:])) == ""
