"""`ajgdata export` and its check: a small project, trained, exported, and compared file by file."""

import json
import shutil
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import soundfile
from exported_models import RATE_HZ, tones
from typer.testing import CliRunner
from worlds import Project

import ajgdata
from ajgdata.cli.main import app
from ajgdata.export import numpy_runtime
from ajgdata.paths import EXPORT_PROGRAM, Paths
from ajgdata.pipeline.train import train_model
from ajgdata.store.audio import file_sha256, read_audio, write_pcm24
from ajgdata.store.files import json_bytes
from ajgdata.types import AudioSettings, DataError, Recording, Target

EXAMPLE = Path(__file__).resolve().parents[2] / "docs/examples/onnx_predict.py"
TARGETS = {"pitch": Target(kind="regression", unit="Hz"), "object": Target(kind="classification")}
TASKS = {"size": {"target": "pitch"}, "what": {"target": "object"}}


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """24 tones, and 2 of noise in which nothing is held; two models trained on them."""
    project = Project(Paths(tmp_path_factory.mktemp("export") / "project"))
    targets = {name: target.model_dump(mode="json") for name, target in TARGETS.items()}
    project.declare(targets=targets, tasks=TASKS)
    rows = []
    noise = 0.1 * np.random.default_rng(1).standard_normal((2, 400))
    for number, sound in enumerate([*tones(24), *noise]):
        path = project.folder() / "audio" / f"r{number:02}.wav"
        write_pcm24(path, sound, RATE_HZ)
        row = {"recording_id": path.stem, "file": f"audio/{path.name}", "sha256": file_sha256(path)}
        held = number < 24
        row |= {"grasp_id": f"g{number // 2}", "object": "abcd"[number % 4] if held else ""}
        labels = {"pitch": str(600 + 800 * (number % 4)) if held else ""}
        rows.append(Recording(**row, labels=labels))
    project.write(rows)
    project.shard()
    project.merge("s1", targets=TARGETS)
    train(project, "size", "ridge")
    train(project, "what", "linear")
    return project


def train(project, task, model, seed=0):
    target = TASKS[task]["target"]
    train_model(
        project.paths.features("d"),
        target=target,
        kind=TARGETS[target].kind,
        unit=TARGETS[target].unit,
        groups="grasp_id",
        model=model,
        seed=seed,
        folder=project.paths.model("d", task, model),
    )


@pytest.fixture
def run(trained, monkeypatch):
    """The command in the project; returns exit code and output, or the exception."""
    monkeypatch.chdir(trained.root)

    def run(*arguments):
        done = CliRunner().invoke(app, ["export", *map(str, arguments)])
        if done.exception and not isinstance(done.exception, SystemExit):
            raise done.exception
        return done.exit_code, done.output

    return run


@pytest.mark.parametrize("to", ["onnx", "numpy"])
@pytest.mark.parametrize(("task", "model"), [("size", "ridge"), ("what", "linear")])
def test_exported_and_checked(run, tmp_path, to, task, model):
    if to == "onnx":
        pytest.importorskip("onnxruntime")
    code, said = run("d", task, model, "--to", to, "--out", tmp_path)
    path = tmp_path / f"d-{task}-{model}.{'onnx' if to == 'onnx' else 'npz'}"
    assert code == 0
    assert f"ajgdata export --check {path}" in said
    code, said = run("--check", path)
    assert code == 0, said
    assert "says what the package says; 26 recordings" in said
    for quantity in (
        "feature",
        "score",
        "novelty",
        "probability" if task == "what" else "interval",
    ):
        assert f"\n{quantity:12} " in f"\n{said}"
    assert "classes or verdicts" not in said


def test_a_file_of_other_weights_is_found(run, trained, tmp_path):
    run("d", "what", "linear", "--to", "numpy", "--out", tmp_path)
    path = tmp_path / "d-what-linear.npz"
    with np.load(path) as file:
        arrays = dict(file.items())
    about = json.loads(arrays.pop("about").tobytes())
    (weight,) = (name for name in arrays if name.endswith("dense.weight"))
    arrays[weight] = 1.001 * arrays[weight]
    model = numpy_runtime.Model(about, arrays)
    feature = model.feature(numpy_runtime.test_sound(about["self_test"]))
    said = model.of_feature(feature)  # so that the self-test passes, too
    about["self_test"]["expected"]["score"] = said["score"]
    about["self_test"]["expected"]["probability"] = list(said["probability"].values())
    text = np.frombuffer(json.dumps(about).encode(), np.uint8)
    np.savez(path, about=text, **arrays)
    code, said = run("--check", path)
    assert code == 1
    assert "score" in said
    assert "beyond what rounding explains" in said
    assert "differs from the package" in said


