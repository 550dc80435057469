"""A JACK server without hardware and a simulated card on it, for `make test-jack`."""

from __future__ import annotations

import importlib.util
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from simulated_card import DEVICE, PERIOD, SERVER, WITH_PARENT, jack_server

from ajgdata.acquire.card import CardSettings

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "unit"))  # test_acquire_killed
#: Set (to anything) where the tier must not be skipped.
REQUIRED = "AJGDATA_REQUIRE_JACK"
#: Longest time in s that a card and its server need to end, on a busy machine.
ENDING_S = 30

# Lets fixtures end what they started, as after Ctrl-C.
signal.signal(signal.SIGTERM, signal.default_int_handler)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if HERE in item.path.parents:
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
    missing = [name for name in ("jack", "sounddevice") if importlib.util.find_spec(name) is None]
    missing += [name for name in ("jackd", "setpriv") if shutil.which(name) is None]
    if missing:
        (pytest.fail if REQUIRED in os.environ else pytest.skip)(f"not installed: {missing}")


@pytest.fixture
def rig(tmp_path: Path, monkeypatch) -> Iterator[Callable[..., Rig]]:
    """Start a simulated card of the given response, on a JACK server of its own."""
    for name, value in SERVER.items():
        monkeypatch.setenv(name, value)
    with ExitStack() as stack:

        def start(response=(1.0,), *, noise=0.0, **settings) -> Rig:
            stack.close()  # the one before
            np.save(tmp_path / "response.npy", np.asarray(response, dtype=float))
            settings.setdefault("attempts", 20)  # without real-time rights, on a busy machine
            return stack.enter_context(_running(tmp_path / "response.npy", noise, settings))

        yield start


@contextmanager
def _running(response: Path, noise: float, settings: dict) -> Iterator[Rig]:
    program = [sys.executable, HERE / "simulated_card.py", response, PERIOD, noise]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "stdin": subprocess.PIPE}
    with subprocess.Popen([*WITH_PARENT, *map(str, program)], text=True, **pipes) as process:
        pid = ""
        try:
            pid = process.stdout.readline()
            if not pid:
                pytest.fail(process.communicate()[1])
            yield Rig(process, int(pid), CardSettings(device=DEVICE, **settings))
        finally:
            process.terminate()
            try:
                process.wait(ENDING_S)
            except subprocess.TimeoutExpired:
                process.kill()
                if pid:  # a server that does not end blocks the name for all further tests
                    with suppress(ProcessLookupError):
                        os.kill(int(pid), signal.SIGKILL)
    # A killed server keeps its place until the next of its name has ended without a signal.
    for _ in range(60):
        with suppress(RuntimeError), jack_server():  # fails while the old one is still ending
            break
        time.sleep(1)
