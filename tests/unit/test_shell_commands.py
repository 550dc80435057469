"""Arguments of printed commands reach the program unchanged, also on Windows."""

import sys

import pytest

from ajgdata.types.shell import shell_command, shell_quoted


@pytest.mark.parametrize(
    ("text", "quoted"),
    [
        ("plain-name.wav", "plain-name.wav"),
        (r"C:\data\mine", r"C:\data\mine"),
        ("my data", '"my data"'),
        ("a&b", '"a&b"'),
        ("(?P<label>.+)", '"(?P<label>.+)"'),
        ("C:\\my data\\", '"C:\\my data\\\\"'),
        ('a "b"', r'"a \"b\""'),
        ("", '""'),
    ],
)
def test_an_argument_on_windows(monkeypatch, text, quoted):
    monkeypatch.setattr(sys, "platform", "win32")
    assert shell_quoted(text) == quoted


def test_a_command_on_windows_and_elsewhere(monkeypatch):
    arguments = ["snakemake", "--config", "datasets=[my data]"]
    assert shell_command(arguments) == "snakemake --config 'datasets=[my data]'"
    monkeypatch.setattr(sys, "platform", "win32")
    assert shell_command(arguments) == 'snakemake --config "datasets=[my data]"'
