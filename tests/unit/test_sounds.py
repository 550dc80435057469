"""Sounds to compare: chosen by the rule that the page states, and nothing but what was measured."""

import numpy as np
import pytest
from drawn_figures import fits, texts
from html_page import Page
from worlds import write_tone

from ajgdata.pipeline.sounds import GRASPS, RULES, VALUES, Rows, chosen_pairs, sounds_of
from ajgdata.report.canvas import draw
from ajgdata.report.format import sentence
from ajgdata.report.render import draw_figures, environment
from ajgdata.report.sounds import LOWEST_DB, apart
from ajgdata.store.sessions import read_dataset
from ajgdata.types import Recording, Target

CLASSES = {"object": Target(kind="classification")}
SIZES = {"edge_mm": Target(kind="regression", unit="mm")}


def rows(*given):
    """Rows of (session, target, object, grasp, spectrum), named by their number."""
    session, target, thing, grasp, feature = zip(*given, strict=True)
    name = np.array([f"{s}/r{i}" for i, s in enumerate(session)])
    columns = (np.array(c) for c in (target, thing, session, grasp))
    return Rows(name, *columns, np.array(feature, float))


def test_one_object_grasped_twice_and_the_class_to_mistake_it_for():
    given = rows(
        ("s1", "apple", "apple", "g1", [9, 0, 0]),  # grasped once: it cannot be the first
        ("s1", "bolt", "bolt", "g2", [0, 9, 1]),
        ("s1", "bolt", "bolt", "g2", [0, 9, 1]),  # the same grasp
        ("s1", "bolt", "bolt", "g3", [0, 9, 2]),
        ("s1", "can", "can", "g4", [1, 0, 9]),
        ("s1", "dice", "dice", "g5", [0, 7, 3]),  # nearest to the bolt
    )
    assert chosen_pairs(given, "classification") == {GRASPS: (1, 3), VALUES: (1, 5)}


def test_what_is_compared_differs_in_nothing_else_if_that_can_be_had():
    given = rows(
        ("s1", "dry", "cup", "g1", [1, 0]),
        ("s1", "dry", "jug", "g1", [1, 0]),  # another object: no second grasp of the cup
        ("s2", "dry", "jug", "g1", [1, 0]),  # a second grasp of the jug: grasps are of a session
        ("s2", "wet", "cup", "g7", [0, 1]),
        ("s1", "wet", "cup", "g8", [0, 1]),
        ("s1", "wet", "jug", "g9", [0, 1]),
    )
    assert chosen_pairs(given, "classification") == {GRASPS: (1, 2), VALUES: (1, 5)}


def test_the_smallest_value_and_the_largest():
    given = rows(
        ("s1", 30.0, "c", "g1", [1, 0]), ("s1", 10.0, "a", "g2", [0, 1]),
        ("s1", 20.0, "b", "g3", [0, 1]), ("s1", 10.0, "a", "g4", [0, 1]),
    )  # fmt: skip
    assert chosen_pairs(given, "regression") == {GRASPS: (1, 3), VALUES: (1, 0)}


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ([("s1", 1.0, "a", "g1", [1]), ("s1", 2.0, "a", "g2", [1])], {VALUES: (0, 1)}),
        ([("s1", 1.0, "a", "g1", [1]), ("s1", 1.0, "a", "g2", [1])], {GRASPS: (0, 1)}),
        ([("s1", 1.0, "a", "g1", [1])], {}),
    ],
)
def test_a_pair_that_cannot_be_had_is_left_out(given, found):
    assert chosen_pairs(rows(*given), "regression") == found


def test_how_far_apart():
    assert apart(np.array([2.0, 0]), np.array([0, 2.0])) == pytest.approx(2**0.5)
    assert apart(np.array([1.0, 1]), np.array([3.0, 3])) == pytest.approx(1.0)  # 2√2 over 2√2
    assert apart(np.zeros(2), np.zeros(2)) == 0


@pytest.fixture
def made(project):
    """Four tones: a box in two grasps, and two others; one of them under a name from elsewhere."""
    project.declare(
        targets={
            **{k: v.model_dump() for k, v in CLASSES.items()},
            "edge_mm": {"kind": "regression", "unit": "mm"},
        },
        tasks={"thing": {"target": "object"}, "edge": {"target": "edge_mm"}},
    )
    audio = project.folder() / "audio"
    given = [("box 1", "box", "g1", 500), ("b2", "box", "g2", 510), ("c", "<i>", "g3", 520)]
    given.append(("d", "door", "g4", 1500))
    project.write([
        Recording(
            recording_id=name, file=f"audio/{name}.wav", grasp_id=grasp, object=thing,
            sha256=write_tone(audio / f"{name}.wav", hz),
            labels={"edge_mm": str(hz), "force_n": f"{hz / 1000}", "room": "007"},
        )
        for name, thing, grasp, hz in given
    ])  # fmt: skip
    project.shard()
    store, _ = project.merge("s1", targets=CLASSES | SIZES)
    return project, read_dataset(project.paths, "d"), store


