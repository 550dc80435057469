"""`ajgdata device`: lines for people, numbers and exit codes for scripts."""

import json
import re
import sys
from contextlib import contextmanager

import numpy as np
import pytest
from fake_card import FakeLine, fake_card
from json_page import assert_documented
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


def test_the_list_as_json(monkeypatch):
    card = {"name": "USB Audio", "api": "ALSA", "inputs": 2, "outputs": 0, "rate_hz": 48_000}
    monkeypatch.setattr(line, "list_devices", lambda: [card])
    done = RUN.invoke(cli.app, ["device", "list", "--json"])
    document = json.loads(done.stdout)
    assert (done.exit_code, document) == (0, {"devices": [card]})
    assert_documented("device list", document)


def test_the_check_as_json_has_numbers_and_the_same_exit_code(card):
    card(FakeLine(np.array([1.5]), noise=1e-4))
    done = RUN.invoke(cli.app, ["device", "check", "fake", "--rate", "48000", "--json"])
    assert (done.exit_code, done.stderr) == (3, "")
    document = json.loads(done.stdout)
    assert_documented("device check", document)
    assert (document["device"], document["sample_rate_hz"]) == ("fake", 48_000)
    assert document["latency_samples"] == [1024, 1024, 1024]
    assert document["clipped"] > 0
    assert document["peak_dbfs"] == pytest.approx(20 * np.log10(0.9 * 1.5), abs=0.05)  # 0.9: sweep
    assert document["issues"][0] == {
        "problem": f"{document['clipped']} samples are clipped",
        "fix": "lower output or input gain",
    }