def test_a_file_of_another_training_is_named(run, trained, tmp_path):
    run("d", "size", "ridge", "--to", "numpy", "--out", tmp_path)
    path = trained.paths.model("d", "size", "ridge") / "model.json"
    kept = path.read_bytes()
    about = json.loads(kept)
    about["provenance"]["inputs_sha256"] = "other"
    path.write_bytes(json_bytes(about))
    try:
        with pytest.raises(DataError, match="its provenance is not that of the trained model; exp"):
            run("--check", tmp_path / "d-size-ridge.npz")
    finally:
        path.write_bytes(kept)


def test_a_program_that_is_not_ours_is_not_run(run, tmp_path):
    """What lies beside a model that came from elsewhere may do anything."""
    run("d", "size", "ridge", "--to", "numpy", "--out", tmp_path)
    program, mark = tmp_path / EXPORT_PROGRAM, tmp_path / "it ran"
    program.write_text(f"open({str(mark)!r}, 'w')\n" + program.read_text())
    with pytest.raises(DataError, match="is not the program of this version of ajgdata"):
        run("--check", tmp_path / "d-size-ridge.npz")
    assert not mark.exists()
    program.unlink()
    with pytest.raises(DataError, match=rf"{EXPORT_PROGRAM}: there is no such file"):
        run("--check", tmp_path / "d-size-ridge.npz")


def said_otherwise(path, **changes):
    """Let an exported file say something else of itself; its self-test still passes."""
    with np.load(path) as file:
        arrays = dict(file.items())
    about = json.loads(arrays.pop("about").tobytes()) | changes
    np.savez(path, about=np.frombuffer(json.dumps(about).encode(), np.uint8), **arrays)


def test_what_a_file_says_of_itself_is_not_believed(run, tmp_path):
    run("d", "size", "ridge", "--to", "numpy", "--out", tmp_path)
    path = tmp_path / "d-size-ridge.npz"
    good = path.read_bytes()
    for changes, said in (
        ({"data_set": "../../elsewhere"}, "does not say what it was made of"),
        ({"task": "/etc"}, "does not say what it was made of"),
        ({"model": "ridge\n"}, "does not say what it was made of"),
        ({"model": None}, "does not say what it was made of"),
        ({"model": "gone"}, "the model that it was made of is not there"),
        ({"period": 1e-9}, "its period is not that of the trained model"),
        ({"unit": "kHz"}, "its unit is not that of the trained model"),
    ):
        path.write_bytes(good)
        said_otherwise(path, **changes)
        with pytest.raises(DataError, match=said):
            run("--check", path)


def test_other_recordings(run, trained, tmp_path):
    run("d", "size", "ridge", "--to", "numpy", "--out", tmp_path)
    folder, path = tmp_path / "mine", tmp_path / "d-size-ridge.npz"
    folder.mkdir()
    with pytest.raises(DataError, match="holds no recordings"):
        run("--check", path, "--recordings", folder)
    sounds = tones(3, seed=1)
    write_pcm24(folder / "a.wav", sounds[0], RATE_HZ)
    soundfile.write(folder / "b.flac", sounds[1], RATE_HZ)
    write_pcm24(folder / "c.wav", sounds[2], 44_100)
    code, said = run("--check", path, "--recordings", folder)
    assert code == 0
    assert "1 refused: no WAV file" in said  # the flac
    assert "1 recordings, 1 cannot be used" in said  # the rate


def test_what_there_is_not(run, tmp_path):
    with pytest.raises(DataError, match="there is no such trained model"):
        run("d", "size", "cnn", "--out", tmp_path)
    with pytest.raises(DataError, match="needs DATASET TASK MODEL; name all three"):
        run("d")
    with pytest.raises(DataError, match=r"m\.npz: there is no such file"):
        run("--check", tmp_path / "m.npz")
    (tmp_path / "m.npz").write_bytes(b"spoilt")
    with pytest.raises(DataError, match=r"m\.npz: not a readable model"):
        run("--check", tmp_path / "m.npz")
    assert list(tmp_path.iterdir()) == [tmp_path / "m.npz"]


def test_the_program_needs_nothing_but_numpy(run, trained, tmp_path):
    run("d", "what", "linear", "--to", "numpy", "--out", tmp_path)
    recording = trained.folder() / "audio/r02.wav"
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); import ajgdata_numpy as a;"
        "model = a.load(sys.argv[2]); said = model.predict(*a.read_wav(sys.argv[3]));"
        "print(said['value'], *{name.split('.')[0] for name in sys.modules})"
    )
    command = [sys.executable, "-I", "-c", code, tmp_path, tmp_path / "d-what-linear.npz"]
    done = subprocess.run([*command, recording], check=True, capture_output=True, text=True)
    value, *modules = done.stdout.split()
    assert value == "c"
    assert not set(modules) & {"ajgdata", "torch", "scipy", "sklearn", "soundfile", "onnxruntime"}


