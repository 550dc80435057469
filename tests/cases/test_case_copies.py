"""Copies of a sound: another header or format, gain, length or rate, and copies in test data."""

import string

import numpy as np
import pytest
import soundfile
import yaml
from recorded import make_features
from scipy.signal import resample_poly
from sounds import RATE_HZ, resonances, write_wav

from ajgdata.pipeline import similar_sounds
from ajgdata.pipeline.experiments import run_experiment
from ajgdata.pipeline.similar_sounds import leak
from ajgdata.store.features import read_store
from ajgdata.store.findings import read_findings
from ajgdata.store.sessions import read_dataset
from ajgdata.store.tables import read_measurements
from ajgdata.types import AudioSettings


def fill(folder, count=6):
    """Write recordings of two classes with the same sound, so an honest accuracy is at chance."""
    for number, label in enumerate(("cube", "ball")):
        for grasp in range(1, count + 1):
            sound = resonances(0, grasp + 20 * number)
            write_wav(folder / f"{grasp}_{label}.wav", sound)


@pytest.fixture
def features(paths):
    """Run the feature job of a data set; return its recordings and issues."""

    def build(dataset):
        make_features(paths, dataset)
        names = read_store(paths.features(dataset)).columns["recording"].values.tolist()
        return names, read_findings(paths.quarantine(dataset))

    return build


def codes(issues):
    return [(issue.recording_id, issue.level, issue.code) for issue in sorted(issues)]


def declare(paths, dataset, **keys):
    """Replace keys of dataset.yaml."""
    path = paths.dataset(dataset)
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    path.write_text(yaml.safe_dump({**content, **keys}, sort_keys=False), encoding="utf-8")


def test_equal_samples_in_another_container_are_one_recording(ajgdata, paths, src, features):
    fill(src)
    for label in ("cube", "ball"):
        samples, rate_hz = soundfile.read(src / f"1_{label}.wav", dtype="int16")
        soundfile.write(src / f"21_{label}.flac", samples, rate_hz)
        soundfile.write(src / f"22_{label}.wav", samples, rate_hz, subtype="PCM_24")
    assert ajgdata("import", src, "--dataset", "mine").code == 0
    checked = ajgdata("check", "mine", "--all")
    assert checked.code == 3
    assert checked.text.count("the same sound as src/1_cube (3 recordings); left out") == 2
    assert "set quality to reject in recordings.csv for all but one" in checked.text
    names, issues = features("mine")
    assert len(names) == 12
    assert {"src/21_cube", "src/22_ball"}.isdisjoint(names)
    assert {code for _, _, code in codes(issues)} == {"copy"}


def test_an_equal_sound_with_another_label_is_an_error(ajgdata, src, features):
    fill(src)
    samples, rate_hz = soundfile.read(src / "1_cube.wav", dtype="int16")
    soundfile.write(src / "40_ball.flac", samples, rate_hz)
    ajgdata("import", src, "--dataset", "mine")
    checked = ajgdata("check", "mine", "--all")
    assert checked.code == 3
    assert "the same sound as src/1_cube (2 recordings), labelled otherwise" in checked.text
    fix = "correct the label in recordings.csv, or set quality to reject for all but one"
    assert fix in checked.text
    names, issues = features("mine")
    expected = [("1_cube", "error", "two_labels"), ("40_ball", "error", "two_labels")]
    assert codes(issues) == expected
    assert len(names) == 11


def test_equal_numbers_in_two_spellings_are_equal_labels(ajgdata, paths, src, features):
    """The check and the run compare numbers, not texts, and a word is a missing number."""
    fill(src)
    table = ["file,angle,grasp"]
    for place, path in enumerate(sorted(src.iterdir())):
        table.append(f"{path.name},{place}.5,{place}")
    for name, angle in (("a", "10"), ("b", "10.0"), ("c", "?"), ("d", "")):
        write_wav(src / f"{name}.wav", resonances(2, 1 if name in "ab" else 2))
        table.append(f"{name}.wav,{angle},{name}")
    samples, rate_hz = soundfile.read(src / "a.wav", dtype="int16")
    soundfile.write(src / "e.flac", samples, rate_hz)
    table.append("e.flac,1e1,e")
    (src / "labels.csv").write_text("\n".join(table), encoding="utf-8")
    options = ["--table", "labels.csv", "--file", "{file}", "--grasp", "{grasp}"]
    ajgdata("import", src, "--dataset", "mine", *options, "--target", "angle")
    assert read_dataset(paths, "mine").targets["angle"].kind == "regression"
    checked = ajgdata("check", "mine", "--all")
    assert "two_labels" not in checked.text
    assert "copy 3" in checked.text
    _, issues = features("mine")
    copied = [code for code in codes(issues) if code[2] in ("copy", "two_labels")]
    assert copied == [(name, "warning", "copy") for name in ("b", "d", "e")]


