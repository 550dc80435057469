"""Fixtures of the unit tests."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest
from published import make_project, published
from worlds import Project

from ajgdata import gripper
from ajgdata.cli import main
from ajgdata.paths import Paths, Tree


@pytest.fixture
def project(tmp_path: Path) -> Project:
    example = Project(Paths(tmp_path / "project"))
    example.declare()
    return example


@pytest.fixture
def ajgdata(project, monkeypatch, capsys):
    """Run `ajgdata …` in the project; returns exit code, standard output and standard error."""
    monkeypatch.chdir(project.root)
    monkeypatch.delenv("AJGDATA_ROOT", raising=False)

    def run(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["ajgdata", *map(str, arguments)])
        with pytest.raises(SystemExit) as stopped:
            main()
        printed = capsys.readouterr()
        return stopped.value.code or 0, printed.out, printed.err

    return run


@pytest.fixture
def snapshot():
    """Bytes and modification time of every file below a folder, but for locks."""

    def take(folder: Path) -> dict[str, tuple[bytes, int]]:
        return {
            str(p.relative_to(folder)): (p.read_bytes(), p.stat().st_mtime_ns)
            for p in sorted(folder.rglob("*"))
            if p.is_file() and not (p.name[0] == "." and p.suffix == ".lock")
        }

    return take


@pytest.fixture
def solved(monkeypatch):
    """Scenes that were really simulated."""
    scenes = []

    def simulate(scene):
        scenes.append(scene)
        return simulated(scene)

    simulated = gripper.simulate
    monkeypatch.setattr(gripper, "simulate", simulate)
    return scenes


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    """A project, its published data set, and what publishing returned."""
    root = tmp_path_factory.mktemp("world")
    project = make_project(root / "project")
    return project, Tree(root / "tree"), published(project, root / "tree")


@pytest.fixture
def tree(world, tmp_path):
    """A copy of the published data set."""
    shutil.copytree(world[1].root, tmp_path / "tree")
    return Tree(tmp_path / "tree")
