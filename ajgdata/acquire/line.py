"""The line to a sound card: PortAudio in a process of its own, killed when it hangs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.acquire.card import CardError, CardSettings, Heard
from ajgdata.acquire.child import Child
from ajgdata.acquire.duplex import SLOWEST, STALLED_S, serve
from ajgdata.acquire.sound_card import SoundCard
from ajgdata.types import DataError

#: A process that imports and a driver that looks for its devices may take this long.
OPEN_S = 30.0
#: What the child may take beyond its own limit.
SLACK_S = 5.0


class PortAudioLine:
    """Line (see acquire.card) through PortAudio. The stream is opened here, once.

    A stalled interpreter loses frames, and a driver whose card is gone may never return: both
    concern a process that does nothing else.
    """

    def __init__(self, settings: CardSettings) -> None:
        self._settings = settings
        self._child = Child(serve)
        request = {"what": "open", "settings": settings.model_dump(mode="json")}
        self._about, _ = self._ask(request, b"", OPEN_S)

    @property
    def pid(self) -> int | None:
        """Process id of the child."""
        return self._child.pid

    def play(self, sound: NDArray[np.float32], frames: int) -> Heard:
        """Play `sound` (n,) once and record `frames` from its first frame on. Raises CardError."""
        limit = STALLED_S + SLOWEST * frames / self._settings.sample_rate_hz + SLACK_S
        request = {"what": "play", "frames": frames}
        said, content = self._ask(request, sound.astype(np.float32).tobytes(), limit)
        samples = np.frombuffer(content, dtype=np.float32).reshape(frames, said["inputs"])
        return Heard(samples, tuple(said["flags"]), said["idle_flags"], said["rate_hz"])

    def describe(self) -> Mapping[str, Any]:
        """Return API, driver and number of inputs."""
        return self._about

    def close(self) -> None:
        """End the process, and the stream with it."""
        self._child.kill()

    def _ask(
        self, request: Mapping[str, Any], content: bytes, timeout_s: float
    ) -> tuple[Mapping[str, Any], bytes]:
        name = self._settings.device
        try:
            return self._child.ask(request, content, timeout_s)
        except DataError as error:
            self.close()
            raise CardError(error.where, error.problem, error.fix) from None
        except TimeoutError:
            raise CardError(name, "the driver hangs", "plug the device in again") from None
        except EOFError:
            raise CardError(name, "its process has ended", "start again") from None


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
    child = Child(serve)
    try:
        return list(child.ask({"what": "list"}, b"", OPEN_S)[0]["devices"])
    except DataError as error:
        raise CardError(error.where, error.problem, error.fix) from None
    except (TimeoutError, EOFError):
        fix = "unplug devices one by one to find the one that makes it hang"
        raise CardError("PortAudio", "does not answer", fix) from None
    finally:
        child.kill()
