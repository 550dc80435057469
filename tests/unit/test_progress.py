"""The bar changes nothing of what is gone through, shown or not."""

import io
import sys

import pytest

from ajgdata.pipeline.progress import lines, tracked


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize("stream", [io.StringIO, Terminal])
def test_every_item_comes_through_and_a_terminal_shows_a_bar(monkeypatch, stream):
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stderr", stream())
    assert list(tracked([3, 1, 2], "counting")) == [3, 1, 2]
    assert ("counting" in sys.stderr.getvalue()) is (stream is Terminal)


@pytest.mark.parametrize(("total", "said"), [(3, [1, 2, 3]), (20, list(range(2, 21, 2))), (0, [])])
def test_a_job_says_each_tenth_once(capfd, total, said):
    advance = lines("recording a/b")(total)
    for _ in range(total):
        advance()
    assert capfd.readouterr().err.splitlines() == [f"recording a/b: {n} of {total}" for n in said]
