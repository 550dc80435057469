"""kill -9, two processes at once and a full disk, at random moments: nothing is torn or lost."""

import os
import random
import shutil
import time

import pytest
import world

pytestmark = pytest.mark.torture

#: A share of all trials, the seed, and the longest time of one kind of trial.
SHARE = float(os.environ.get("AJGDATA_TORTURE_SHARE", "1"))
SEED = int(os.environ.get("AJGDATA_TORTURE_SEED", "0"))
SECONDS = float(os.environ.get("AJGDATA_TORTURE_SECONDS", "120"))
KILLS = {"import": 60, "workflow": 10, "publish": 15, "fetch": 40}


def trials(name, count):
    """Yield a random generator per trial, whose seed is printed, until the time is over."""
    end = time.monotonic() + SECONDS
    for number in range(max(1, round(count * SHARE))):
        if number and time.monotonic() > end:
            print(f"{name}: {number} trials of {count}")
            return
        print(f"trial {SEED}/{name}/{number}")
        yield random.Random(f"{SEED}/{name}/{number}")


@pytest.mark.parametrize(("name", "count"), KILLS.items())
def test_killed_at_any_moment(deeds, place, start, name, count):
    """After a restart each file has the bytes of an undisturbed run."""
    deed = deeds[name]
    whole = deeds[name].whole
    began = time.monotonic()
    start(deed.action, place(deed.start)).wait()
    longest = time.monotonic() - began
    for generator in trials(f"kill {name}", count):
        root = place(deed.start)
        process = start(deed.action, root)
        time.sleep(generator.uniform(0, longest))
        killed = process.kill()
        assert killed.code in (0, -9), killed
        assert world.torn(root, whole) == []
        complete = world.differing(root, whole) == []
        if name == "workflow":
            start(lambda root: world.workflow(root, "--unlock"), root).wait()
        again = start(deed.action, root).wait()
        # What was complete when it was killed is refused if it is published or fetched again.
        refused = name in ("publish", "fetch") and complete and len(again.errors) == 1
        assert again.code == 0 or refused, again
        assert world.differing(root, whole) == []


def check_pair(first, second, root, whole):
    """Each process finished, or says in one line why not; the result is that of one of them."""
    ends = [first.wait(), second.wait()]
    for ended in ends:
        assert "Traceback" not in ended.output, ended
    assert any(ended.code == 0 for ended in ends), ends
    assert world.differing(root, whole) == []
    assert world.leftovers(root) == []
    return ends


@pytest.mark.parametrize("name", ["import", "publish", "fetch"])
def test_two_at_once(deeds, place, start, name):
    deed = deeds[name]
    whole = deeds[name].whole
    for generator in trials(f"two {name}", 10):
        root = place(deed.start)
        first = start(deed.action, root)
        time.sleep(generator.uniform(0, 0.3))
        for ended in check_pair(first, start(deed.action, root), root, whole):
            assert ended.code == 0 or len(ended.errors) == 1, ended


@pytest.mark.parametrize("other", ["workflow", "import", "status"])
def test_a_command_during_the_workflow(deeds, place, start, other):
    deed = deeds["workflow"]
    whole = deeds["workflow"].whole
    actions = {name: deeds[name].action for name in ("workflow", "import")}
    actions["status"] = lambda root: world.run_command("status")
    for generator in trials(f"two workflow {other}", 3):
        root = place(deed.start)
        first = start(deed.action, root)
        time.sleep(generator.uniform(0, 15))
        ends = check_pair(first, start(actions[other], root), root, whole)
        assert other == "workflow" or [ended.code for ended in ends] == [0, 0], ends


@pytest.mark.parametrize("name", ["import", "publish", "fetch"])
def test_a_full_disk(deeds, place, start, name):
    """A message says so, nothing is damaged, and the command succeeds once there is space."""
    deed = deeds[name]
    whole = deeds[name].whole
    trial = place(deed.start)
    if world.command("mount", "-t", "tmpfs", "-o", "size=64m", "none", trial):
        pytest.skip("no file system can be mounted here")
    used = [
        sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
        for folder in (deed.start, deed.end)
    ]
    needed = used[1] - used[0]
    for generator in trials(f"full {name}", 4):
        place(deed.start)
        free = shutil.disk_usage(trial).free - int(generator.uniform(0, 1) * needed)
        with (trial / "ballast").open("wb") as ballast:
            os.posix_fallocate(ballast.fileno(), 0, max(free, 1))
        ended = start(deed.action, trial).wait()
        (trial / "ballast").unlink()
        if ended.code:
            assert ended.code > 0 and "Traceback" not in ended.output, ended
            assert "space" in ended.output, ended
            assert world.torn(trial, whole) == []
            assert start(deed.action, trial).wait().code == 0
        assert world.differing(trial, whole) == []
