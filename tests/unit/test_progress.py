"""The bar changes nothing of what is gone through, shown or not."""

import io
import sys

import pytest

from ajgdata.pipeline.progress import bar, lines, when_slow


@pytest.mark.parametrize("patience_s", [0.0, 60.0])
def test_every_item_comes_through_in_order(patience_s):
    assert list(when_slow([3, 1, 2], "counting", patience_s)) == [3, 1, 2]


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize(("patience_s", "shown"), [(0.0, True), (60.0, False)])
def test_a_bar_is_shown_to_who_waits(monkeypatch, patience_s, shown):
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stderr", Terminal())
    with bar("counting", patience_s) as started:
        advance = started(3)
        advance()
    assert ("counting" in sys.stderr.getvalue()) is shown


def test_a_bar_that_was_shown_is_taken_away_when_the_work_fails(capfd):
    def work():
        for item in when_slow([1, 0], "dividing", 0.0):
            yield 1 / item

    with pytest.raises(ZeroDivisionError):
        list(work())


@pytest.mark.parametrize(("total", "said"), [(3, [1, 2, 3]), (20, list(range(2, 21, 2))), (0, [])])
def test_a_job_says_each_tenth_once(capfd, total, said):
    advance = lines("recording a/b")(total)
    for _ in range(total):
        advance()
    assert capfd.readouterr().err.splitlines() == [f"recording a/b: {n} of {total}" for n in said]
