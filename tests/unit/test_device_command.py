"""`ajgdata device`: lines for people, numbers and exit codes for scripts."""

import re
import sys
from contextlib import contextmanager

import numpy as np
import pytest
from fake_card import FakeLine, fake_card
from typer.testing import CliRunner

from ajgdata import cli
from ajgdata.acquire import line, sound_card

RUN = CliRunner()


@pytest.fixture
def card(monkeypatch):
    """Whatever is opened is this fake line."""

    def use(fake: FakeLine) -> FakeLine:
        @contextmanager
        def opened(settings):
            yield fake_card(fake, **settings.model_dump(exclude={"device"}))

        monkeypatch.setattr(sound_card, "open_card", opened)
        return fake

    return use


def test_no_device_is_an_error_of_one_line(monkeypatch, capsys):
    monkeypatch.setattr(line, "list_devices", list)
    monkeypatch.setattr(sys, "argv", ["ajgdata", "device", "list"])
    with pytest.raises(SystemExit) as end:
        cli.main()
    printed = capsys.readouterr().err
    assert end.value.code == 1 and printed.count("\n") == 1
    assert "detects no sound card" in printed


def test_a_good_card_is_ready(card):
    card(FakeLine(np.array([0.3]), noise=1e-4))
    done = RUN.invoke(cli.app, ["device", "check", "fake"])
    assert done.exit_code == 0, done.output
    assert "good         the card is ready: record" in done.stdout
    assert re.search(r"latency +1024, 1024, 1024 samples", done.stdout)


def test_a_card_that_cannot_be_used_ends_with_code_3(card):
    card(FakeLine(np.array([1.5]), noise=1e-4))
    done = RUN.invoke(cli.app, ["device", "check", "fake"])
    assert done.exit_code == 3 and "samples are clipped; lower output" in done.stdout
