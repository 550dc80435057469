"""The virtual gripper records whole data sets: over processes, again, and after any end."""

import io

import numpy as np
import pytest
import soundfile
import yaml

from ajgdata.acquire.excitation import excitation_samples
from ajgdata.acquire.recipe import recipe_hash, session_names
from ajgdata.gripper.noise import harmonic_amplitudes
from ajgdata.gripper.signal_settings import Motor
from ajgdata.pipeline.planned_grasps import planned_grasps
from ajgdata.pipeline.recipes import acquire_virtual
from ajgdata.store.audio import file_sha256, read_audio, write_pcm24
from ajgdata.store.sessions import read_dataset, read_recordings, read_session
from ajgdata.types import AudioSettings, DataError, LogSweep

#: The coarsest grid, and a few milliseconds of sound.
QUICK = {"numerics": {"dx_mm": 6, "max_time_s": 0.004}}
RECIPE = {
    "sessions": 2,
    "grasps_per_object": 3,
    "samples_per_grasp": 2,
    "scene": QUICK,
    "vary": {"angle_deg": [-10, 10]},
    "objects": [
        {"name": f"cube_{edge}", "shape": {"kind": "cube", "edge_mm": edge}} for edge in (10, 20)
    ],
}


def acquire(project, dataset="d"):
    sessions = session_names(read_dataset(project.paths, dataset).recipe)
    return [acquire_virtual(project.paths, dataset, session) for session in sessions]


def recordings(project, dataset="d") -> dict[str, bytes]:
    """The files of all sessions."""
    folder = project.paths.sessions(dataset)
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(p.relative_to(folder)): p.read_bytes() for p in files}


def test_a_second_acquisition_only_records(project, solved):
    project.declare(recipe=RECIPE)
    assert [tuple(done)[:2] for done in acquire(project)] == [(12, 0), (12, 0)]
    assert len(solved) == 12
    before = recordings(project)
    folder = project.folder("virtual-01")
    first, second = read_recordings(folder)[0][:2]
    assert -10 <= float(first.labels["angle_deg"]) <= 10
    assert first.sha256 != second.sha256  # each sample has its own noise
    assert (folder / "session.yaml").read_text(encoding="utf-8").startswith("format: 1\n")
    session = read_session(folder)
    assert (session.source, session.gripper) == ("virtual", "virtual-default")
    assert session.scene["numerics"]["dx_mm"] == 6
    for path in folder.rglob("*.wav"):
        path.unlink()
    assert [tuple(done)[:2] for done in acquire(project)] == [(12, 0), (0, 12)]
    assert len(solved) == 12
    assert recordings(project) == before
    with pytest.raises(DataError, match="the recipe of d has no such session"):
        acquire_virtual(project.paths, "d", "virtual-03")


def test_noise_gain_and_excitation_need_no_new_response(project, solved):
    project.declare(recipe=RECIPE)
    acquire(project)
    quiet = project.paths.sessions("d") / "virtual-01" / "audio"
    target = project.paths.dataset("loud")
    target.parent.mkdir()
    signal_chain = {"external_noise_dba": 80, "gain_db": -6}
    recipe = {**RECIPE, "grasps_of": "d", "signal": signal_chain}
    target.write_text(yaml.safe_dump({"name": "loud", "recipe": recipe}))
    acquire(project, dataset="loud")
    assert len(solved) == 12
    loud = project.folder("virtual-01").parents[2] / "loud" / "sessions" / "virtual-01"
    assert read_session(loud).scene["signal"]["external_noise_dba"] == 80
    names = sorted(path.name for path in quiet.glob("*.wav"))
    assert names == sorted(path.name for path in (loud / "audio").glob("*.wav"))
    settings = AudioSettings()
    first, second = (read_audio(f / names[0], settings).samples for f in (quiet, loud / "audio"))
    noise = second / 10 ** (-6 / 20) - first
    assert np.std(noise) > 100 * 2.0**-23


