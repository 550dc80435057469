"""The line to a sound card: PortAudio in a process of its own, which is killed if it hangs.

A busy interpreter loses frames, and a driver may hang or crash if its card is unplugged.
The process of the robot must survive both.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from multiprocessing.connection import Connection, wait
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.acquire.card import CardError, CardSettings, Heard
from ajgdata.acquire.duplex import SLOWEST, STALLED_S, Duplex, devices, load_portaudio
from ajgdata.acquire.sound_card import SoundCard
from ajgdata.types import DataError

#: Time limit of a process that imports, and of a driver that searches for devices.
OPEN_S = 30.0
#: Time that the process may need in addition to its own limit.
SLACK_S = 5.0


class PortAudioLine:
    """One duplex stream through PortAudio, open until it is closed.

    Without `settings` it only lists devices.
    """

    def __init__(self, settings: CardSettings | None) -> None:
        context = multiprocessing.get_context("spawn")  # forking would copy threads in any state
        self._name = settings.device if settings else "PortAudio"
        self._rate_hz = settings.sample_rate_hz if settings else 0
        self._connection, theirs = context.Pipe()
        plain = settings.model_dump(mode="json") if settings else None
        self._process = context.Process(target=_serve, args=(theirs, plain), daemon=True)
        self._process.start()
        theirs.close()
        self.opened = self._answer(OPEN_S)  #: about the device, or the list of all devices

    @property
    def pid(self) -> int | None:
        """Process id of the child."""
        return self._process.pid

    def play(self, sound: NDArray[np.float32], frames: int) -> Heard:
        """Play `sound` (n,) once and record `frames` from its first frame on. Raises CardError."""
        try:
            self._connection.send((sound.astype(np.float32), frames))
        except OSError:
            raise CardError(self._name, "its process has ended", "start again") from None
        return Heard(*self._answer(STALLED_S + SLOWEST * frames / self._rate_hz + SLACK_S))

    def describe(self) -> Mapping[str, Any]:
        """Return API, driver and number of inputs."""
        return dict(self.opened)

    def close(self) -> None:
        """End the process, and the stream with it. May be called twice."""
        self._connection.close()
        self._process.kill()
        self._process.join(5)

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


def _serve(connection: Connection, settings: Mapping[str, Any] | None) -> None:
    """Open the stream of `settings` and play what is requested, until the parent ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent
    threading.Thread(target=_end_with_parent, daemon=True).start()
    null = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):  # drivers print
        os.dup2(null, stream)
    try:
        portaudio = load_portaudio()
        if settings is None:
            connection.send(devices(portaudio))
        else:
            duplex = Duplex(portaudio, settings)
            connection.send(duplex.describe())
            while True:
                connection.send(duplex.play(*connection.recv()))
    except EOFError:  # the line is closed
        return
    except DataError as error:
        connection.send(error)
    except Exception as error:  # the errors of PortAudio's drivers have no common type
        problem = f"{type(error).__name__}: {error}"
        connection.send(DataError("sound card", problem, "report this"))


def _end_with_parent() -> None:
    """End this process when its parent ends, without the exit functions of drivers."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


@contextmanager
def open_card(settings: CardSettings) -> Iterator[SoundCard]:
    """Yield the sound card of `settings`, with one stream until the end. Raises CardError."""
    card = SoundCard(PortAudioLine(settings), settings)
    try:
        yield card
    finally:
        card.close()


def list_devices() -> list[dict[str, Any]]:
    """Return `name`, `api`, `inputs`, `outputs` and `rates_hz` of each device. Raises CardError."""
    line = PortAudioLine(None)
    line.close()
    return list(line.opened)
