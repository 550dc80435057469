"""Recordings without a played sound begin at the trigger; without it, nothing is stored."""

import json

import numpy as np
import pytest
import yaml
from fake_card import RATE_HZ, FakeLine, Fault, fake_card
from fake_portaudio import FakePortAudio
from live_lab import PROTOCOL, TARGETS, Lab, Scripted
from test_duplex import opened

from ajgdata.acquire.card import CardError, TakeError
from ajgdata.acquire.operator import Choice
from ajgdata.acquire.trigger import Trigger
from ajgdata.paths import Paths
from ajgdata.pipeline.validate import validate_dataset
from ajgdata.store.audio import read_audio
from ajgdata.store.sessions import read_recordings, read_session
from ajgdata.types import AudioSettings, DataError, PassiveRecording

TRIGGERED = PassiveRecording(length_s=0.2, trigger_dbfs=-20, pre_trigger_s=0.05, time_limit_s=2)
AT_ONCE = PassiveRecording(length_s=0.2)
BEFORE = 2_205
FRAMES = 8_820
#: Frame of the tap, counted from the first frame that the microphone records.
TAP = 30_000


def tap(at: int = TAP, level: float = 0.8) -> np.ndarray:
    """A room in which something is tapped: a decaying oscillation in weak noise."""
    room = 1e-3 * np.random.default_rng(0).standard_normal(200_000)
    time = np.arange(4_000) / RATE_HZ
    room[at : at + 4_000] += level * np.cos(2 * np.pi * 700 * time) * np.exp(-time / 0.01)
    return room


def test_the_trigger_in_frames():
    trigger = Trigger.from_settings(TRIGGERED, RATE_HZ)
    assert trigger == Trigger(pytest.approx(0.1), FRAMES, BEFORE, 88_200)
    assert Trigger.from_settings(AT_ONCE, RATE_HZ) == Trigger(0.0, FRAMES, 0, 1)


@pytest.mark.parametrize(("level", "start"), [(0.8, 5), (0.25, 2), (0.9, None)])
def test_the_recording_begins_before_the_first_sample_that_reaches_the_level(level, start):
    samples = np.array([1, 0, 0, 0, 0.25, -0.5, 0.5, -0.8, 0, 0, 1], np.float32)
    trigger = Trigger(level, frames=4, before=2, limit=8)
    assert trigger.start(samples, len(samples)) == start
    assert trigger.start(samples, 4) is None


def test_a_triggered_recording_is_cut_exactly():
    room = tap()
    capture = fake_card(FakeLine(room=room)).take(TRIGGERED)
    begin = TAP - BEFORE
    np.testing.assert_array_equal(capture.samples, room[begin : begin + FRAMES].astype(np.float32))
    assert (capture.latency_samples, capture.arrival_samples) == (None, None)
    assert capture.labels()["latency_samples"] == ""
    assert capture.peak_dbfs == pytest.approx(20 * np.log10(0.8), abs=0.05)


def test_without_a_trigger_level_it_records_at_once():
    room = tap()
    capture = fake_card(FakeLine(room=room)).take(AT_ONCE)
    np.testing.assert_array_equal(capture.samples, room[:FRAMES].astype(np.float32))


@pytest.mark.parametrize(
    ("line", "settings", "error", "said"),
    [
        (FakeLine(room=tap(level=0.05)), TRIGGERED, TakeError, "no sound reached -20 dBFS in 2 s"),
        (FakeLine(room=tap(at=99_000)), TRIGGERED, TakeError, "no sound reached -20 dBFS in 2 s"),
        (FakeLine(), AT_ONCE, CardError, "microphone 1 is silent"),
        (
            FakeLine(room=tap(), faults=[Fault(flags=("input_overflow",))]),
            TRIGGERED,
            TakeError,
            "1 takes of 1 in doubt: the driver reported input_overflow",
        ),
        (
            FakeLine(room=tap(), faults=[Fault(nan=True)] * 3),
            AT_ONCE,
            TakeError,
            "3 takes of 3 in doubt: the driver gave 1 samples that are not numbers",
        ),
    ],
)
def test_what_cannot_be_recorded_is_named(line, settings, error, said):
    with pytest.raises(error, match=said) as caught:
        fake_card(line).take(settings)
    assert type(caught.value) is error


def test_a_recording_at_once_is_repeated_after_a_fault():
    line = FakeLine(room=tap(), faults=[Fault(flags=("input_overflow",))])
    capture = fake_card(line).take(AT_ONCE)
    assert (capture.doubts, capture.xruns) == (("the driver reported input_overflow",), 1)


@pytest.mark.parametrize("at", [0, 10_000, 50_001])
def test_the_stream_loses_no_frame_between_trigger_and_recording(at):
    """The room repeats itself, so a tap comes however late the stream listens."""
    room = tap(at=at)[:60_000].astype(np.float32)
    stream = opened(FakePortAudio(room=room, pause_s=0.0001))
    trigger = Trigger.from_settings(TRIGGERED, RATE_HZ)
    begun = stream._frames
    samples, flags = stream.listen(trigger)
    stream._stream.abort()
    (first,) = np.flatnonzero(room == samples[BEFORE])
    indices = np.arange(first - BEFORE, first - BEFORE + FRAMES)
    np.testing.assert_array_equal(samples, np.take(room, indices, mode="wrap"))
    assert abs(samples[BEFORE]) >= trigger.level and flags == ()
    assert stream._frames >= begun + FRAMES