def test_a_silent_speaker_leaves_no_excitation_and_the_motor_alone(project, solved):
    """With the gripper's angle as drawn: the motor that is heard is that of the grasp's angle."""
    signal_chain = {"level_db_spl": None, "noise_db_spl": None, "motor": {"drift": 0}}
    recipe = {**RECIPE, "sessions": 1, "grasps_per_object": 1, "samples_per_grasp": 1}
    project.declare(recipe=recipe)
    acquire(project)
    folder = project.paths.session("d", "virtual-01")
    assert (folder / "excitation.wav").is_file()
    project.declare(recipe={**recipe, "signal": signal_chain})
    assert acquire(project)[0].recorded == 2
    assert read_session(folder).excitation is None
    assert not (folder / "excitation.wav").exists()
    assert len(solved) == 2  # what is played needs no new response
    spec = read_dataset(project.paths, "d")
    (grasps,) = planned_grasps(project.paths.dataset("d"), spec, ["virtual-01"])
    for grasp, recording in zip(grasps, read_recordings(folder)[0], strict=True):
        samples = read_audio(folder / recording.file, AudioSettings()).samples
        amplitudes = np.abs(np.fft.rfft(samples))[420 * np.arange(1, 9)] / 22_050
        wanted = harmonic_amplitudes(Motor(), grasp.setup["grasp"]["angle_deg"])
        np.testing.assert_allclose(amplitudes / amplitudes[0], wanted / wanted[0], rtol=1e-2)


ONE = {**RECIPE, "sessions": 1, "grasps_per_object": 1, "samples_per_grasp": 1}
SWEEP = {"kind": "log_sweep", "length_s": 0.05}
RATE = {"sample_rate_hz": 44_100}


@pytest.mark.parametrize(
    "excitation",
    [
        {"kind": "linear_sweep", "length_s": 0.05, "silence_before_s": 0.01},
        {"kind": "noise", "length_s": 0.05, "seed": 3, "high_hz": 8_000},
    ],
)
def test_other_sounds_are_played_in_the_same_scenes(project, solved, excitation):
    """Without noise, the spectrum of a recording over that of its sound is the transfer function
    of the scene, which does not depend on the sound."""
    quiet = {"noise_db_spl": None}
    ratios = []
    for played in (SWEEP, excitation):
        silence = {"silence_s": 0.05}  # the response decays, so that convolution is circular
        project.declare(audio=RATE, recipe={**ONE, "signal": quiet}, excitation=played | silence)
        acquire(project)
        folder = project.folder("virtual-01")
        sound, recording = (
            read_audio(folder / name, AudioSettings()).samples.astype(float)
            for name in ("excitation.wav", "audio/virtual-01_cube_20_01_1.wav")
        )
        count = 8_820
        ratio = np.fft.rfft(recording, count) / np.fft.rfft(sound, count)
        frequency = np.fft.rfftfreq(count, 1 / 44_100)
        ratios.append(ratio[(frequency > 1_000) & (frequency < 6_000)])
    assert np.abs(ratios[1] - ratios[0]).max() < 0.01 * np.abs(ratios[0]).max()
    assert len(solved) == 2
    assert read_session(folder).excitation.settings["kind"] == excitation["kind"]


def test_a_file_is_played_and_a_changed_file_is_recorded_again(project, solved):
    samples = excitation_samples(LogSweep(length_s=0.05), 44_100)
    path = project.root / "sounds" / "own.wav"
    path.parent.mkdir()
    write_pcm24(path, samples, 44_100)
    project.declare(audio=RATE, recipe=ONE, excitation={"kind": "file", "file": "sounds/own.wav"})
    acquire(project)
    session = read_session(project.folder("virtual-01"))
    assert session.excitation.sha256 == file_sha256(path)  # the same 24-bit file
    assert session.excitation.settings["sha256"] == file_sha256(path)
    own = recordings(project)["virtual-01/audio/virtual-01_cube_20_01_1.wav"]
    project.declare(audio=RATE, recipe=ONE, excitation=SWEEP)
    acquire(project)
    swept = recordings(project)["virtual-01/audio/virtual-01_cube_20_01_1.wav"]
    codes = [soundfile.read(io.BytesIO(content), dtype="int32")[0] for content in (own, swept)]
    assert np.abs((codes[0] >> 8) - (codes[1] >> 8)).max() <= 2  # 24 bits of the sound
    project.declare(audio=RATE, recipe=ONE, excitation={"kind": "file", "file": "sounds/own.wav"})
    spec = read_dataset(project.paths, "d")
    before = recipe_hash(spec.recipe, "virtual-01", spec.excitation)
    write_pcm24(path, 0.5 * samples, 44_100)
    spec = read_dataset(project.paths, "d")
    assert recipe_hash(spec.recipe, "virtual-01", spec.excitation) != before
    assert [tuple(done)[:2] for done in acquire(project)] == [(2, 0)]
    path.unlink()
    with pytest.raises(DataError, match=r"excitation\.file: there is no .*own\.wav"):
        acquire(project)
    assert len(solved) == 2
