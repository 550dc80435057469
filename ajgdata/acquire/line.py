"""The line to a sound card: one duplex stream of PortAudio in a separate process.

A busy interpreter loses frames, and a driver may hang or crash if its card is unplugged. The
process that moves the robot must survive both. Reports of drivers are not reliable: JACK has
reported a latency of hours, and status flags may be missing. This module therefore counts the
frames, and `acquire.markers` detects lost frames in the recorded sound.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection, wait
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.acquire.card import CardError, CardSettings
from ajgdata.acquire.trigger import Trigger
from ajgdata.types import DataError
from ajgdata.types.extras import optional_packages

#: A stream without a frame for this many seconds has failed.
STALLED_S = 3.0
#: A stream that is slower than its rate by this factor has failed.
SLOWEST = 4.0
#: Seconds between two looks at the recorded frames.
POLL_S = 0.05
#: Seconds for the process to start, and for the driver to search for devices.
OPEN_S = 30.0
#: Seconds that the process may need in addition to the limits of the stream.
SLACK_S = 5.0
FLAGS = ("input_overflow", "input_underflow", "output_overflow", "output_underflow")
#: Largest relative deviation from the requested rate. The deviation of crystals is far smaller.
RATE_TOLERANCE = 1e-3

#: Samples float32 (frames,) of the microphone, and the reports of the driver.
Recorded = tuple[NDArray[np.float32], tuple[str, ...]]


class PortAudioLine:
    """One duplex stream through PortAudio, open until it is closed.

    Without `settings` it only lists devices.
    """

    def __init__(self, settings: CardSettings | None) -> None:
        context = multiprocessing.get_context("spawn")  # a fork would copy locks held by threads
        self._name = settings.device if settings else "PortAudio"
        self._rate_hz = settings.sample_rate_hz if settings else 0
        self._connection, child = context.Pipe()
        plain = settings.model_dump(mode="json") if settings else None
        self._process = context.Process(target=_serve, args=(child, plain), daemon=True)
        self._process.start()
        child.close()
        self.opened = self._answer(OPEN_S)  #: description of the device, or the list of all devices

    def play(self, sound: NDArray[np.float32], frames: int) -> Recorded:
        """Play `sound` (n,) once and record `frames` from its first frame on. Raises CardError."""
        return self._request("play", sound.astype(np.float32), frames, longest=frames)

    def listen(self, trigger: Trigger) -> Recorded:
        """Play nothing and record from a trigger on, (trigger.frames,); (0,) without a trigger.

        Raises CardError.
        """
        return self._request("listen", trigger, longest=trigger.longest)

    def describe(self) -> Mapping[str, Any]:
        """Return API and driver."""
        return dict(self.opened)

    def close(self) -> None:
        """End the process, and the stream with it. May be called twice."""
        self._connection.close()
        self._process.kill()
        self._process.join(5)

    def _request(self, method: str, *arguments: Any, longest: int) -> Recorded:
        """Return the result of a method of the stream, which takes up to `longest` frames."""
        try:
            self._connection.send((method, arguments))
        except OSError:
            raise CardError(self._name, "its process has ended", "start again") from None
        return self._answer(STALLED_S + SLOWEST * longest / self._rate_hz + SLACK_S)

    def _answer(self, timeout_s: float) -> Any:
        """Return the answer of the process. Raises CardError; the process has then ended."""
        try:
            if not self._connection.poll(timeout_s):
                raise CardError(self._name, "the driver hangs", "plug the device in again")
            answer = self._connection.recv()
            if isinstance(answer, DataError):
                raise CardError(answer.where, answer.problem, answer.fix)
        except (EOFError, OSError):
            self.close()
            raise CardError(self._name, "its process has ended", "start again") from None
        except CardError:
            self.close()
            raise
        return answer


def list_devices() -> list[dict[str, Any]]:
    """Return `name`, `api`, `inputs`, `outputs` and `rate_hz` of each device. Raises CardError."""
    line = PortAudioLine(None)
    line.close()
    return list(line.opened)


def _serve(connection: Connection, settings: Mapping[str, Any] | None) -> None:
    """Open the stream of `settings` and play the requested sounds, until the parent ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C
    threading.Thread(target=_end_with_parent, daemon=True).start()
    null = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):  # drivers print to standard output and standard error
        os.dup2(null, stream)
    try:
        portaudio = load_portaudio()
        if settings is None:
            connection.send(devices(portaudio))
        else:
            duplex = Duplex(portaudio, settings)
            connection.send(duplex.describe())
            methods: dict[str, Callable[..., Recorded]]
            methods = {"play": duplex.play, "listen": duplex.listen}
            while True:
                method, arguments = connection.recv()
                connection.send(methods[method](*arguments))
    except EOFError:  # the line is closed
        return
    except DataError as error:
        connection.send(error)
    except Exception as error:  # the errors of PortAudio's drivers have no common type
        problem = f"{type(error).__name__}: {error}"
        connection.send(DataError("sound card", problem, "report this as a bug"))


