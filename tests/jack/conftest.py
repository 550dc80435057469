"""A JACK server without hardware and a simulated card on it, for `make test-jack`."""

from __future__ import annotations

import fcntl
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from simulated_card import SERVER_VARIABLE, jack_server, load_jack, own_server

from ajgdata.acquire.card import DEVICE, CardSettings
from ajgdata.acquire.duplex import load_portaudio
from ajgdata.types import DataError

#: Set (to anything) where the tier must not be skipped.
REQUIRED = "AJGDATA_REQUIRE_JACK"
#: Prefix of a command that ends when its parent process ends, for whatever reason.
WITH_PARENT = ("setpriv", "--pdeathsig", "TERM")
#: JACK has eight servers per machine, and a killed one keeps its place until the next of its name.
SERVERS = [f"ajgdata-test-{n}" for n in range(4)]
#: A card that answers each line with "ready", and with "playing" at the next sound that it plays.
CARD = """
import sys, threading, numpy as np
sys.path.insert(0, sys.argv.pop())
from simulated_card import Plant, jack_server, run_card

class WatchedPlant(Plant):
    sound = threading.Event()

    def process(self, played):
        if played.any():
            self.sound.set()
        return super().process(played)

def answer():
    for _ in sys.stdin:
        WatchedPlant.sound.clear()
        print("ready", flush=True)
        WatchedPlant.sound.wait()
        print("playing", flush=True)

threading.Thread(target=answer, daemon=True).start()
response, period, noise = np.load(sys.argv[1]), *map(int, sys.argv[2:])
with jack_server(period=period) as pid:
    run_card(WatchedPlant(response, noise * 1e-6), lambda: print(pid, flush=True))
"""

# Lets fixtures end what they started, as after Ctrl-C.
signal.signal(signal.SIGTERM, signal.default_int_handler)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.jack)


class Rig(NamedTuple):
    """Processes of a simulated card, and the settings with which it is opened."""

    card: subprocess.Popen
    jackd: int
    settings: CardSettings

    @contextmanager
    def at_next_sound(self, act: Callable[[], object]) -> Iterator[None]:
        """Call `act` when the card begins to play a sound within this context."""
        assert self.card.stdin and self.card.stdout
        print(file=self.card.stdin, flush=True)
        assert self.card.stdout.readline() == "ready\n"

        def wait(lines=self.card.stdout) -> None:
            if lines.readline() == "playing\n":
                act()

        waiting = threading.Thread(target=wait)
        waiting.start()
        yield
        waiting.join()


@pytest.fixture(scope="session", autouse=True)
def _packages() -> None:
    for load in (load_jack, load_portaudio):
        try:
            load()
        except DataError as missing:
            if REQUIRED in os.environ:
                pytest.fail(str(missing))
            pytest.skip(str(missing))
    sys.modules["sounddevice"]._terminate()  # it belongs into a child, after the server is up


@pytest.fixture(scope="session")
def server() -> Iterator[str]:
    """Name of a JACK server that no other test process on this machine uses."""
    with ExitStack() as stack:
        for name in SERVERS:
            path = Path(tempfile.gettempdir()) / f"{name}.lock"
            lock = stack.enter_context(path.open("w"))
            with suppress(BlockingIOError):
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
        else:
            pytest.fail(f"{len(SERVERS)} other test processes use JACK on this machine")
        yield name


@pytest.fixture
def rig(tmp_path: Path, monkeypatch, server) -> Iterator[Callable[..., Rig]]:
    """Start a simulated card of the given response, on a JACK server of its own."""
    monkeypatch.setenv(SERVER_VARIABLE, server)
    own_server()  # for the processes that the tests start
    with ExitStack() as stack:

        def start(response=(1.0,), *, period=1_024, noise=0.0, **settings) -> Rig:
            stack.close()  # the one before
            np.save(tmp_path / "response.npy", np.asarray(response, dtype=float))
            numbers = period, round(noise * 1e6)
            settings.setdefault("attempts", 20)  # without real-time rights, on a busy machine
            return stack.enter_context(_running(tmp_path / "response.npy", numbers, settings))

        yield start


@contextmanager
def _running(response: Path, numbers: tuple[int, ...], settings: dict) -> Iterator[Rig]:
    command = [*WITH_PARENT, sys.executable, "-c", CARD, str(response), *map(str, numbers)]
    command.append(str(Path(__file__).parent))
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "stdin": subprocess.PIPE}
    with subprocess.Popen(command, text=True, **pipes) as process:
        try:
            said = process.stdout.readline()
            if not said:
                pytest.fail(process.communicate()[1])
            yield Rig(process, int(said), CardSettings(device=DEVICE, **settings))
        finally:
            process.terminate()
            with suppress(subprocess.TimeoutExpired):
                process.wait(10)
            process.kill()
    # A killed server keeps its place until the next of its name has ended without a signal.
    for _ in range(60):
        with suppress(DataError), jack_server():  # fails while the old one is still ending
            break
        time.sleep(1)
