"""kill -9 of everything at random moments: after the restart all is as if nothing had happened."""

import os
import shutil
import signal
import subprocess
import sys
import time

import pytest
import world
from conftest import ROOT
from forked import Forked, run
from tally import trials

pytestmark = pytest.mark.torture
PROMISE = "After kill -9 and a restart: the same bytes, nothing torn, nothing left behind"

COUNTS = {"import": 45, "acquire": 45, "jobs": 45, "publish": 15, "fetch": 40}


def wrong_after(root, deed, restarted) -> list[str]:
    """What is not as it was promised, once it has been started again."""
    found = [] if restarted.code == 0 else [f"restart ended with {restarted}"]
    found += world.differing(root, deed.whole)
    return found + [f"{name} is left" for name in world.leftovers(root)]


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
        wrong += wrong_after(root, deed, run(deed.what, root))
        # Finished just before: no kill of it, and published or fetched again it is refused.
        if killed.code == 0:
            wrong = [one for one in wrong if not one.startswith("restart")]
        tally.add(PROMISE, f"`{name}`, killed at a random moment", wrong)
    assert not [one for one in tally.failures if f"`{name}`, killed" in one]


def snakemake(root, *words):
    """Start the workflow on the project, in a session of its own."""
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(ROOT / "Snakefile")]
    command += ["--directory", str(root), "--configfile", str(root / "settings.yaml")]
    with (root.parent / "said").open("w") as said:
        return subprocess.Popen(
            [*command, "--cores", "2", "results/metrics.json", *words],
            stdout=said, stderr=subprocess.STDOUT, start_new_session=True, cwd=root,
        )  # fmt: skip


@pytest.fixture(scope="module")
def workflow(deeds, tmp_path_factory):
    """The state after the whole workflow, and how long that takes."""
    trial = deeds["import"].start.parent / "trial"
    shutil.rmtree(trial, ignore_errors=True)
    shutil.copytree(deeds["import"].end, trial)
    began = time.monotonic()
    assert snakemake(trial).wait() == 0, (trial.parent / "said").read_text()
    taken = time.monotonic() - began
    end = deeds["import"].start.parent / "workflow"
    shutil.copytree(trial, end, symlinks=True)
    return type(deeds["import"])("workflow", None, deeds["import"].end, end), taken


def test_the_workflow_killed_at_any_moment(deeds, place, tally, workflow):
    deed, taken = workflow
    for random in trials("kill workflow", 10):
        root = place(deed.start)
        victim = snakemake(root)
        time.sleep(random.uniform(0.1, 1) * taken)
        os.killpg(victim.pid, signal.SIGKILL)
        victim.wait()
        wrong = [f"{one} is torn" for one in world.torn(root, deed.whole)]
        if code := snakemake(root).wait():
            wrong.append(f"restart ended with {code}: {(root.parent / 'said').read_text()[-500:]}")
        wrong += world.differing(root, deed.whole)
        wrong += [f"{name} is left" for name in world.leftovers(root)]
        tally.add(PROMISE, "whole workflow and its jobs, killed at a random moment", wrong)
    assert not [one for one in tally.failures if "whole workflow" in one]