def milliseconds(count):
    return round(count * RATE_HZ / 1000)


COPIES = {
    "6 dB": lambda x: x * 10 ** (6 / 20),
    "-20 dB": lambda x: x / 10,
    "10 ms at the start": lambda x: x[milliseconds(10) :],
    "50 ms at the start": lambda x: x[milliseconds(50) :],
    "10 ms at the end": lambda x: x[: -milliseconds(10)],
    "50 ms at the end": lambda x: x[: -milliseconds(50)],
    "offset": lambda x: x + 0.01,
    "one quantum": lambda x: x + np.random.default_rng(1).integers(-1, 2, len(x)) / 2**15,
}


@pytest.mark.parametrize("change", COPIES)
def test_a_changed_copy_in_another_grasp_is_a_warning(ajgdata, src, features, change):
    fill(src)
    write_wav(src / "21_cube.wav", COPIES[change](resonances(0, 1)))
    ajgdata("import", src, "--dataset", "mine")
    checked = ajgdata("check", "mine", "--all")
    assert "nearly the same sound as src/21_cube of another grasp" in checked.text
    names, issues = features("mine")
    expected = [("1_cube", "warning", "similar"), ("21_cube", "warning", "similar")]
    assert [code for code in codes(issues) if code[2] == "similar"] == expected
    assert len(names) == 13
    assert features("mine")[1] == issues  # reused rows keep their warnings


