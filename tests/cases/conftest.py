"""An empty project, and the commands of a user in it, called in this process."""

from __future__ import annotations

import csv
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pytest
from recorded import make_features
from sounds import resonances, write_wav

from ajgdata.cli import main
from ajgdata.paths import Paths


@dataclass(frozen=True)
class Printed:
    """What a command printed, and its exit code."""

    code: int
    out: str
    err: str

    @property
    def text(self) -> str:
        """Both streams, with single spaces and without line breaks."""
        return " ".join(f"{self.out} {self.err}".split())


@pytest.fixture
def paths(tmp_path, monkeypatch) -> Paths:
    """An empty project, which is the working directory."""
    root = tmp_path / "project"
    (root / "datasets").mkdir(parents=True)
    monkeypatch.chdir(root)
    monkeypatch.delenv("AJGDATA_ROOT", raising=False)
    return Paths(root)


@pytest.fixture
def src(tmp_path) -> Path:
    """The folder that a user imports."""
    folder = tmp_path / "src"
    folder.mkdir()
    return folder


@pytest.fixture
def ajgdata(paths, monkeypatch, capsys):
    """Run `ajgdata …` in the project."""

    def run(*arguments: object) -> Printed:
        monkeypatch.setattr(sys, "argv", ["ajgdata", *map(str, arguments)])
        with pytest.raises(SystemExit) as stopped:
            main()
        printed = capsys.readouterr()
        return Printed(stopped.value.code or 0, printed.out, printed.err)

    return run


@pytest.fixture
def rows(paths):
    """Rows of recordings.csv of a session."""

    def read(dataset: str, session: str = "src") -> list[dict[str, str]]:
        with paths.recordings_file(dataset, session).open(encoding="utf-8", newline="") as stream:
            return list(csv.DictReader(stream))

    return read


@pytest.fixture
def features(paths):
    """Compute the feature file of a data set, as the workflow does."""

    return partial(make_features, paths)


@pytest.fixture
def import_balls_and_cubes(src, ajgdata, features):
    """Import four balls and four cubes as a data set, and compute its features."""

    def imported(dataset: str) -> None:
        for number, label in enumerate(("ball", "cube")):
            for grasp in range(1, 5):
                write_wav(src / f"{grasp + 4 * number}_{label}.wav", resonances(number, grasp))
        assert ajgdata("import", src, "--dataset", dataset).code == 0
        features(dataset)

    return imported
