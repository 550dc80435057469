"""The review list: a wrong label is near its top, and accepted recordings are at its end."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from recorded import make_features
from sounds import FRAMES, RATE_HZ, resonances, write_wav

from ajgdata.evaluate.crossval import cross_validate
from ajgdata.paths import Paths
from ajgdata.pipeline.importing import import_folder
from ajgdata.pipeline.labelling import change_recording
from ajgdata.pipeline.review import Review, review_list
from ajgdata.store.features import read_store
from ajgdata.store.metrics import write_predictions
from ajgdata.types import DataError, ImportSettings

NAME = "mine"
OBJECTS = 5
GRASPS = 12
#: Frequencies of four modes of the first object, in Hz; the next object has higher ones.
MODES_HZ = (700, 1650, 2900, 4600)
STEP_HZ = 60
#: Standard deviation of the frequencies between grasps. Models then predict 70 to 90 % of the
#: labels: neighbouring objects overlap.
SPREAD = 0.02


def grasp_sound(number: int, grasp: int, seed: int) -> np.ndarray:
    """Return the sound (FRAMES,) of a grasp: pose, modes, amplitudes and decays are random."""
    random = np.random.default_rng([seed, number, grasp])
    time_s = np.arange(FRAMES) / RATE_HZ
    sound = np.zeros(FRAMES)
    pose = 1 + SPREAD * random.normal()
    for mode, first_hz in enumerate(MODES_HZ):
        own = 1 + SPREAD / 2 * random.normal()
        frequency_hz = (first_hz + STEP_HZ * (mode + 1) * number) * pose * own
        amplitude = np.exp(0.5 * random.normal())
        decay = 10 * np.exp(0.2 * random.normal())
        phase = random.uniform(0, 2 * np.pi)
        ringing = np.sin(2 * np.pi * frequency_hz * time_s + phase)
        sound += amplitude * np.exp(-decay * time_s) * ringing
    return 0.1 * sound + 0.01 * random.normal(size=FRAMES)


def import_one_wrong_label(paths: Paths, src: Path, seed: int) -> str:
    """Import 60 grasps of five objects, one with the label of another object; return its name."""
    random = np.random.default_rng([7, seed])
    wrong = int(random.integers(OBJECTS)), int(random.integers(GRASPS))
    other = (wrong[0] + int(random.integers(1, OBJECTS))) % OBJECTS
    for number in range(OBJECTS):
        for grasp in range(GRASPS):
            label = other if (number, grasp) == wrong else number
            file = src / f"{number * GRASPS + grasp + 1}_o{label}.wav"
            write_wav(file, grasp_sound(number, grasp, seed))
    import_folder(paths, NAME, src, settings=None)
    return f"{src.name}/{wrong[0] * GRASPS + wrong[1] + 1}_o{other}"


def predict(paths: Paths, models: tuple[str, ...], target: str = "label") -> float:
    """Write held-out predictions of a data set as a run does; return the share of correct ones."""
    make_features(paths, NAME)
    table = read_store(paths.features(NAME))
    names = table.columns["recording"].values
    value = table.columns[target].values
    kind = "regression" if value.dtype.kind == "f" else "classification"
    grasp = table.columns["grasp_id"].values
    rows = []
    for model in models:
        predictions = cross_validate(
            table.flat, value, grasp, kind=kind, model=model, folds=5, seed=0
        ).predictions
        probability = predictions.probability
        if probability is None:
            probability = [""] * len(predictions.row)
        cells = (predictions.row, predictions.fold, predictions.y_true, predictions.y_pred)
        for row, fold, true, predicted, stated in zip(*cells, probability, strict=True):
            rows.append(
                {
                    "dataset": NAME,
                    "task": target,
                    "model": model,
                    "recording": names[row],
                    "split": "grouped",
                    "test_set": NAME,
                    "target_values": "training",
                    "fold": fold,
                    "y_true": true,
                    "y_pred": predicted,
                    "probability": stated,
                }
            )
    write_predictions(paths.predictions, rows)
    return float(np.mean([row["y_true"] == row["y_pred"] for row in rows]))


def rank(review: Review, recording: str) -> int:
    """Return the rank of a recording."""
    return next(item.rank for item in review.items if item.recording == recording)


def ranks_in_ten_seeds(tmp_path: Path, models: tuple[str, ...]) -> list[int]:
    """Return the rank of the wrong label in ten examples."""
    ranks = []
    for seed in range(10):
        paths = Paths(tmp_path / str(seed))
        paths.datasets.mkdir(parents=True)
        wrong = import_one_wrong_label(paths, tmp_path / str(seed) / "src", seed)
        assert 0.6 < predict(paths, models) < 0.95  # the example is neither trivial nor noise
        review = review_list(paths, NAME)
        assert len(review.items) == OBJECTS * GRASPS
        ranks.append(rank(review, wrong))
    return ranks


def test_the_wrong_label_is_among_the_first_five_in_nine_of_ten_seeds(tmp_path):
    ranks = ranks_in_ten_seeds(tmp_path, ("linear_plain", "knn_plain"))
    assert sum(rank <= 5 for rank in ranks) >= 9


@pytest.mark.slow
def test_the_wrong_label_is_among_the_first_five_with_the_models_of_a_first_run(tmp_path):
    ranks = ranks_in_ten_seeds(tmp_path, ("linear", "knn"))
    assert sum(rank <= 5 for rank in ranks) >= 9


def test_the_list_works_before_the_first_run_and_says_so(paths, src, ajgdata):
    wrong = import_one_wrong_label(paths, src, seed=0)
    printed = ajgdata("review", NAME)
    assert printed.code == 0
    assert "no held-out predictions yet, so the list has only outliers" in printed.out
    assert "and 50 more (--all shows them)" in printed.out
    lines = [line for line in printed.out.splitlines() if line[:3].strip().isdecimal()]
    assert any(wrong in line for line in lines[:5])
    assert "sound unlike other o" in lines[0]

    document = json.loads(ajgdata("review", NAME, "--json").out)
    sys.path.insert(0, str(Path(__file__).parents[1] / "unit"))
    try:
        from json_page import assert_documented
    finally:
        sys.path.pop(0)
    assert_documented("review", document)
    assert document["recordings"][0]["predicted"] == ""


def import_rings(paths: Paths, src: Path, labels: dict[str, tuple[int, int]]) -> None:
    """Import files by name; each has the sound of an object and a repeat."""
    for name, sound in labels.items():
        write_wav(src / name, resonances(*sound))
    import_folder(paths, NAME, src, settings=None)


BALLS_AND_CUBES = {
    f"{grasp + 6 * number}_{label}.wav": (number, grasp)
    for number, label in enumerate(("ball", "cube"))
    for grasp in range(1, 7)
}


def test_accepted_recordings_are_last_and_rejected_ones_are_omitted(paths, src):
    import_rings(paths, src, BALLS_AND_CUBES)
    first, second, *_ = review_list(paths, NAME).items
    change_recording(paths, NAME, first.recording, "ok")
    change_recording(paths, NAME, second.recording, "reject", reason="noise")
    items = review_list(paths, NAME).items
    assert len(items) == 11
    assert items[-1].recording == first.recording
    assert items[-1].is_reviewed
    assert [item.rank for item in items] == list(range(1, 12))


def test_a_corrected_label_is_compared_with_the_predictions_of_the_last_run(paths, src):
    import_rings(paths, src, {**BALLS_AND_CUBES, "13_cube.wav": (0, 20)})
    predict(paths, ("knn_plain",))
    review = review_list(paths, NAME)
    assert review.items[0].recording == "src/13_cube"
    assert review.items[0].predicted == "ball"
    assert review.items[0].reasons[0].startswith("predicted ball with confidence")
    assert "held-out predictions of knn_plain" in review.remarks[0]
    change_recording(paths, NAME, "src/13_cube", "label", column="label", value="ball")
    (item,) = [i for i in review_list(paths, NAME).items if i.recording == "src/13_cube"]
    assert (item.label, item.reasons) == ("ball", ())


def test_a_copy_with_another_label_is_a_contradiction(paths, src):
    import_rings(paths, src, BALLS_AND_CUBES)
    write_wav(src / "13_cube.wav", 0.5 * resonances(0, 1))  # 1_ball, with another level
    import_folder(paths, NAME, src, settings=None)
    items = {item.recording: item for item in review_list(paths, NAME).items}
    assert "nearly the same sound as src/1_ball, which is ball" in items["src/13_cube"].reasons
    assert "nearly the same sound as src/13_cube, which is cube" in items["src/1_ball"].reasons
    assert items["src/13_cube"].rank == 1


def test_recordings_of_one_grasp_with_two_labels_are_a_contradiction(paths, src):
    settings = ImportSettings(pattern=r"(?P<label>[a-z]+)_(?P<grasp_id>\d+)_(?P<sample>\d)\.wav")
    for number, label in enumerate(("ball", "cube")):
        for grasp in range(6):
            for sample in range(3):
                name = "cube" if (number, grasp, sample) == (0, 2, 1) else label
                file = src / f"{name}_{grasp + 6 * number}_{sample}.wav"
                write_wav(file, resonances(number, 10 * grasp + sample))
    import_folder(paths, NAME, src, settings=settings)
    first, second, *_ = review_list(paths, NAME).items
    assert first.recording == "src/cube_2_1"
    assert "of the same grasp has the label ball" in " ".join(first.reasons)
    assert "of the same grasp" not in " ".join(second.reasons)  # the majority is not suspicious


def test_a_wrong_number_is_first_with_its_error(paths, src):
    for grasp in range(20):
        stated = 1700 if grasp == 4 else 100 * grasp
        share = grasp / 19  # of the second object in the sound
        sound = (1 - share) * resonances(0, grasp) + share * resonances(3, grasp)
        write_wav(src / f"{grasp}_{stated}.wav", sound)
    settings = ImportSettings(pattern=r"(?P<grasp>\d+)_(?P<mass>\d+)\.wav")
    import_folder(paths, NAME, src, settings=settings)
    assert review_list(paths, NAME).items[0].recording == "src/4_1700"
    predict(paths, ("knn_plain",), "mass")
    first = review_list(paths, NAME, task="mass").items[0]
    assert (first.recording, first.label) == ("src/4_1700", "1700")
    assert "error" in first.reasons[0]
    assert first.confidence is None


def test_predictions_of_an_earlier_kind_of_target_are_not_used(paths, src):
    for number in range(20):
        write_wav(src / f"{number}_{100 * number}.wav", resonances(number % 2, number))
    settings = ImportSettings(pattern=r"(?P<grasp>\d+)_(?P<mass>\d+)\.wav")
    import_folder(paths, NAME, src, settings=settings)

    def remarks(y_pred: str) -> str:
        row = {"task": "mass", "model": "knn", "recording": "src/0_0", "y_pred": y_pred}
        row |= {"dataset": NAME, "test_set": NAME, "split": "grouped", "fold": 0, "y_true": ""}
        write_predictions(paths.predictions, [{**row, "target_values": "training"}])
        return " ".join(review_list(paths, NAME).remarks)

    unused = "predictions that do not fit the target are not used: mass/knn"
    assert unused in remarks("ball")
    assert unused in remarks("1.0 2.0")
    assert "not used" not in remarks("50.0")
    text = paths.dataset(NAME).read_text(encoding="utf-8")
    assert "regression" in text
    paths.dataset(NAME).write_text(text.replace("regression", "classification"), encoding="utf-8")
    assert unused in remarks("50.0")
    assert "not used" not in remarks("100")


def test_what_has_no_list_is_one_line(paths, src, ajgdata):
    import_rings(paths, src, {"1_ball.wav": (0, 1), "2_cube.wav": (1, 1)})
    printed = ajgdata("review", NAME, "--task", "mass")
    assert printed.code == 1
    assert "there is no task 'mass'. Use label." in printed.text
    with pytest.raises(DataError, match="no such data set"):
        review_list(paths, "other")