def test_the_stream_says_that_nothing_triggered():
    stream = opened(FakePortAudio())
    samples, flags = stream.listen(Trigger(0.1, 4_000, 1_000, 6_000))
    assert (samples.shape, flags) == ((0,), ())
    sound = np.ones(100, np.float32)
    assert stream.play(sound, 3_000)[0].sum() == pytest.approx(100)  # the stream can play again
    stream._stream.abort()


def test_only_reports_of_the_recording_count():
    room = tap(at=160_000).astype(np.float32)
    stream = opened(FakePortAudio(room=room, pause_s=0.001, flags={20_000: "input_overflow"}))
    trigger = Trigger(0.1, FRAMES, BEFORE, 400_000)
    assert stream.listen(trigger)[1] == ()
    stream._stream.abort()


@pytest.fixture
def lab(tmp_path, monkeypatch):
    paths = Paths(tmp_path / "project")
    declare(paths)
    return Lab(paths, monkeypatch)


def declare(paths, **excitation):
    path = paths.dataset("d")
    path.parent.mkdir(parents=True, exist_ok=True)
    settings = {**TRIGGERED.model_dump(), **excitation}
    protocol = {**PROTOCOL, "samples_per_grasp": 1, "grasps_per_object": 1}
    content = {"name": "d", "targets": TARGETS, "excitation": settings, "protocol": protocol}
    path.write_text(yaml.safe_dump(content))


def test_a_passive_session_has_settings_and_no_played_sound(lab):
    lab.lines = [FakeLine(room=tap(), noise=1e-3)]
    _, done = lab.acquire(operator := Scripted())
    assert (done.recorded, done.left, done.skipped) == (2, 0, {})
    assert operator.notes == [
        "no sound is played: lost frames are detected only if the driver reports them",
        *["recording starts at -20 dBFS; waiting up to 2 s"] * 2,
    ]
    session = read_session(lab.folder())
    assert session.excitation is None and not (lab.folder() / "excitation.wav").exists()
    acquisition = session.acquisition
    assert acquisition.setup["excitation"] == TRIGGERED.model_dump()
    assert (acquisition.latency_samples, acquisition.level_dbfs) == (None, None)
    rows, _ = read_recordings(lab.folder())
    for row in rows:
        samples = read_audio(lab.folder() / row.file, AudioSettings()).samples
        assert len(samples) == FRAMES
        assert np.abs(samples[: BEFORE - 1]).max() < 0.1 <= abs(samples[BEFORE])
        assert row.labels["latency_samples"] == ""
    _, issues = validate_dataset(lab.paths, "d")
    assert [issue for issue in issues if issue.level != "note"] == []


def test_an_operator_decides_if_nothing_triggers(lab):
    lab.lines = [FakeLine(room=tap(), faults=[Fault(gain=0.01)], noise=1e-3)]
    _, done = lab.acquire(operator := Scripted(decisions=[Choice.SKIP]))
    ((problem, choices),) = operator.problems
    assert "no sound reached -20 dBFS in 2 s" in problem and Choice.KEEP not in choices
    assert list(done.skipped) == ["cube_01"] and done.recorded == 1


def test_a_session_has_one_kind_of_excitation(lab):
    lab.lines = [FakeLine(room=tap(), noise=1e-3)]
    lab.acquire(Scripted(confirms={1: Choice.QUIT}))
    declare(lab.paths, trigger_dbfs=-10)
    with pytest.raises(DataError, match="another setup: excitation"):
        lab.acquire(Scripted(), session="soundcard-01")
    path = lab.paths.dataset("d")
    content = yaml.safe_load(path.read_text())
    path.write_text(yaml.safe_dump(content | {"excitation": {"kind": "noise"}}))
    with pytest.raises(DataError, match="another setup: excitation, excitation_sha256"):
        lab.acquire(Scripted(), session="soundcard-01")
    _, issues = validate_dataset(lab.paths, "d")
    texts = [issue.problem for issue in issues if issue.code == "played_sound"]
    assert len(texts) == 1 and "(kind none, declared noise)" in texts[0]
    assert "no played sound, 0.2 s from 0.05 s before a peak of -20 dBFS" in texts[0]


def test_a_recipe_needs_a_played_sound(lab):
    path = lab.paths.dataset("d")
    content = yaml.safe_load(path.read_text())
    recipe = {"grasps_per_object": 1, "objects": [{"name": "x", "shape": {"kind": "cube"}}]}
    path.write_text(json.dumps(content | {"recipe": recipe}))
    with pytest.raises(DataError, match="the virtual gripper records only a played sound"):
        lab.acquire(Scripted())
