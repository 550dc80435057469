"""A plant as a sound card: a JACK client of one output (`speaker`) and one input (`microphone`)
that PortAudio sees as a device.

    python simulated_card.py RESPONSE.npy PERIOD NOISE

The program prints the process id of its JACK server. It answers each line with "ready", and with
"playing" at the next sound that it plays.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import numpy as np
from scipy.signal import lfilter

from ajgdata.gripper import SAMPLE_RATE_HZ

#: Its name for PortAudio.
DEVICE = "simulated card"
#: Frames of a block of the server.
PERIOD = 1_024
#: A server of its own, so that none that is used for something else is disturbed.
SERVER = {
    "JACK_DEFAULT_SERVER": "ajgdata-test",
    "JACK_NO_START_SERVER": "1",
    "JACK_NO_AUDIO_RESERVATION": "1",
}
#: Prefix of a command that ends when its parent process ends, for whatever reason.
WITH_PARENT = ("setpriv", "--pdeathsig", "TERM")


class Plant:
    """Blocks in, blocks out: convolution with a `response` (m,), plus noise, in 24 bits."""

    def __init__(self, response: np.ndarray, noise: float = 0.0) -> None:
        self._response = np.asarray(response, dtype=float)
        self._noise = noise
        self._state = np.zeros(len(self._response) - 1)
        self._random = np.random.default_rng(0)
        self.sound = threading.Event()  #: set while something is played

    def process(self, played: np.ndarray) -> np.ndarray:
        """Return what the microphone records (n,) while the block `played` (n,) is played."""
        if played.any():
            self.sound.set()
        recording, self._state = lfilter(self._response, 1, played, zi=self._state)
        if self._noise:
            recording = recording + self._noise * self._random.standard_normal(len(played))
        return np.clip(np.round(recording * 2**23), -(2**23), 2**23 - 1) / 2**23


@contextmanager
def jack_server(period: int = PERIOD) -> Iterator[int]:
    """Run a JACK server without hardware, and yield its process id. RuntimeError if it fails."""
    import jack

    command = [*WITH_PARENT, "jackd", "--no-realtime", "-d", "dummy"]
    command += ["-r", str(SAMPLE_RATE_HZ), "-p", str(period)]
    quiet = subprocess.DEVNULL
    server = subprocess.Popen(command, stdin=quiet, stdout=quiet, stderr=quiet)
    try:
        end = time.monotonic() + 10
        while True:
            with suppress(jack.JackOpenError):
                jack.Client("ajgdata-waits", no_start_server=True).close()
                break
            if server.poll() is not None or time.monotonic() > end:
                raise RuntimeError("jackd does not start: end the one that runs with this name")
            time.sleep(0.1)
        yield server.pid
    finally:
        server.terminate()
        with suppress(subprocess.TimeoutExpired):
            server.wait(5)
        server.kill()
        server.wait()


@contextmanager
def running_card(plant: Plant) -> Iterator[threading.Event]:
    """Be the sound card of `plant`; the event is set when the JACK server ends."""
    import jack

    client = jack.Client(DEVICE, use_exact_name=True, no_start_server=True)
    speaker = client.inports.register("speaker")
    microphone = client.outports.register("microphone")
    stop = threading.Event()
    client.set_shutdown_callback(lambda *_: stop.set())

    @client.set_process_callback
    def process(_frames: int) -> None:
        microphone.get_array()[:] = plant.process(speaker.get_array())

    with client:
        yield stop


def answer(plant: Plant) -> None:
    for _ in sys.stdin:
        plant.sound.clear()
        print("ready", flush=True)
        plant.sound.wait()
        print("playing", flush=True)


def main(response: str, period: str, noise: str) -> None:
    os.environ.update(SERVER)
    plant = Plant(np.load(response), float(noise))
    threading.Thread(target=answer, args=(plant,), daemon=True).start()
    with jack_server(int(period)) as pid, running_card(plant) as stop:
        signal.signal(signal.SIGTERM, lambda *_: stop.set())
        print(pid, flush=True)
        while not stop.wait(0.2):  # signals are handled between two waits
            pass


if __name__ == "__main__":
    main(*sys.argv[1:])
