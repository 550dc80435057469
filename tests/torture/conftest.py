"""The tortured project in its states, and the table that the run writes."""

import os
import shutil
import signal
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pytest
import world
from forked import end_all, run
from tally import Tally, write_block

from ajgdata.store.provenance import commit_date, software

ROOT = Path(__file__).resolve().parents[2]
_TALLY = Tally()


@dataclass(frozen=True)
class Deed:
    """Something that people do: to a project in the state `start`, giving the state `end`."""

    name: str
    what: object
    start: Path
    end: Path

    @property
    def whole(self):
        return world.state_of(self.end)


@pytest.fixture(scope="session")
def tally():
    return _TALLY


@pytest.fixture(scope="session")
def deeds(tmp_path_factory):
    """Deeds by name; each state was made once, by deeds that nobody disturbed."""
    base = tmp_path_factory.mktemp("torture")
    source = world.source_folder(base / "knocks")
    software()  # git is asked once, before the first fork
    commit_date()
    trial = base / "trial"  # one place for all: some files name their folder
    empty = world.declare(base / "empty")
    fresh = base / "fresh"
    (fresh / "datasets").mkdir(parents=True)
    states = {"empty": empty, "fresh": fresh}

    def after(name: str, start: str, what) -> Deed:
        shutil.rmtree(trial, ignore_errors=True)
        shutil.copytree(states[start], trial, symlinks=True)
        done = run(what, trial)
        assert done.code == 0, done.said
        states[name] = base / name
        shutil.copytree(trial, states[name], symlinks=True)
        return Deed(name, what, states[start], states[name])

    made = [after("import", "empty", partial(world.bring, source))]
    made.append(after("workflow", "import", world.workflow))
    made.append(after("publish", "workflow", world.publish))
    with world.served(states["publish"] / "results/published/knock") as address:
        made.append(after("fetch", "fresh", partial(world.fetch, address)))
        yield {one.name: one for one in made}


@pytest.fixture
def place(deeds):
    """Give a fresh copy of a state, always at the same place."""
    trial = deeds["import"].start.parent / "trial"

    def copied(state: Path) -> Path:
        shutil.rmtree(trial, ignore_errors=True)
        shutil.copytree(state, trial, symlinks=True)
        return trial

    return copied


@pytest.fixture(scope="session", autouse=True)
def stoppable():
    """SIGTERM ends the run as Ctrl-C does: what it mounted goes, and what it started."""

    def stop(*_):
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, stop)
    yield
    signal.signal(signal.SIGTERM, before)


def pytest_sessionfinish(session):
    end_all()
    if not _TALLY.rows:
        return
    table = _TALLY.table()
    print("\n" + table)
    if os.environ.get("AJGDATA_TORTURE_WRITE"):
        write_block(ROOT / "docs" / "reliability.md", table)
