"""Two of everything at once: each finishes, or says in one line who holds what."""

import time

import pytest
import world
from forked import Forked
from tally import trials

pytestmark = pytest.mark.torture
PROMISE = "Two at once: each finishes right, or says in one line who holds what"


@pytest.mark.parametrize("name", ["import", "publish", "fetch"])
def test_two_at_once(deeds, place, tally, name):
    deed = deeds[name]
    for random in trials(f"two {name}", 10):
        root = place(deed.start)
        first = Forked(deed.what, root)
        time.sleep(random.uniform(0, 0.3))
        second = Forked(deed.what, root)
        ends, wrong = [first.ended(), second.ended()], []
        for one in ends:
            if one.code and (len(one.errors) != 1 or "Traceback" in one.said):
                wrong.append(f"ended with {one}")
        if all(one.code for one in ends):
            wrong.append("neither finished")
        wrong += world.differing(root, deed.whole)
        wrong += [f"{one} is left" for one in world.leftovers(root)]
        tally.add(PROMISE, f"`{name}` beside `{name}`", wrong)
    assert not [one for one in tally.failures if f"`{name}` beside" in one]


@pytest.mark.parametrize("other", ["workflow", "import", "status"])
def test_something_beside_the_workflow(deeds, place, tally, other):
    deed = deeds["workflow"]
    what = {name: deeds[name].what for name in ("workflow", "import")}
    what["status"] = lambda root: world.said_by("status")
    for random in trials(f"two workflow {other}", 3):
        root, wrong = place(deed.start), []
        first = Forked(deed.what, root)
        time.sleep(random.uniform(0, 15))
        second = Forked(what[other], root)
        ends = {"the workflow": first.ended(), other: second.ended()}
        for name, one in ends.items():
            if (one.code and other != "workflow") or "Traceback" in one.said:
                wrong.append(f"{name} ended with {one}")
        if all(one.code for one in ends.values()):
            wrong.append(f"neither finished: {ends}")
        wrong += world.differing(root, deed.whole)
        wrong += [f"{one} is left" for one in world.leftovers(root)]
        tally.add(PROMISE, f"`{other}` beside the workflow", wrong)
    assert not [one for one in tally.failures if f"`{other}` beside the" in one]
