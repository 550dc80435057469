"""One duplex stream of PortAudio, counted frame by frame; it runs in a process of its own.

The driver is asked as little as possible: its latency is a claim (JACK's has been hours), its
status flags may be missing, and a card that is pulled out may simply fall silent. So frames are
counted here, whoever waits looks at the clock, and what was lost is looked for in the sound.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.types import DataError

#: Seconds without a single frame after which a stream is dead.
STALLED_S = 3.0
#: A stream that is this many times slower than its rate is not one.
SLOWEST = 4.0
#: Up to so many inputs are all opened, so that a sound on the wrong one is found there.
ALL_INPUTS = 8
FLAGS = ("input_overflow", "input_underflow", "output_overflow", "output_underflow")
RATES_HZ = (44_100, 48_000, 96_000, 192_000)
#: A driver that gives another rate than was asked for is off by more than any crystal.
RATE_TOLERANCE = 1e-3


class _Job(NamedTuple):
    sound: NDArray[np.float32]
    buffer: NDArray[np.float32]
    at: int


def load_portaudio() -> Any:
    """Return the module sounddevice. DataError names the one package that is missing."""
    try:
        import sounddevice
    except ModuleNotFoundError:
        raise DataError(
            "sounddevice", "is not installed", "run: pip install 'ajgdata[live]'"
        ) from None
    except OSError:
        raise DataError(
            "PortAudio", "is not installed", "run: sudo apt-get install libportaudio2"
        ) from None
    return sounddevice


def devices(portaudio: Any) -> list[dict[str, Any]]:
    """Return name, API, inputs, outputs and rates (of those in use) of each device."""
    apis = [api["name"] for api in portaudio.query_hostapis()]
    return [
        {
            "name": one["name"],
            "api": apis[one["hostapi"]],
            "inputs": one["max_input_channels"],
            "outputs": one["max_output_channels"],
            "rates_hz": [r for r in _rates(one) if _supports(portaudio, index, one, r)],
        }
        for index, one in enumerate(portaudio.query_devices())
    ]


def _rates(device: Mapping[str, Any]) -> list[int]:
    return sorted({*RATES_HZ, round(device["default_samplerate"])})


def _supports(portaudio: Any, index: int, device: Mapping[str, Any], rate_hz: int) -> bool:
    try:
        if device["max_input_channels"]:
            portaudio.check_input_settings(index, channels=1, samplerate=rate_hz)
        if device["max_output_channels"]:
            portaudio.check_output_settings(index, channels=1, samplerate=rate_hz)
    except portaudio.PortAudioError:
        return False
    return True


def find_device(portaudio: Any, name: str) -> tuple[int, Mapping[str, Any], str]:
    """Return number, description and API of the device `name`, or `name, API`.

    Raises DataError unless exactly one is called so: PortAudio itself would take a part of a name.
    """
    apis = [api["name"] for api in portaudio.query_hostapis()]
    known = [(n, one, apis[one["hostapi"]]) for n, one in enumerate(portaudio.query_devices())]
    found = [one for one in known if name in (one[1]["name"], f"{one[1]['name']}, {one[2]}")]
    if len(found) == 1:
        return found[0]
    if found:
        said = " or ".join(f'"{name}, {api}"' for _, _, api in found)
        raise DataError(name, f"{len(found)} devices have this name", f"say {said}")
    names = [one["name"] for _, one, _ in known]
    near = [n for n in names if name.lower() in n.lower()] or get_close_matches(name, names, 1)
    fix = f'perhaps "{near[0]}"' if near else "see `ajgdata device list`"
    raise DataError(name, "there is no such device", f"give its exact name: {fix}")


class Duplex:
    """An open stream: plays one sound at a time and records what comes meanwhile.

    `settings` are those of acquire.card.CardSettings; `portaudio` is the module sounddevice.
    Raises DataError, in one line, for a device that is not there or does not do as it is told.
    """

    def __init__(self, portaudio: Any, settings: Mapping[str, Any]) -> None:
        self._name, self._rate_hz = settings["device"], settings["sample_rate_hz"]
        self._channel = settings["output_channel"] - 1
        self._job: _Job | None = None
        self._done = threading.Event()
        self._frames = 0
        self._flags: list[str] = []
        index, device, self._api = find_device(portaudio, self._name)
        self._version = portaudio.get_portaudio_version()[1]
        self._inputs = _inputs(self._name, device, settings)
        self._stream = self._open(portaudio, index)

    def _open(self, portaudio: Any, index: int) -> Any:
        try:
            stream = portaudio.Stream(
                samplerate=self._rate_hz,
                blocksize=0,
                device=index,
                channels=(self._inputs, self._channel + 1),
                dtype="float32",
                callback=self._callback,
            )
            stream.start()
        except portaudio.PortAudioError as error:
            said = str(error.args[0] if error.args else error).split(" [PaErrorCode")[0]
            if "sample rate" in said.lower():
                rate = round(portaudio.query_devices()[index]["default_samplerate"])
                problem, fix = f"does not do {self._rate_hz} Hz", f"its own rate is {rate} Hz"
                raise DataError(self._name, problem, fix) from None
            fix = "close other programs that use it, or plug it in again"
            raise DataError(self._name, said, fix) from None
        given = stream.samplerate
        if abs(given / self._rate_hz - 1) > RATE_TOLERANCE:
            stream.abort()
            problem = f"gives {given:.0f} Hz where {self._rate_hz} Hz are asked for"
            raise DataError(self._name, problem, f"use {given:.0f} Hz, or another device")
        return stream

    def describe(self) -> dict[str, Any]:
        """Return API, driver and number of inputs."""
        return {"api": self._api, "driver": self._version, "inputs": self._inputs}

    def play(
        self, sound: NDArray[np.float32], frames: int
    ) -> tuple[NDArray[np.float32], tuple[str, ...]]:
        """Play `sound` (n,) and return `frames` samples (frames, inputs), and the driver's flags.

        Raises DataError when frames no longer come.
        """
        self._flags.clear()
        self._done.clear()
        buffer = np.zeros((frames, self._inputs), dtype=np.float32)
        self._job = _Job(sound, buffer, 0)
        self._wait(frames)
        return buffer, tuple(self._flags)

    def close(self) -> None:
        """End the stream."""
        self._stream.abort()
        self._stream.close()

    def _wait(self, frames: int) -> None:
        """Wait until all frames are there, as long as they come."""
        begin = seen_at = time.monotonic()
        seen = self._frames
        while not self._done.wait(0.05):
            now = time.monotonic()
            if self._frames != seen:
                seen, seen_at = self._frames, now
            if not self._stream.active or now - seen_at > STALLED_S:
                self._job = None
                if not self._frames:
                    problem = f"the driver did not ask for sound within {STALLED_S:.0f} s"
                    raise DataError(self._name, problem, "close other programs that use it")
                raise DataError(self._name, "went away while it played", "plug it in again")
            if now - begin > STALLED_S + SLOWEST * frames / self._rate_hz:
                self._job = None
                raise DataError(self._name, "is slower than its rate", "use another device or API")

    def _callback(
        self, heard: NDArray, played: NDArray, frames: int, _times: object, status: Any
    ) -> None:
        """Play the next frames and keep those that came. Nothing here may wait, or grow while
        nobody records."""
        played.fill(0)
        if (job := self._job) is not None:
            self._flags += [flag for flag in FLAGS if getattr(status, flag)] if status else []
            part = job.sound[job.at : job.at + frames]
            played[: len(part), self._channel] = part
            room = job.buffer[job.at : job.at + frames]
            room[:] = heard[: len(room)]
            more = job.at + frames < len(job.buffer)
            self._job = job._replace(at=job.at + frames) if more else None
            if not more:
                self._done.set()
        self._frames += frames


def _inputs(name: str, device: Mapping[str, Any], settings: Mapping[str, Any]) -> int:
    """Return how many inputs to open. DataError for a device that has too few channels."""
    has = {"input": device["max_input_channels"], "output": device["max_output_channels"]}
    for key in ("output_channel", "input_channel", "loopback_channel"):
        kind = "output" if key == "output_channel" else "input"
        if (asked := settings[key] or 0) > has[kind]:
            fix = f"give another {key}" if has[kind] else "use one device that plays and records"
            raise DataError(name, f"{key} {asked}, but it has {has[kind]} {kind}s", fix)
    needed = max(settings["input_channel"], settings["loopback_channel"] or 0)
    return has["input"] if has["input"] <= ALL_INPUTS else needed
