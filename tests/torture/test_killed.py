"""kill -9 of everything at random moments: after the restart all is as if nothing had happened."""

import time

import pytest
import world
from forked import Forked, run
from tally import trials

pytestmark = pytest.mark.torture
PROMISE = "After kill -9 and a restart: the same bytes, nothing torn"

COUNTS = {"import": 60, "workflow": 10, "publish": 15, "fetch": 40}


def unlock(root) -> None:
    world.workflow(root, "--unlock")


@pytest.mark.parametrize(("name", "count"), COUNTS.items())
def test_killed_at_any_moment(deeds, place, tally, name, count):
    deed = deeds[name]
    began = time.monotonic()
    run(deed.what, place(deed.start))
    longest = time.monotonic() - began
    for random in trials(f"kill {name}", count):
        root = place(deed.start)
        victim = Forked(deed.what, root)
        time.sleep(random.uniform(0, longest))
        killed = victim.kill()
        wrong = [f"{one} is torn" for one in world.torn(root, deed.whole)]
        if killed.code not in (0, -9):
            wrong.append(f"ended with {killed}")
        lacking = world.differing(root, deed.whole)
        if name == "workflow":
            run(unlock, root)
        again = run(deed.what, root)
        # All was there when it was killed: published or fetched again it is refused, in one line.
        refused = name in ("publish", "fetch") and not lacking and len(again.errors) == 1
        wrong += [f"restart ended with {again}"] if again.code and not refused else []
        wrong += world.differing(root, deed.whole)
        tally.add(PROMISE, f"`{name}`, killed at a random moment", wrong)
    assert not [one for one in tally.failures if f"`{name}`, killed" in one]
