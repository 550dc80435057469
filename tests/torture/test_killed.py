"""kill -9 of everything at random moments: after the restart all is as if nothing had happened."""

import time

import pytest
import world
from conftest import snakemake
from forked import Forked, run
from tally import trials

pytestmark = pytest.mark.torture
PROMISE = "After kill -9 and a restart: the same bytes, nothing torn"

COUNTS = {"import": 60, "acquire": 60, "jobs": 35, "publish": 15, "fetch": 40}


def wrong_after(root, deed, restarted) -> list[str]:
    """What is not as it was promised, once it has been started again."""
    found = [] if restarted.code == 0 else [f"restart ended with {restarted}"]
    return found + world.differing(root, deed.whole)


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
        again = run(deed.what, root)
        found = wrong_after(root, deed, again)
        # All was there when it was killed: published or fetched again it is refused, in one line.
        if name in ("publish", "fetch") and not lacking and len(again.errors) == 1:
            found = [one for one in found if not one.startswith("restart")]
        wrong += found
        tally.add(PROMISE, f"`{name}`, killed at a random moment", wrong)
    assert not [one for one in tally.failures if f"`{name}`, killed" in one]


def test_the_workflow_killed_at_any_moment(deeds, place, tally, workflow):
    deed, taken = workflow
    for random in trials("kill workflow", 10):
        root = place(deed.start)
        victim = snakemake(root)
        time.sleep(random.uniform(0.1, 1) * taken)
        victim.kill()
        wrong = [f"{one} is torn" for one in world.torn(root, deed.whole)]
        snakemake(root, "--unlock").ended()
        wrong += wrong_after(root, deed, snakemake(root).ended())
        tally.add(PROMISE, "whole workflow and its jobs, killed at a random moment", wrong)
    assert not [one for one in tally.failures if "whole workflow" in one]