def _end_with_parent() -> None:
    """End this process when its parent ends, without the exit functions of drivers."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def load_portaudio() -> Any:
    """Return the module sounddevice. DataError names the missing package."""
    try:
        with optional_packages("sound card"):
            import sounddevice
    except OSError:
        fix = "run `sudo apt-get install libportaudio2`"
        raise DataError("PortAudio", "is not installed", fix) from None
    return sounddevice


def devices(portaudio: Any) -> list[dict[str, Any]]:
    """Return name, API, inputs, outputs and default rate of each device."""
    apis = [api["name"] for api in portaudio.query_hostapis()]
    return [
        {
            "name": device["name"],
            "api": apis[device["hostapi"]],
            "inputs": device["max_input_channels"],
            "outputs": device["max_output_channels"],
            "rate_hz": round(device["default_samplerate"]),
        }
        for device in portaudio.query_devices()
    ]


def find_device(portaudio: Any, name: str) -> tuple[int, dict[str, Any]]:
    """Return number and description (see `devices`) of the device `name`, or `NAME, API`.

    Raises DataError unless exactly one device matches: PortAudio would accept a part of a name.
    """
    known = devices(portaudio)
    names = [(device["name"], f"{device['name']}, {device['api']}") for device in known]
    matches = [number for number, pair in enumerate(names) if name in pair]
    if len(matches) == 1:
        return matches[0], known[matches[0]]
    if matches:
        choices = " or ".join(f'"{names[number][1]}"' for number in matches)
        raise DataError(name, f"{len(matches)} devices have this name", f"use {choices}")
    fix = "give its exact name: see `ajgdata device list`"
    raise DataError(name, "there is no such device", fix)


class _Job(NamedTuple):
    """A sound (n,) to play, the buffer (frames,) to record into, and the number of frames done."""

    sound: NDArray[np.float32]
    buffer: NDArray[np.float32]
    position: int


class Duplex:
    """An open stream, which plays one sound at a time and records at the same time.

    `settings` are those of acquire.card.CardSettings; `portaudio` is the module sounddevice.
    Raises DataError, in one line, for a device that is missing or refuses the settings.
    """

    def __init__(self, portaudio: Any, settings: Mapping[str, Any]) -> None:
        self._name = settings["device"]
        self._rate_hz = settings["sample_rate_hz"]
        self._output = settings["output_channel"]
        self._input = settings["microphone"]
        self._job: _Job | None = None
        self._done = threading.Event()
        self._frames = 0
        self._flags: list[tuple[int, str]] = []  # end of the reported block, and report
        index, self._device = find_device(portaudio, self._name)
        self._version = portaudio.get_portaudio_version()[1]
        self._check_channel("--output-channel", self._output, "outputs")
        self._check_channel("--microphone", self._input, "inputs")
        self._stream = self._open(portaudio, index)

    def _check_channel(self, option: str, number: int, channels: str) -> None:
        """Raise DataError if the device has fewer `channels` (inputs or outputs) than `number`."""
        count = self._device[channels]
        if number > count:
            fix = f"change {option}, or use one device that has inputs and outputs"
            raise DataError(self._name, f"{option} {number} of {count} {channels}", fix)

    def _open(self, portaudio: Any, index: int) -> Any:
        """Return the started stream of the device with number `index`."""
        try:
            stream = portaudio.Stream(
                samplerate=self._rate_hz,
                blocksize=0,
                device=index,
                channels=(self._input, self._output),
                dtype="float32",
                callback=self._callback,
            )
            stream.start()
        except portaudio.PortAudioError as error:
            reason = str(error.args[0] if error.args else error).split(" [PaErrorCode")[0]
            fix = "close other programs that use it, or plug it in again"
            if "sample rate" in reason.lower():
                reason = f"does not support {self._rate_hz} Hz"
                fix = f"use its own rate, {self._device['rate_hz']} Hz"
            raise DataError(self._name, reason, fix) from None
        if abs(stream.samplerate / self._rate_hz - 1) > RATE_TOLERANCE:
            stream.abort()
            problem = f"gives {stream.samplerate:.0f} Hz instead of {self._rate_hz} Hz"
            raise DataError(self._name, problem, "declare that rate, or use another device")
        return stream

    def describe(self) -> dict[str, Any]:
        """Return API and driver."""
        return {"api": self._device["api"], "driver": self._version}

    def play(self, sound: NDArray[np.float32], frames: int) -> Recorded:
        """Play `sound` (n,) and record `frames` samples.

        Raises DataError if the stream stops.
        """
        buffer = self._begin(sound, frames)
        self._wait(frames)
        return buffer, tuple(flag for _, flag in self._flags)

    def listen(self, trigger: Trigger) -> Recorded:
        """Play nothing and record from a trigger on, (trigger.frames,); (0,) without a trigger.

        No frame is missing between the search for the trigger and the recording. The reports of the
        driver are those of the recording. Raises DataError if the stream stops.
        """
        buffer = self._begin(np.zeros(0, dtype=np.float32), trigger.longest)
        last = trigger.before + trigger.limit
        end = trigger.before
        start: int | None = None
        while start is None and end < last:
            searched = end
            end = min(end + round(POLL_S * self._rate_hz), last)
            self._wait(end)
            start = trigger.start(buffer, end, searched)
        if start is None:
            self._job = None
            return buffer[:0], ()
        self._wait(start + trigger.frames)
        self._job = None
        recorded = buffer[start : start + trigger.frames].copy()
        return recorded, tuple(flag for end, flag in self._flags if end > start)

    def _begin(self, sound: NDArray[np.float32], frames: int) -> NDArray[np.float32]:
        """Start to play `sound` (n,) and to record; return the buffer (frames,)."""
        self._flags.clear()
        self._done.clear()
        buffer = np.zeros(frames, dtype=np.float32)
        self._job = _Job(sound, buffer, 0)
        return buffer

    def _wait(self, end: int) -> None:
        """Wait until the first `end` frames are recorded. Raises DataError if the stream stops."""
        frames = self._frames
        last_change = time.monotonic()
        while not self._done.wait(POLL_S):
            job = self._job
            if job is None or job.position >= end:
                return
            now = time.monotonic()
            if self._frames != frames:
                frames = self._frames
                last_change = now
            if not self._stream.active or now - last_change > STALLED_S:
                self._job = None
                if not self._frames:
                    problem = f"the driver did not request sound within {STALLED_S:.0f} s"
                    raise DataError(self._name, problem, "close other programs that use it")
                raise DataError(self._name, "was disconnected while it played", "plug it in again")

    def _callback(
        self, recorded: NDArray, played: NDArray, frames: int, _times: object, status: Any
    ) -> None:
        """Play the next frames (frames, outputs) and store the recorded ones (frames, inputs).

        PortAudio calls this for each block. Without a job, it neither waits nor allocates.
        """
        played.fill(0)
        job = self._job
        if job is not None:
            end = job.position + frames
            if status:
                self._flags += [(end, flag) for flag in FLAGS if getattr(status, flag)]
            sound = job.sound[job.position : end]
            played[: len(sound), self._output - 1] = sound
            buffer = job.buffer[job.position : end]
            buffer[:] = recorded[: len(buffer), self._input - 1]
            if end < len(job.buffer):
                self._job = job._replace(position=end)
            else:
                self._job = None
                self._done.set()
        self._frames += frames