@pytest.mark.parametrize("rate_hz", [22_050, 48_000])
def test_a_resampled_copy_is_a_warning(ajgdata, paths, src, features, rate_hz):
    fill(src)
    step = np.gcd(rate_hz, RATE_HZ)
    changed = resample_poly(resonances(0, 1), rate_hz // step, RATE_HZ // step)
    write_wav(src / "21_cube.wav", changed, rate_hz)
    ajgdata("import", src, "--dataset", "mine")
    declare(paths, "mine", audio={"other_rate": "resample"})
    similar = [issue.recording_id for issue in features("mine")[1] if issue.code == "similar"]
    assert similar == ["1_cube", "21_cube"]


def test_two_tracks_of_one_take_are_reported(ajgdata, src, features):
    """Two microphones record the same sound and noise at another level, with noise of their own."""
    fill(src)
    take = resonances(0, 1)
    noise = np.random.default_rng(3).normal(size=(len(take), 2))
    tracks = take[:, np.newaxis] * (1, 0.7) + 2e-4 * noise
    write_wav(src / "1_cube.wav", tracks[:, 0])
    write_wav(src / "21_cube.wav", tracks[:, 1])
    ajgdata("import", src, "--dataset", "mine")
    similar = [issue.recording_id for issue in features("mine")[1] if issue.code == "similar"]
    assert similar == ["1_cube", "21_cube"]


def test_a_similar_sound_with_another_label_is_a_warning(ajgdata, src):
    """Both classes have the same sounds, and an offset of the samples differs."""
    for grasp in range(1, 11):
        sound = resonances(0, grasp)
        write_wav(src / f"{grasp}_cube.wav", sound)
        write_wav(src / f"{grasp}_ball.wav", sound + 0.001)
    ajgdata("import", src, "--dataset", "mine")
    checked = ajgdata("check", "mine", "--all")
    assert checked.code == 3
    assert checked.text.count("nearly the same sound as src/") == 20
    assert "src/7_cube: nearly the same sound as src/7_ball of another grasp" in checked.text


def test_recordings_of_one_grasp_and_references_are_not_compared(ajgdata, paths, src):
    fill(src)
    write_wav(src / "21_cube.wav", resonances(0, 1)[100:])
    ajgdata("import", src, "--dataset", "mine")
    path = paths.recordings_file("mine", "src")
    assert ajgdata("check", "mine").code == 3
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    head = lines[0].split(",")
    grasp = head.index("grasp_id")
    cells = {line.split(",")[0]: line.split(",") for line in lines[1:]}
    cells["21_cube"][grasp] = cells["1_cube"][grasp]
    path.write_text(
        "\n".join([lines[0], *(",".join(row) for row in cells.values())]) + "\n", encoding="utf-8"
    )
    assert "nearly the same" not in ajgdata("check", "mine", "--all").text
    cells["21_cube"][grasp] = "other"
    body = [f"{','.join(row)},{'yes' if name == '21_cube' else ''}" for name, row in cells.items()]
    path.write_text("\n".join([f"{lines[0]},reference", *body]) + "\n", encoding="utf-8")
    assert "nearly the same" not in ajgdata("check", "mine", "--all").text


def run_task(paths, dataset, other, tmp_path, models=("linear",)):
    """Run the cross-validation of a task that is tested on another data set; return its facts."""
    spec = read_dataset(paths, dataset)
    task = next(iter(spec.tasks))
    run_experiment(
        paths.features(dataset),
        experiment="cross_validation",
        parts=models,
        dataset=dataset,
        task=task,
        settings={"models": [*models], "test_on": [other]},
        task_settings=spec.task_settings(task),
        other_sets=[other],
        audio=AudioSettings(),
        features=spec.features,
        paths=paths,
        seed=1,
        tables=tmp_path / "tables.json",
        cost=tmp_path / "cost.json",
    )
    return read_measurements(tmp_path / "tables.json")[0][0]


def measured_sets(tmp_path):
    """Return the test sets that have an accuracy."""
    tables = read_measurements(tmp_path / "tables.json")[0][1]
    rows = next(table.rows for table in tables if table.name == "scores")
    return {row["test_set"] for row in rows if row["metric"] == "accuracy"}


@pytest.mark.parametrize(
    "change",
    [lambda x: x, lambda x: x * 2, lambda x: x[milliseconds(20) :]],
    ids=["equal", "6 dB", "20 ms"],
)
def test_a_data_set_with_copies_of_training_recordings_is_refused(
    ajgdata, paths, src, features, tmp_path, change
):
    fill(src)
    other = src.with_name("heldout")
    for number in range(1, 5):
        write_wav(other / f"{50 + number}_cube.wav", resonances(1, number))
        write_wav(other / f"{50 + number}_ball.wav", resonances(1, number + 20))
    write_wav(other / "60_cube.wav", change(resonances(0, 3)))
    for folder in (src, other):
        ajgdata("import", folder, "--dataset", folder.name)
        features(folder.name)
    content = yaml.safe_load(paths.dataset("src").read_text(encoding="utf-8"))
    tasks = {name: {**task, "test_on": ["heldout"]} for name, task in content["tasks"].items()}
    declare(paths, "src", tasks=tasks)
    checked = ajgdata("check", "src", "--all")
    assert checked.code == 3
    problem = (
        "1 of 9 recordings of heldout have the sound of a training recording, for example "
        "heldout/60_cube and src/3_cube of the training data"
    )
    assert problem in checked.text
    about = run_task(paths, "src", "heldout", tmp_path)
    assert about["others"]["the test on heldout"].startswith(problem)
    assert measured_sets(tmp_path) == {"src"}  # the own folds are measured
    (other / "60_cube.wav").unlink()
    ajgdata("import", other, "--dataset", "heldout", "--on-change", "prune")
    features("heldout")
    assert "have the sound" not in ajgdata("check", "src", "--all").text
    assert "others" not in run_task(paths, "src", "heldout", tmp_path)
    assert measured_sets(tmp_path) == {"src", "heldout"}


def test_grasps_that_folds_hold_out_are_not_copies(
    ajgdata, paths, src, features, tmp_path, monkeypatch
):
    searched = []

    def search(own, other, name):
        searched.append(name)
        return leak(own, other, name)

    monkeypatch.setattr(similar_sounds, "leak", search)
    fill(src)
    ajgdata("import", src, "--dataset", "one")
    ajgdata("import", src, "--dataset", "two")
    features("one")
    features("two")
    about = run_task(paths, "one", "two", tmp_path, ["linear", "knn"])
    assert "others" not in about
    assert searched == ["two"]  # once for all models
    assert measured_sets(tmp_path) == {"one", "two"}


def test_similar_recordings_of_the_virtual_gripper_are_not_copies(ajgdata, paths, src):
    fill(src)
    write_wav(src / "21_cube.wav", resonances(0, 1)[100:])
    ajgdata("import", src, "--dataset", "mine")
    assert "nearly the same sound" in ajgdata("check", "mine", "--all").text
    path = paths.session("mine", "src") / "session.yaml"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("source: import", "source: virtual"), encoding="utf-8")
    assert "nearly the same sound" not in ajgdata("check", "mine", "--all").text


