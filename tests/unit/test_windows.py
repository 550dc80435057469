"""What works in another way on Windows, one function at a time."""

from __future__ import annotations

import io
import os
import signal
import sys
import threading
import time

import numpy as np
import pytest
import soundfile
from pydantic import ValidationError

from ajgdata.acquire.robot import RobotError, make_robot
from ajgdata.cli.project import diagnostics
from ajgdata.live.steps import Control
from ajgdata.store.audio import AudioError, read_audio
from ajgdata.store.lock import locked
from ajgdata.store.read_only import writable_view
from ajgdata.store.session_names import stored_session_names
from ajgdata.types import AudioSettings, DataError, DatasetSpec, checked_name
from ajgdata.types.protocol import RobotProgram


def test_the_memory_is_unknown_without_sysconf(monkeypatch):
    assert " GB of memory" in diagnostics(None)["resources"]
    monkeypatch.delattr(os, "sysconf", raising=False)
    assert "cores, memory unknown, " in diagnostics(None)["resources"]


def test_a_run_is_stopped_without_signals_for_threads(monkeypatch):
    monkeypatch.delattr(signal, "pthread_kill", raising=False)
    control = Control()
    control.begin()
    stopping = threading.Timer(0.05, control.stop)
    stopping.start()
    end = time.monotonic() + 60
    with pytest.raises(KeyboardInterrupt):
        while time.monotonic() < end:
            time.sleep(0.01)
    stopping.join()
    assert control.stopped


def test_a_program_of_a_robot_is_killed_without_groups_of_processes(monkeypatch):
    monkeypatch.delattr(os, "killpg", raising=False)
    program = RobotProgram(
        command=[sys.executable, "-c", "import time; time.sleep(600)"], timeout_s=0.5
    )
    with pytest.raises(RobotError, match=r"was not finished after 0\.5 s"):
        make_robot(program, print).move("jam")


def test_a_read_only_project_without_links_is_an_error(tmp_path, monkeypatch):
    def refuse(*_: object) -> None:
        raise OSError(1314, "a required privilege is not held")

    (tmp_path / "data").mkdir()
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    monkeypatch.setattr(os, "symlink", refuse)
    with (
        pytest.raises(DataError, match=r"is read-only, and links .* privilege is not held"),
        writable_view(tmp_path),
    ):
        pass


def test_nobody_opens_the_file_of_a_lock_that_is_held(tmp_path):
    """On Windows, the system refuses that, also to the process that holds the lock."""
    path = tmp_path / "out"
    with locked(path, "publishing into it"):
        lock = tmp_path / ".out.lock"
        times = lock.stat().st_mtime_ns, lock.stat().st_atime_ns
        with (
            pytest.raises(DataError, match=rf"publishing into it \(pid {os.getpid()} on"),
            locked(path, "publishing into it"),
        ):
            pass
        assert (lock.stat().st_mtime_ns, lock.stat().st_atime_ns) == times
        assert lock.stat().st_size == 0
    assert [file.name for file in tmp_path.iterdir()] == [".out.lock"]


@pytest.mark.parametrize("container", ["WAV", "WAVEX", "FLAC", "AIFF", "OGG"])
def test_audio_read_through_python_is_the_same(tmp_path, monkeypatch, container):
    stream = io.BytesIO()
    noise = np.random.default_rng(0).uniform(-0.9, 0.9, 5_000)
    soundfile.write(stream, noise, 44_100, format=container)
    path = tmp_path / "a.wav"
    path.write_bytes(stream.getvalue())
    expected = read_audio(path, AudioSettings())
    path.write_bytes(stream.getvalue()[:-100])
    try:
        expected_cut = read_audio(path, AudioSettings()).info
    except AudioError as error:
        expected_cut = str(error)

    monkeypatch.setattr("ajgdata.store.audio._READS_DESCRIPTORS", False)
    try:
        cut = read_audio(path, AudioSettings()).info
    except AudioError as error:
        cut = str(error)
    assert cut == expected_cut
    path.write_bytes(stream.getvalue())
    through_python = read_audio(path, AudioSettings())
    np.testing.assert_array_equal(through_python.samples, expected.samples)
    assert through_python.info == expected.info


@pytest.mark.parametrize("name", ["aux", "NUL", "Com1"])
def test_names_of_devices(name):
    with pytest.raises(DataError, match="Windows reserves this one for a device"):
        checked_name(name)
    with pytest.raises(ValidationError, match=f"'{name}' is reserved by Windows"):
        DatasetSpec(name=name, description="Names.")
    assert stored_session_names([name])[name].startswith(f"{name}-")


def test_tasks_that_differ_only_in_case():
    targets = {"size": {"kind": "regression"}}
    tasks = {"Size": {"target": "size"}, "size": {"target": "size"}}
    with pytest.raises(ValidationError, match="Size and size would have the same files on macOS"):
        DatasetSpec(name="mine", description="Names.", targets=targets, tasks=tasks)
