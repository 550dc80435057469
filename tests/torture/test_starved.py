"""A full disk: one line, nothing damaged, and it goes on afterwards."""

import os
import shutil
import subprocess

import pytest
import world
from forked import run
from tally import trials

from ajgdata.store.files import bytes_below

pytestmark = pytest.mark.torture
PROMISE = "One line says what is missing; nothing is damaged; it goes on once it is there"
DEEDS = ("import", "publish", "fetch")


def mounted(*words) -> bool:
    done = subprocess.run(["mount", *map(str, words)], check=False, capture_output=True)
    return done.returncode == 0


@pytest.fixture
def place_of_trial(deeds):
    """The place at which all states were made, empty; whatever is mounted there goes again."""
    trial = deeds["import"].start.parent / "trial"
    shutil.rmtree(trial, ignore_errors=True)
    trial.mkdir()
    yield trial
    while os.path.ismount(trial):
        subprocess.run(["umount", "-l", str(trial)], check=True)


def filled(trial, state) -> None:
    for path in trial.iterdir():
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    shutil.copytree(state, trial, symlinks=True, dirs_exist_ok=True)


def judged(deed, root, ended, words, resume) -> list[str]:
    """What is wrong of a deed that ended this way, and of one that is done again after `resume`."""
    wrong = []
    if ended.code:
        told = [line for line in ended.said.splitlines() if any(word in line for word in words)]
        if not told or "Traceback" in ended.said or ended.code < 0:
            wrong.append(f"ended with {ended.code}: {ended.said[-400:]}")
        wrong += [f"{one} is torn" for one in world.torn(root, deed.whole)]
    resume()
    if ended.code:
        again = run(deed.what, root)
        wrong += [f"again: {again}"] if again.code else []
    return wrong + world.differing(root, deed.whole)


@pytest.mark.parametrize("name", DEEDS)
def test_a_full_disk(deeds, place_of_trial, tally, name):
    deed, trial = deeds[name], place_of_trial
    if not mounted("-t", "tmpfs", "-o", "size=64m", "none", trial):
        pytest.skip("no file system can be mounted here")
    before, after = (bytes_below(state) for state in (deed.start, deed.end))
    for random in trials(f"full {name}", 4):
        filled(trial, deed.start)
        room = shutil.disk_usage(trial).free - int(random.uniform(0, 1) * (after - before))
        with (trial / "ballast").open("wb") as ballast:
            os.posix_fallocate(ballast.fileno(), 0, max(room, 1))
        ended = run(deed.what, trial)
        words = ("full", "No space left", "room", "space")
        wrong = judged(deed, trial, ended, words, (trial / "ballast").unlink)
        tally.add(PROMISE, f"`{name}`, disk that fills up at a random point", wrong)
    assert not [one for one in tally.failures if f"`{name}`, disk" in one]