STATIONARY_FRAMES = round(1.8 * RATE_HZ)


def stationary(number, grasp, frames=STATIONARY_FRAMES):
    """Return noise with resonances of object `number`, which are equal in all grasps."""
    noise = np.random.default_rng([number, grasp]).normal(size=frames)
    objects = np.random.default_rng(number)
    frequency_hz = np.fft.rfftfreq(frames, 1 / RATE_HZ)
    response = np.full(len(frequency_hz), 0.05)
    for centre_hz in objects.uniform(300, 9_000, 5):
        response += 1 / (1 + ((frequency_hz - centre_hz) / 300) ** 2)
    sound = np.fft.irfft(np.fft.rfft(noise) * response, frames)
    return 0.02 * sound / sound.std()


def fill_stationary(folder, classes, grasps):
    for number in range(classes):
        for grasp in range(grasps):
            name = f"{number * grasps + grasp + 1}_{3 * string.ascii_lowercase[number]}.wav"
            write_wav(folder / name, stationary(number, grasp))


@pytest.mark.parametrize(("classes", "grasps"), [(2, 3), (20, 4)])
def test_stationary_sounds_of_many_objects_are_not_copies(ajgdata, src, classes, grasps):
    """Grasps of an object differ by .07, less than the largest distance of copies."""
    fill_stationary(src, classes, grasps)
    assert ajgdata("import", src, "--dataset", "mine").code == 0
    assert "nearly the same" not in ajgdata("check", "mine", "--all").text
    sound = stationary(0, 1)
    write_wav(src / "98_aaa.wav", 0.5 * sound[milliseconds(180) :])
    ajgdata("import", src, "--dataset", "mine")
    checked = ajgdata("check", "mine", "--all").text
    assert checked.count("nearly the same sound as src/") == 2
    assert "src/98_aaa: nearly the same sound as src/2_aaa of another grasp" in checked


def test_other_grasps_of_a_constant_sound_are_no_copies(ajgdata, paths, src):
    """An object sounds constant; other objects differ between grasps by more than the tolerance."""
    fill(src)
    other = src.with_name("heldout")
    for grasp in range(3):
        write_wav(src / f"{60 + grasp}_cube.wav", stationary(0, grasp))
        write_wav(other / f"{70 + grasp}_cube.wav", stationary(0, 10 + grasp))
    for number in range(1, 7):
        write_wav(other / f"{50 + number}_ball.wav", resonances(1, number))
    for folder in (src, other):
        assert ajgdata("import", folder, "--dataset", folder.name).code == 0
    content = yaml.safe_load(paths.dataset("src").read_text(encoding="utf-8"))
    tasks = {name: {**task, "test_on": ["heldout"]} for name, task in content["tasks"].items()}
    declare(paths, "src", tasks=tasks)
    assert "have the sound" not in ajgdata("check", "src", "--all").text
    write_wav(other / "80_cube.wav", 0.5 * stationary(0, 0))
    ajgdata("import", other, "--dataset", "heldout")
    assert "heldout/80_cube and src/60_cube" in ajgdata("check", "src", "--all").text


@pytest.mark.parametrize("window", [2048, 128])
def test_recordings_in_a_narrow_band_are_not_copies(ajgdata, paths, src, features, window):
    fill(src)
    write_wav(src / "21_cube.wav", 0.5 * resonances(0, 1))
    ajgdata("import", src, "--dataset", "mine")
    declare(
        paths, "mine", features={"window": window, "hop": window // 4, "band_hz": [9_000, 20_000]}
    )
    names, issues = features("mine")
    assert len(names) == 13
    assert [code for code in codes(issues) if code[2] in ("similar", "copy", "two_labels")] == [
        ("1_cube", "warning", "similar"),
        ("21_cube", "warning", "similar"),
    ]


def test_too_few_bands_are_not_compared(ajgdata, paths, src, features):
    fill(src)
    ajgdata("import", src, "--dataset", "mine")
    declare(paths, "mine", features={"window": 128, "hop": 64, "band_hz": [5_000, 9_000]})
    names, issues = features("mine")
    assert len(names) == 12
    assert codes(issues) == [("*", "warning", "similar")]
    checked = ajgdata("check", "mine")
    assert checked.code == 3
    assert "12 bands above 50 Hz, so copies of a sound were not searched" in checked.text
