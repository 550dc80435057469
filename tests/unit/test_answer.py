"""Sentences on the results at the end of a run."""

from dataclasses import replace

from report_samples import PAPER, sample_report

from ajgdata.pipeline.answer import answer
from ajgdata.report.comparison import Mark, PaperComparison

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
        "Size-Known (CNN, simulated): RMSE 0.72 mm (0.6 to 0.9), chance level 6.4 mm, "
        "published 2.7 mm: better."
    )
    assert "published 2.7 mm" in sentences[0]


def test_the_unit_is_that_of_the_paper():
    row = compared(
        "ycb", 85.6, [Mark("ours", 77.5, 73.1, 81.9), CHANCE], metric="accuracy", unit="%"
    )
    assert answer(replace(sample_report(), comparisons=(row,)))[0] == (
        "Ycb (CNN, simulated): accuracy 78 % (73 to 82), chance level 6.4 %, "
        "published 85.6 %: better."
    )


def test_without_published_values_the_best_model_of_each_task():
    rows = (compared("a", value=None), compared("b", marks=(CHANCE,)))
    assert answer(replace(sample_report(), comparisons=rows)) == [
        "Cube size · edge (best model CNN, simulated): RMSE 2.2 (1.75 to 2.65) mm, "
        "chance level 8.2 mm."
    ]
