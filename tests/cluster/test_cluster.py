"""What SLURM runs is what a run without it makes, whatever happens to nodes and jobs."""

import csv
import os
import signal
from pathlib import Path

from runs import FEATURES, TARGETS, Submitted

from tools.loopback_slurm import Slurm, wait_until

PATIENCE_S = 900


def assert_same_files(folder: Path, other: Path, kind: str) -> None:
    names, other_names = (
        sorted(str(path.relative_to(root)) for path in root.glob(kind) if path.is_file())
        for root in (folder, other)
    )
    assert names == other_names != []
    assert [n for n in names if (folder / n).read_bytes() != (other / n).read_bytes()] == []


def metrics(root: Path) -> list[dict[str, str]]:
    """All that was measured but what it cost."""
    with (root / "results/metrics.csv").open(newline="") as file:
        return [row for row in csv.DictReader(file) if row["statistic"] != "cost"]


def running(slurm: Slurm, run: Submitted) -> dict[str, str]:
    """The first job that runs."""

    def jobs() -> list[dict[str, str]]:
        assert run.process.poll() is None, run.log.read_text()
        return [job for job in slurm.jobs() if job["state"] == "RUNNING"]

    wait_until(jobs, "a running job", PATIENCE_S)
    return jobs()[0]


def processes_of(job: str) -> list[int]:
    """All processes of a job."""
    processes = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            environment = (folder / "environ").read_bytes().split(b"\0")
        except OSError:  # it ended
            continue
        if f"SLURM_JOB_ID={job}".encode() in environment:
            processes.append(int(folder.name))
    return processes


def kill(job: str) -> None:
    """Kill all processes of a job, when the first has started."""
    wait_until(lambda: processes_of(job), "the processes of a job")
    for pid in processes_of(job):
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            continue


def ended(slurm: Slurm) -> list[tuple[str, str, str]]:
    """Id, state and node of all jobs, in the order of their submission, when all are over."""
    wait_until(lambda: not slurm.active(), "the end of all jobs")
    jobs = sorted(slurm.jobs(), key=lambda job: int(job["id"]))
    return [(job["id"], job["state"], job["node"]) for job in jobs]


def other(slurm: Slurm, node: str) -> str:
    (left,) = set(slurm.nodes) - {node}
    return left


def test_a_project_has_the_bytes_of_a_run_without_it(slurm, project, reference):
    project.submit(*TARGETS).finish()
    for kind in (
        "data/*/sessions/*/audio/*.wav",
        "data/*/sessions/*/recordings.csv",
        "results/features/**/*.nc",
        "results/predictions.csv",
        "results/quarantine/*",
    ):
        assert_same_files(project.root, reference.root, kind)
    assert metrics(project.root) == metrics(reference.root) != []
    jobs = slurm.jobs()
    assert {job["state"] for job in jobs} == {"COMPLETED"}
    # five sessions in groups of two, one CPU each, on both nodes
    assert len([job for job in jobs if job["comment"].startswith("rule_features")]) == 2
    assert {job["cpus"] for job in jobs} == {"1"}
    assert {job["node"] for job in jobs} == set(slurm.nodes)


def test_a_killed_job_is_submitted_again_and_avoids_a_drained_node(slurm, project, features):
    run = project.submit(FEATURES)
    job = running(slurm, run)
    slurm.control("update", f"nodename={job['node']}", "state=drain", "reason=test")
    kill(job["id"])
    run.finish()
    assert_same_files(project.root, features.root, FEATURES)
    (_, failed, _), (_, state, node) = ended(slurm)
    assert failed != "COMPLETED"
    assert (state, node) == ("COMPLETED", other(slurm, job["node"]))


def test_a_job_over_its_memory_gets_more_at_the_next_attempt(slurm, project, features):
    # Snakemake alone takes more than 100 MB
    more = ("--set-resources", "features:mem_mb=100 + 1900 * (attempt - 1)")
    project.submit(FEATURES, more=more).finish()
    assert_same_files(project.root, features.root, FEATURES)
    jobs = {job["memory"]: job["state"] for job in slurm.jobs()}
    assert jobs.pop("2000M") == "COMPLETED"
    assert list(jobs) == ["100M"]
    assert jobs["100M"] != "COMPLETED"
