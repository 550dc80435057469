"""`--json`: one object on standard output, with the documented keys and the values of the text."""

import io
import json
import math
import sys

import pytest
from json_page import assert_documented, tables
from typer.main import get_command
from worlds import assert_one_line, write_tone

from ajgdata.cli.console import print_json
from ajgdata.cli.main import app
from ajgdata.store.files import read_csv


def json_of(text: str) -> dict:
    """Return the object of a line that is the whole output. NaN and Infinity are refused."""
    assert text.count("\n") == 1 and text.endswith("\n")
    return json.loads(text, parse_constant=pytest.fail)


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_numbers_without_a_value_are_null_and_letters_stay(capsys):
    print_json({"z": [math.nan, {"low": -math.inf}], "a": "Würfel", "n": 2, "interval": (1.5, 2)})
    line = '{"z": [null, {"low": null}], "a": "Würfel", "n": 2, "interval": [1.5, 2]}\n'
    assert capsys.readouterr().out == line


def test_letters_that_the_output_cannot_encode_are_escaped(monkeypatch):
    pipe = io.TextIOWrapper(io.BytesIO(), encoding="cp1252")
    monkeypatch.setattr(sys, "stdout", pipe)
    print_json({"label": "球"})
    assert pipe.buffer.getvalue().rstrip() == b'{"label": "\\u7403"}'


def test_only_a_terminal_has_indents(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stdout", terminal)
    print_json({"a": 1})
    assert terminal.getvalue() == '{\n  "a": 1\n}\n'


def test_each_command_with_the_option_has_a_table():
    commands = {}
    for name, command in get_command(app).commands.items():
        commands[name] = command
        for inner, subcommand in getattr(command, "commands", {}).items():
            commands[f"{name} {inner}"] = subcommand
    options = {
        name: [o for p in command.params for o in p.opts] for name, command in commands.items()
    }
    documented = {name.removesuffix(" of several runs") for name in tables()}
    assert {name for name, flags in options.items() if "--json" in flags} == documented


def test_check_lists_all_issues_of_all_data_sets(ajgdata, project):
    project.session(tones={"a": 500, "b": 510, "ü": 520})
    code, out, err = ajgdata("check", "--json")
    document = json_of(out)
    assert (code, err) == (0, "")
    assert document["datasets"] == ["d"] and document["not_fetched"] == []
    assert [document[f"n_{name}"] for name in ("recordings", "errors", "warnings")] == [3, 0, 0]
    (project.folder() / "audio" / "b.wav").unlink()
    write_tone(project.folder() / "audio" / "ü.wav", 700)
    code, out, err = ajgdata("check", "d", "--json")
    document = json_of(out)
    assert (code, err) == (3, "")
    assert [document[f"n_{name}"] for name in ("recordings", "errors", "warnings")] == [3, 2, 0]
    missing, changed = (i for i in document["issues"] if i["level"] == "error")
    assert missing == {
        "dataset": "d",
        "session_id": "s1",
        "recording_id": "b",
        "file": missing["file"],
        "level": "error",
        "code": "missing",
        "problem": "no such file, or a broken link",
        "fix": "restore it or remove its row",
    }
    assert (changed["recording_id"], changed["code"]) == ("ü", "changed")


def test_check_lists_accepted_recordings(ajgdata, project):
    project.session(tones={"a": 500, "b": 510, "c": 520})
    old = {r["recording_id"]: r["sha256"] for r in read_csv(project.folder() / "recordings.csv")[1]}
    (project.folder() / "audio" / "b.wav").unlink()
    new = write_tone(project.folder() / "audio" / "c.wav", 700)
    code, out, err = ajgdata("check", "d", "--accept", "--json")
    document = json_of(out)
    assert (code, err) == (3, "")
    identity = {"dataset": "d", "session_id": "s1", "recording_id": "c"}
    assert document["accepted"] == [identity | {"sha256_before": old["c"], "sha256": new}]
    (refused,) = document["not_accepted"]
    assert (refused["recording_id"], refused["fix"]) == ("b", "restore it or remove its row")
    assert document["n_errors"] == 1
    assert_documented("check", document)


@pytest.mark.parametrize("arguments", [("nope", "--json"), ("--accept", "--json")])
def test_an_error_prints_no_object(ajgdata, arguments):
    code, out, err = ajgdata("check", *arguments)
    assert (code, out) == (1, "")
    assert_one_line(err, "")