def test_what_is_heard_is_the_recordings_own_bytes(made, tmp_path):
    project, spec, store = made
    folder = tmp_path / "sounds"
    found = sounds_of(project.paths, spec, store, folder)
    assert found.rule == RULES["classification"]
    twice, two = found.pairs
    # b2 comes before box 1; the tone nearest to 505 Hz is that of 520
    assert [twice.first.recording, twice.second.recording] == ["s1/b2", "s1/box 1"]
    assert [two.first.recording, two.second.recording] == ["s1/b2", "s1/c"]
    assert twice.title == "box, grasped twice" and two.title == "box and <i>"
    assert two.labels == ("box", "<i>")
    for sound in (*twice[3:5], two.second):
        own = project.folder() / "audio" / f"{sound.recording.split('/')[1]}.wav"
        assert (folder / sound.file).read_bytes() == own.read_bytes()
    assert len(list(folder.iterdir())) == 3
    assert twice.facts == (("edge mm 510", "force n 0.51"), ("edge mm 500", "force n 0.5"))
    assert dict(twice.first.facts)["room"] == "007"  # no number


def test_the_task_says_what_is_compared(made, tmp_path):
    project, spec, store = made
    found = sounds_of(project.paths, spec, store, tmp_path, "edge")
    (pair,) = found.pairs  # no value stands twice
    assert found.rule == RULES["regression"]
    assert pair.title == "500 mm and 1,500 mm" and pair.name == "sounds--d-edge_mm-values"


def test_a_task_about_some_classes_is_heard_in_these_alone(made, tmp_path):
    project, spec, store = made
    some = spec.tasks["thing"].model_copy(update={"classes": ("door", "box")})
    spec = spec.model_copy(update={"tasks": {**spec.tasks, "some": some}})
    found = sounds_of(project.paths, spec, store, tmp_path / "sounds", "some")
    assert [pair.title for pair in found.pairs] == ["box, grasped twice", "box and door"]
    assert found.pairs[0].name == "sounds--d-some-grasps"  # those of all classes are others


@pytest.mark.parametrize("gone", ["file", "bytes", "table"])
def test_a_recording_that_is_gone_or_another_is_not_heard(made, tmp_path, gone):
    project, spec, store = made
    path = project.folder() / "audio" / "c.wav"
    if gone == "file":
        path.unlink()
    elif gone == "bytes":
        write_tone(path, 521)
    else:
        project.paths.recordings_file("d", "s1").unlink()
    found = sounds_of(project.paths, spec, store, tmp_path / "sounds")
    assert [pair.by_grasp for pair in found.pairs] == ([] if gone == "table" else [True])


def test_without_a_task_there_is_nothing_to_compare(made, tmp_path):
    project, spec, store = made
    spec = spec.model_copy(update={"tasks": {}})
    assert sounds_of(project.paths, spec, store, tmp_path).pairs == ()


def test_both_spectra_stand_on_one_scale(made, tmp_path):
    project, spec, store = made
    for pair in sounds_of(project.paths, spec, store, tmp_path).pairs:
        figure = draw(pair.figure)
        first, second = figure.axes[0].get_lines()
        peak = max(one.max() for one in (pair.first.spectrum, pair.second.spectrum))
        level = 20 * np.log10(pair.first.spectrum / pair.peak)
        heard = level > LOWEST_DB
        assert first.get_ydata()[heard] == pytest.approx(level[heard])
        assert max(map(np.max, (first.get_ydata(), second.get_ydata()))) == pytest.approx(
            20 * np.log10(peak / pair.peak)
        )
        assert first.get_linestyle() != second.get_linestyle()
        said = " ".join(texts(figure))
        assert pair.percent in said and sentence(pair.title) in said and "recorded" in said
        assert fits(figure)
        assert pair.percent in pair.figure.caption.alt
        louder = pair._replace(is_power=True)
        assert draw(louder.figure).axes[0].get_lines()[0].get_ydata()[heard] == pytest.approx(
            level[heard] / 2
        )


def test_the_page_plays_them_and_says_which(made, tmp_path):
    project, spec, store = made
    found = sounds_of(project.paths, spec, store, tmp_path / "sounds")
    figures = draw_figures([pair.figure for pair in found.pairs], tmp_path / "figures")
    module = environment(project.paths).get_template("sounds.html.j2").module
    html = str(module.sound_pairs(found, figures, "../sounds/"))
    page = Page(html)
    heard = page.all("audio")
    assert len(heard) == 4 and all("controls" in one for one in heard)
    assert heard[3]["aria-label"] == "box and <i>: <i>" and "<i>" not in html
    assert {one["src"] for one in heard} == {
        f"../sounds/{sound.file}" for pair in found.pairs for sound in (pair.first, pair.second)
    }
    assert found.pairs[0].percent in " ".join(page.words) and RULES["classification"][:30] in html
    assert str(module.sound_pairs(found._replace(pairs=()), {})).strip() == ""
