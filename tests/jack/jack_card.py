"""The virtual gripper as a sound card: a JACK client that plays what a scene would let one hear.

PortAudio sees it as a device of one output (`speaker`) and two inputs (`microphone`, `loopback`).
Scenes are switched while it runs, through a socket, by whoever places the objects.
"""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection, Listener
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.acquire.card import SIMULATED as DEVICE
from ajgdata.acquire.virtual_line import PERIOD
from ajgdata.gripper import SAMPLE_RATE_HZ
from ajgdata.types import DataError

if TYPE_CHECKING:
    from ajgdata.acquire.plant import Plant

#: JACK server of its own, so that none that is used for something else is disturbed.
SERVER_VARIABLE, SERVER = "JACK_DEFAULT_SERVER", "ajgdata"
#: Seconds that who asks waits for the card, and the card for who says nothing.
SWITCH_S, SILENT_S = 10, 1


def simulated_card_socket(server: str) -> Path:
    """Return the socket by which the simulated card on the JACK server `server` is told scenes."""
    user = os.getuid() if hasattr(os, "getuid") else 0  # Windows has one temporary folder each
    return Path(tempfile.gettempdir()) / f"ajgdata-{user}-{server}.socket"


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


def run_card(
    plant: Plant,
    responses: Mapping[str, NDArray[Any]],
    ready: Callable[[], object] = lambda: None,
) -> None:
    """Be the sound card until SIGTERM, Ctrl-C or the end of the JACK server.

    `responses` by title may be switched to by name alone (see `switch`). `ready` is called when the
    card can be used. Raises DataError if there is no JACK server, or such a card already.
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
    path = simulated_card_socket(server)
    path.unlink(missing_ok=True)  # of one that was killed; a running one was refused above
    with client, Listener(str(path), "AF_UNIX") as listener:
        threading.Thread(target=_obey, args=(listener, plant, dict(responses)), daemon=True).start()
        ready()
        while not stop.wait(0.2):  # signals are handled between two waits
            pass
    path.unlink(missing_ok=True)


def _obey(listener: Listener, plant: Plant, responses: dict[str, NDArray[Any]]) -> None:
    while True:
        try:
            with listener.accept() as caller:
                _limit(caller.fileno(), SILENT_S)
                title = json.loads(caller.recv_bytes())
                if content := caller.recv_bytes():
                    responses[title] = np.frombuffer(content, dtype=np.float64)
                if known := title in responses:
                    plant.set_response(responses[title])
                caller.send_bytes(json.dumps(known).encode())
        except (EOFError, ConnectionError, BlockingIOError, ValueError):
            continue  # who asked is gone, says nothing, or talks nonsense
        except OSError:
            return  # closed


def _connected(path: str) -> Connection:
    with socket.socket(socket.AF_UNIX) as made:
        _limit(made.fileno(), SWITCH_S)
        made.connect(path)
        return Connection(made.detach())


def _limit(descriptor: int, seconds: int) -> None:
    """Let no call to this socket take longer: it raises BlockingIOError instead."""
    with socket.socket(fileno=os.dup(descriptor)) as same:
        for option in (socket.SO_RCVTIMEO, socket.SO_SNDTIMEO):
            same.setsockopt(socket.SOL_SOCKET, option, struct.pack("ll", seconds, 0))


def switch(title: str, response: NDArray[Any] | None = None) -> bool:
    """Let the card play the scene `title` from now on; its `response`, unless it has it already.

    Return False if it has not. Raises DataError if no card runs, or one does not answer.
    """
    path = simulated_card_socket(own_server())
    try:
        with _connected(str(path)) as card:
            card.send_bytes(json.dumps(title).encode())
            card.send_bytes(b"" if response is None else np.asarray(response, float).tobytes())
            return bool(json.loads(card.recv_bytes()))
    except BlockingIOError:
        raise DataError("simulated card", "does not answer", "end it, and start it again") from None
    except (OSError, EOFError):
        fix = "start one"
        raise DataError("simulated card", "none is running", fix) from None
