"""PortAudio in this process: devices of our choice, and a thread that calls back as drivers do."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np


class PortAudioError(Exception):
    """As sounddevice has it."""


def device(name: str, *, inputs: int = 1, outputs: int = 1, rate: float = 44_100, api: int = 0):
    return {
        "name": name,
        "hostapi": api,
        "max_input_channels": inputs,
        "max_output_channels": outputs,
        "default_samplerate": rate,
    }


@dataclass
class FakePortAudio:
    """Stands in for the module sounddevice. What is played is heard `latency` frames later.

    `blocks` are the sizes of the callbacks, in turn, none above the latency. `stops_after` frames
    the callbacks end without a word; `flags` are raised in the callback that begins at a frame.
    `room` (n,) is recorded in addition, again and again.
    """

    listed: Sequence[dict[str, Any]] = (device("fake"),)
    apis: Sequence[str] = ("ALSA", "JACK Audio Connection Kit")
    latency: int = 1_024
    blocks: Sequence[int] = (256, 64, 1_000)
    stops_after: float = float("inf")
    pause_s: float = 0.0
    room: np.ndarray = field(default_factory=lambda: np.zeros(0, np.float32))
    flags: dict[int, str] = field(default_factory=dict)
    opened: dict[str, Any] = field(default_factory=dict)
    PortAudioError: type[Exception] = PortAudioError

    def query_devices(self) -> Sequence[dict[str, Any]]:
        return self.listed

    def query_hostapis(self) -> list[dict[str, str]]:
        return [{"name": name} for name in self.apis]

    def get_portaudio_version(self) -> tuple[int, str]:
        return 1, "fake"

    def Stream(self, **settings: Any) -> _Stream:  # noqa: N802
        if settings["samplerate"] != self.listed[settings["device"]]["default_samplerate"]:
            raise PortAudioError("Invalid sample rate [PaErrorCode -9997]")
        self.opened = settings
        return _Stream(self, **settings)


class _Stream:
    def __init__(
        self,
        of: FakePortAudio,
        *,
        samplerate: float,
        channels: tuple[int, int],
        callback: Callable[..., None],
        **_: Any,
    ) -> None:
        self.samplerate = samplerate
        self._of = of
        self._channels = channels
        self._callback = callback
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._stopped = False
        self.active = True

    def start(self) -> None:
        self._thread.start()

    def abort(self) -> None:
        self._stopped = True
        self._thread.join()

    def _run(self) -> None:
        done = turn = 0
        delayed = np.zeros(self._of.latency, dtype=np.float32)
        while not self._stopped and done < self._of.stops_after:
            n = self._of.blocks[turn % len(self._of.blocks)]
            capture = np.zeros((n, self._channels[0]), dtype=np.float32)
            played = np.full((n, self._channels[1]), np.nan, dtype=np.float32)
            raised = [flag for at, flag in self._of.flags.items() if done <= at < done + n]
            names = ("input_overflow", "input_underflow", "output_overflow", "output_underflow")
            status = SimpleNamespace(**{name: name in raised for name in names})
            capture[:, 0] = delayed[:n]
            if len(self._of.room):
                capture[:, 0] += np.take(self._of.room, range(done, done + n), mode="wrap")
            self._callback(capture, played, n, None, status if raised else None)
            delayed = np.concatenate([delayed[n:], played.mean(axis=1) * self._channels[1]])
            done, turn = done + n, turn + 1
            time.sleep(self._of.pause_s)
