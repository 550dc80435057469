"""A process that may hang: it answers, complains in one line, or is gone."""

import gc
import os
import signal
import struct
import subprocess
import sys
import time
from multiprocessing.connection import Connection
from pathlib import Path

import pytest

from ajgdata.acquire.child import Child
from ajgdata.types import DataError


def handler():
    """Runs in the child; what is printed there must not reach anybody's pipe."""

    def handle(request, content):
        print("a driver talks")
        match request["what"]:
            case "twice":
                return {"length": len(content)}, 2 * content
            case "data":
                raise DataError("card", "is gone", "plug it in")
            case "defect":
                raise ZeroDivisionError("by zero")
            case "hang":
                time.sleep(60)
            case "half":  # of an answer: a hundred bytes are announced, one comes
                (pipe,) = (one for one in gc.get_objects() if isinstance(one, Connection))
                os.write(pipe.fileno(), struct.pack("!i", 100) + b"x")
                time.sleep(60)
            case _:
                os.kill(os.getpid(), signal.SIGKILL)
        return {}, b""

    return handle


def alive(pid: int) -> bool:
    """True unless it has ended; a zombie has."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.parametrize(
    "end, error", [("hang", TimeoutError), ("half", TimeoutError), ("die", EOFError)]
)
def test_it_answers_until_it_hangs_or_dies(end, error, capfd):
    child = Child(handler)
    answer, content = child.ask({"what": "twice"}, b"\0ab", 20)
    assert (answer, content) == ({"length": 3}, b"\0ab\0ab")
    with pytest.raises(DataError, match=r"^card: is gone; plug it in$"):
        child.ask({"what": "data"}, b"", 20)
    with pytest.raises(DataError, match="ZeroDivisionError: by zero"):
        child.ask({"what": "defect"}, b"", 20)
    begin = time.monotonic()
    with pytest.raises(error):
        child.ask({"what": end}, b"", 0.5)
    assert time.monotonic() - begin < 10 and not alive(child.pid)
    with pytest.raises(EOFError):
        child.ask({"what": "twice"}, b"", 20)
    child.kill()
    assert capfd.readouterr().out == ""


def test_a_pipe_that_nobody_empties_is_given_up_in_time():
    """A stopped process reads nothing: a second of sound is more than a pipe holds."""
    child = Child(handler)
    child.ask({"what": "twice"}, b"", 20)
    os.kill(child.pid, signal.SIGSTOP)
    begin = time.monotonic()
    with pytest.raises(TimeoutError):
        child.ask({"what": "twice"}, bytes(4_000_000), 0.5)
    assert time.monotonic() - begin < 10 and not alive(child.pid)


def test_it_ends_with_a_parent_that_was_killed():
    program = (
        "import test_child, time\n"
        "if __name__ == '__main__':\n"
        "    child = test_child.Child(test_child.handler)\n"
        "    child.ask({'what': 'twice'}, b'', 20)\n"
        "    print(child.pid, flush=True)\n"
        "    time.sleep(60)\n"
    )
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    environment = os.environ | {"PYTHONPATH": path}
    with subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, text=True, env=environment
    ) as parent:
        pid = int(parent.stdout.readline())
        assert alive(pid)
        parent.kill()
    deadline = time.monotonic() + 10
    while alive(pid):
        assert time.monotonic() < deadline
        time.sleep(0.05)
