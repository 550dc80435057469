"""The project in its states, and processes that may be killed."""

from __future__ import annotations

import multiprocessing
import os
import shutil
import signal
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

import pytest
import world

from ajgdata.store.provenance import commit_date, software

Action = Callable[[Path], object]
#: Longer than any action takes on a busy machine.
LONGEST_S = 300.0


class Ended(NamedTuple):
    """How a process ended: its exit code (minus the signal that killed it) and its output."""

    code: int
    output: str

    @property
    def errors(self) -> list[str]:
        return [line for line in self.output.splitlines() if line.startswith("error ")]


class Running:
    """A process that performs `action` in the folder `root`, in a session of its own. It is forked:
    a trial does not import the package again."""

    def __init__(self, action: Action, root: Path) -> None:
        self._output = root.parent / f".output-{time.monotonic_ns()}"
        fork = multiprocessing.get_context("fork")
        self._process = fork.Process(target=_perform, args=(action, root, self._output))
        self._process.start()

    def wait(self) -> Ended:
        """Wait for its end."""
        self._process.join(LONGEST_S)
        return self.kill()

    def kill(self) -> Ended:
        """Kill what is left of it and of all that it started."""
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.kill()
        self._process.join()
        output = self._output.read_text(errors="replace") if self._output.exists() else ""
        self._output.unlink(missing_ok=True)
        return Ended(self._process.exitcode, output)


def _perform(action: Action, root: Path, output: Path) -> None:
    os.setsid()
    with output.open("w") as stream:
        for number in (1, 2):
            os.dup2(stream.fileno(), number)
    sys.stdout, sys.stderr = (os.fdopen(number, "w", buffering=1) for number in (1, 2))
    os.chdir(root)
    action(root)


@dataclass(frozen=True)
class Deed:
    """An action of a user on a project in the state `start`, which gives the state `end`."""

    action: Action
    start: Path
    end: Path

    @property
    def whole(self) -> dict[str, str]:
        return world.state_of(self.end)


@pytest.fixture(scope="session")
def start():
    return Running


@pytest.fixture(scope="session")
def deeds(tmp_path_factory):
    """Deeds by name; each state was created once, by deeds that nothing disturbed."""
    base = tmp_path_factory.mktemp("torture")
    source = world.source_folder(base / "knocks")
    software()  # git is called once, before the first fork
    commit_date()
    trial = base / "trial"  # one place for all: some files name their folder
    fresh = base / "fresh"
    (fresh / "datasets").mkdir(parents=True)
    states = {"empty": world.declare(base / "empty"), "fresh": fresh}

    def after(name: str, start: str, action: Action) -> Deed:
        shutil.rmtree(trial, ignore_errors=True)
        shutil.copytree(states[start], trial, symlinks=True)
        ended = Running(action, trial).wait()
        assert ended.code == 0, ended.output
        states[name] = base / name
        shutil.copytree(trial, states[name], symlinks=True)
        return Deed(action, states[start], states[name])

    result = {"import": after("import", "empty", partial(world.import_folder, source))}
    result["workflow"] = after("workflow", "import", world.workflow)
    result["publish"] = after("publish", "workflow", world.publish)
    with world.served(states["publish"] / "results/published/knock") as address:
        result["fetch"] = after("fetch", "fresh", partial(world.fetch, address))
        yield result


@pytest.fixture
def place(deeds):
    """Copy a state, always to the same place; a file system mounted there is removed afterwards."""
    trial = deeds["import"].start.parent / "trial"

    def copied(state: Path) -> Path:
        for path in trial.iterdir() if trial.exists() else ():
            shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()
        shutil.copytree(state, trial, symlinks=True, dirs_exist_ok=True)
        return trial

    yield copied
    while os.path.ismount(trial):
        world.command("umount", "-l", trial)
