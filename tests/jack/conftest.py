"""A JACK server without hardware and a simulated card on it, for `pytest -m jack`."""

from __future__ import annotations

import os
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from ajgdata.acquire.card import CardSettings
from ajgdata.acquire.duplex import load_portaudio
from ajgdata.acquire.simulated_card import DEVICE, SERVER_VARIABLE, jack_server, load_jack
from ajgdata.types import DataError

#: Set (to anything) where the tier must not be skipped.
REQUIRED = "AJGDATA_REQUIRE_JACK"
CARD = """
import sys, numpy as np
from ajgdata.acquire.plant import Plant
from ajgdata.acquire.simulated_card import jack_server, run_card
response, period, noise = np.load(sys.argv[1]), *map(int, sys.argv[2:])
with jack_server(period=period) as pid:
    run_card(Plant(response, noise * 1e-6), {}, lambda: print(pid, flush=True))
"""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.jack)


class Rig(NamedTuple):
    """Processes of a simulated card, and the settings with which it is opened."""

    card: subprocess.Popen
    jackd: int
    settings: CardSettings


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


@pytest.fixture
def rig(tmp_path: Path, monkeypatch) -> Iterator[Callable[..., Rig]]:
    """Start a simulated card of the given response, on a JACK server of its own."""
    with ExitStack() as stack:

        def start(response=(1.0,), *, period=1_024, noise=0.0, **settings) -> Rig:
            monkeypatch.setenv(SERVER_VARIABLE, f"ajg-{uuid.uuid4().hex[:8]}")
            np.save(tmp_path / "response.npy", np.asarray(response, dtype=float))
            numbers = period, round(noise * 1e6)
            settings.setdefault("attempts", 20)  # without real-time rights, on a busy machine
            return stack.enter_context(_running(tmp_path / "response.npy", numbers, settings))

        yield start


@contextmanager
def _running(response: Path, numbers: tuple[int, ...], settings: dict) -> Iterator[Rig]:
    command = [sys.executable, "-c", CARD, str(response), *map(str, numbers)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "stdin": subprocess.DEVNULL}
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
    # JACK knows eight servers, and a killed one keeps its place until one of its name ends well.
    for _ in range(5):
        with suppress(DataError), jack_server():  # fails while the old one is still ending
            break
        time.sleep(1)
