"""Two of everything at once: each finishes, or says in one line who holds what."""

import time

import pytest
import world
from forked import Forked, run
from tally import trials
from test_killed import snakemake, workflow  # noqa: F401

pytestmark = pytest.mark.torture
PROMISE = "Two at once: each finishes right, or says in one line who holds what"


@pytest.mark.parametrize("name", ["import", "acquire", "publish", "fetch"])
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
def test_something_beside_the_workflow(deeds, place, tally, workflow, other):  # noqa: F811
    deed, _ = workflow
    root = place(deed.start)
    first, wrong = snakemake(root), []
    if other == "workflow":
        second = snakemake(root, "--quiet")
        codes = first.wait(), second.wait()
        if all(codes):
            wrong.append(f"neither finished: {(root.parent / 'said').read_text()[-500:]}")
    else:
        what = deeds["import"].what if other == "import" else lambda root: world.said_by("status")
        done = run(what, root)
        if done.code or "Traceback" in done.said:
            wrong.append(f"{other} ended with {done}")
        if code := first.wait():
            wrong.append(f"the workflow ended with {code}")
    wrong += world.differing(root, deed.whole)
    tally.add(PROMISE, f"`{other}` beside the workflow", wrong)
    assert not wrong
