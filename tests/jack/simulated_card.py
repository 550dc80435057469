"""A plant as a sound card: a JACK client of one output (`speaker`) and two inputs (`microphone`,
`loopback`) that PortAudio sees as a device."""

from __future__ import annotations

import ctypes
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

import numpy as np
from scipy.signal import lfilter

from ajgdata.acquire.card import DEVICE
from ajgdata.gripper import SAMPLE_RATE_HZ
from ajgdata.types import DataError

#: JACK server of its own, so that none that is used for something else is disturbed.
SERVER_VARIABLE, SERVER = "JACK_DEFAULT_SERVER", "ajgdata"
#: Frames of a block of the server.
PERIOD = 1_024


class Plant:
    """Blocks in, blocks out: convolution with a `response` (m,), plus noise, in 24 bits."""

    def __init__(self, response: np.ndarray, noise: float = 0.0) -> None:
        self._response, self._noise = np.asarray(response, dtype=float), noise
        self._state = np.zeros(len(self._response) - 1)
        self._random = np.random.default_rng(0)

    def process(self, played: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return microphone and loop-back (n,) while the block `played` (n,) is played."""
        heard, self._state = lfilter(self._response, 1, played, zi=self._state)
        if self._noise:
            heard = heard + self._noise * self._random.standard_normal(len(played))
        return np.clip(np.round(heard * 2**23), -(2**23), 2**23 - 1) / 2**23, played


def load_jack() -> Any:
    """Return the module jack. DataError names the one package that is missing."""
    try:
        import jack
    except ModuleNotFoundError:
        fix = "run: pip install 'ajgdata[live]'"
        raise DataError("JACK-Client", "is not installed", fix) from None
    except OSError:
        raise _no_jack() from None
    if not shutil.which("jackd"):
        raise _no_jack()
    for told in (jack.set_error_function, jack.set_info_function):
        told(lambda _: None)
    return jack


def _no_jack() -> DataError:
    return DataError("JACK", "is not installed", "run: sudo apt-get install jackd2")


def own_server() -> str:
    """Return the JACK server that simulated cards use; from now on also by this process."""
    os.environ.update(JACK_NO_START_SERVER="1", JACK_NO_AUDIO_RESERVATION="1")
    return os.environ.setdefault(SERVER_VARIABLE, SERVER)


@contextmanager
def jack_server(rate_hz: int = SAMPLE_RATE_HZ, period: int = PERIOD) -> Iterator[int]:
    """Run a JACK server without hardware, and yield its process id. DataError if it fails."""
    jack = load_jack()
    own_server()
    command = ["jackd", "--no-realtime", "-d", "dummy", "-r", str(rate_hz), "-p", str(period)]
    quiet = subprocess.DEVNULL
    server = subprocess.Popen(
        command, stdin=quiet, stdout=quiet, stderr=quiet,
        preexec_fn=_end_with_parent,  # noqa: PLW1509 - it takes no lock and imports nothing
    )  # fmt: skip
    try:
        for _ in range(100):
            with suppress(jack.JackOpenError):
                jack.Client("ajgdata-waits", no_start_server=True).close()
                break
            if server.poll() is not None:
                fix = f"end the one that runs, or set {SERVER_VARIABLE} to another name"
                raise DataError("jackd", f"ended with code {server.returncode}", fix)
            time.sleep(0.1)
        else:
            raise DataError("jackd", "does not start", "run it by hand to see why")
        yield server.pid
    finally:
        server.terminate()
        try:
            server.wait(5)
        except subprocess.TimeoutExpired:
            server.kill()
            server.wait()


def _end_with_parent() -> None:
    """Ask the system to end this process with its parent, even a killed one (Linux)."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG


def run_card(plant: Plant, ready: Callable[[], object]) -> None:
    """Be the sound card until SIGTERM, Ctrl-C or the end of the JACK server.

    `ready` is called when the card can be used. Raises DataError if there is no JACK server, or
    such a card already.
    """
    jack = load_jack()
    server = own_server()
    try:
        client = jack.Client(DEVICE, use_exact_name=True, no_start_server=True)
    except jack.JackError as error:
        fix = f"end the one that runs; {SERVER_VARIABLE} is {server}"
        raise DataError(DEVICE, f"no such JACK client can be made ({error})", fix) from None
    speaker = client.inports.register("speaker")
    inputs = [client.outports.register(name) for name in ("microphone", "loopback")]
    stop = threading.Event()
    client.set_shutdown_callback(lambda *_: stop.set())

    @client.set_process_callback
    def process(_frames: int) -> None:
        for port, block in zip(inputs, plant.process(speaker.get_array()), strict=True):
            port.get_array()[:] = block

    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    with client:
        ready()
        while not stop.wait(0.2):  # signals are handled between two waits
            pass