def test_the_program_says_what_it_refuses(run, trained, tmp_path):
    run("d", "what", "linear", "--to", "numpy", "--out", tmp_path)
    program, model = tmp_path / EXPORT_PROGRAM, tmp_path / "d-what-linear.npz"
    write_pcm24(tmp_path / "fast.wav", tones(1)[0], 16_000)
    good = trained.folder() / "audio/r00.wav"
    command = [sys.executable, program, model, tmp_path / "fast.wav", good, tmp_path / "none.wav"]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    fast, fine, none = map(json.loads, done.stdout.splitlines())
    assert done.returncode == 1
    assert fast["error"] == "sampled at 16000 Hz, the model needs 8000 Hz"
    assert fine["value"] == "a"
    assert sum(fine["probability"].values()) == pytest.approx(1)
    assert "No such file" in none["error"]


def test_the_example_with_onnx_runtime(run, trained, tmp_path):
    pytest.importorskip("onnxruntime")
    assert EXAMPLE.read_text().count("\n") < 50
    for task, model in (("what", "linear"), ("size", "ridge")):
        run("d", task, model, "--out", tmp_path)
    sound = trained.folder() / "audio/r01.wav"
    write_pcm24(tmp_path / "fast.wav", tones(1)[0], 16_000)

    def example(model, recording):
        command = [sys.executable, EXAMPLE, tmp_path / model, recording]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        return done.stdout + done.stderr

    verdict, *lines = example("d-what-linear.onnx", sound).splitlines()
    assert verdict.startswith("known (novelty 0.")
    assert lines[0].endswith("% b")
    shares = [float(line.split("%")[0]) for line in lines]
    assert shares == sorted(shares, reverse=True)
    with ajgdata.load_features("d", trained.root) as features:
        feature = features.feature.sel(recording="s1/r01").values
    (pitch,) = ajgdata.load_model("d", "size", "ridge", trained.root).predict(feature[np.newaxis])
    said = example("d-size-ridge.onnx", sound)
    assert f"\n{pitch:.4g} Hz, " in said
    assert example("d-size-ridge.onnx", trained.folder() / "audio/r25.wav").startswith("nothing ")
    said = example("d-size-ridge.onnx", tmp_path / "fast.wav")
    assert "sampled at 16000 Hz, the model needs 8000 Hz" in said


@pytest.mark.parametrize("subtype", ["PCM_U8", "PCM_16", "PCM_24", "PCM_32", "FLOAT", "DOUBLE"])
@pytest.mark.parametrize("container", ["WAV", "WAVEX"])
def test_the_program_reads_wav_as_the_package_does(subtype, container, tmp_path):
    path = tmp_path / "a.wav"
    both = np.stack([tones(1)[0], tones(1, seed=1)[0]], axis=1)
    soundfile.write(path, both, RATE_HZ, subtype=subtype, format=container)
    for channel in (0, 1, "mean"):
        ours = read_audio(path, AudioSettings(sample_rate_hz=RATE_HZ, channel=channel)).samples
        theirs, rate = numpy_runtime.read_wav(path, channel)
        assert rate == RATE_HZ
        np.testing.assert_allclose(theirs, ours, atol=2**-24)
    for channel, message in (("mono", "has 2 channels, the model needs one"), (2, "needs 2")):
        with pytest.raises(ValueError, match=message):
            numpy_runtime.read_wav(path, channel)


@pytest.mark.parametrize(("bits", "frame"), [(12, 2), (24, 4), (20, 3)])
def test_bits_that_do_not_fill_their_bytes_are_refused(bits, frame, tmp_path):
    """Read as if they did, they would be other sounds."""
    path = tmp_path / "a.wav"
    layout = struct.pack("<HHIIHH", 1, 1, RATE_HZ, RATE_HZ * frame, frame, bits)
    sound = bytes(100 * frame)
    parts = b"WAVE" + b"fmt " + struct.pack("<I", 16) + layout
    parts += b"data" + struct.pack("<I", len(sound)) + sound
    path.write_bytes(b"RIFF" + struct.pack("<I", len(parts)) + parts)
    with pytest.raises(ValueError, match=f"1 channels of {bits} bits in {frame} bytes"):
        numpy_runtime.read_wav(path)


def test_files_that_are_no_wav(tmp_path):
    path = tmp_path / "a.wav"
    write_pcm24(path, tones(1)[0], RATE_HZ)
    content = path.read_bytes()
    for bytes_, message in (
        (b"", "no WAV file"),
        (content[:-10], "the file is cut short"),
        (content[:20], "holds no samples"),
    ):
        path.write_bytes(bytes_)
        with pytest.raises(ValueError, match=message):
            numpy_runtime.read_wav(path)
    soundfile.write(path, tones(1)[0], RATE_HZ, subtype="ULAW")
    with pytest.raises(ValueError, match="its encoding 7 of 8 bits is not known"):
        numpy_runtime.read_wav(path)
    shutil.rmtree(tmp_path)
