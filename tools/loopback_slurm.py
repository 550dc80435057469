"""A throw-away SLURM on this machine: a controller and nodes on the loopback, for tests and timing.

Needs root, Linux, and Debian's slurmctld, slurmd, slurm-client and munge. It has no accounting
database. The nodes share the machine: each believes in CPUs and memory of its own, so that jobs
spread as on a cluster; nobody else can use it, as munge's key is made for it and thrown away.
If the process that started it is killed, its daemons end with it, and the next start removes the
rest.
"""

from __future__ import annotations

import fcntl
import os
import secrets
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "squeue", "scontrol", "setpriv")
#: Prefix of a command that ends when its parent process ends, for whatever reason.
WITH_PARENT = ("setpriv", "--pdeathsig", "TERM")
#: In the environment of all daemons and jobs of a loopback SLURM, but not of a job's watcher.
MARK = b"SLURM_CLUSTER_NAME=loopback"
WATCHER = b"slurmstepd: ["
#: Where every program of SLURM looks: the executor passes no SLURM_CONF on to its jobs.
CONFIGURATION = Path("/etc/slurm/slurm.conf")
#: States of jobs that are over.
ENDED = {"COMPLETED", "FAILED", "CANCELLED", "NODE_FAIL", "OUT_OF_MEMORY", "TIMEOUT"}
#: Seconds after which a program that should have answered is given up.
PATIENCE_S = 300.0

HEADER = "# Written by tools/loopback_slurm.py, which locks this file while it is in use.\n"
TEMPLATE = """\
ClusterName=loopback
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={port}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket={folder}/munge/munge.sock
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool.%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
MpiDefault=none
ReturnToService=2
SlurmdParameters=config_overrides
SchedulerParameters=sched_interval=1,batch_sched_delay=0,bf_interval=1
MinJobAge=3600
KillWait=2
# A node of a busy machine may answer late.
SlurmdTimeout=300
# Memory is watched, not walled in: a job is killed when a look at it finds too much.
JobAcctGatherType=jobacct_gather/linux
JobAcctGatherFrequency=task=1
JobAcctGatherParams=OverMemoryKill
AccountingStorageType=accounting_storage/none
"""
NODE = (
    "NodeName={name} NodeHostname={host} NodeAddr=127.0.0.1 Port={port} CPUs={cpus}"
    " RealMemory={mb} State=UNKNOWN\n"
)
PARTITION = "PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP\n"


def free_ports(number: int) -> list[int]:
    """Return ports of the loopback that nobody listens on."""
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(number)]
        for item in sockets:
            item.bind(("127.0.0.1", 0))
        return [item.getsockname()[1] for item in sockets]


def missing() -> str:
    """Return in words why it cannot be started here; "" if it can."""
    absent = [name for name in PROGRAMS if shutil.which(name) is None]
    if absent:
        return f"no {', '.join(absent)} here (Debian: slurmctld slurmd slurm-client munge)"
    if os.geteuid() != 0:
        return "only root can start slurmd"
    if CONFIGURATION.exists() and not _is_abandoned():
        return f"{CONFIGURATION} is there: this machine has a SLURM of its own"
    return ""


def _is_abandoned() -> bool:
    """Return True if the configuration belongs to a loopback SLURM whose owner was killed."""
    with CONFIGURATION.open() as file:
        if file.readline() != HEADER:
            return False
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
    return True


def processes() -> list[int]:
    """Return the daemons, watchers and jobs of all loopback SLURMs on this machine."""
    marked = []
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):  # the process has ended
            is_marked = MARK in (folder / "environ").read_bytes().split(b"\0")
            if is_marked or (folder / "cmdline").read_bytes().startswith(WATCHER):
                marked.append(int(folder.name))
    return marked


def _kill_processes() -> None:
    for pid in processes():
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


class Slurm:
    """A running controller and its nodes, in one folder."""

    def __init__(self, folder: Path, nodes: Sequence[str]) -> None:
        self.folder = folder
        self.nodes = tuple(nodes)
        self.processes: dict[str, subprocess.Popen] = {}

    def start(self, name: str) -> None:
        """Start munge, the controller or a node, in the foreground, as a child of this process."""
        munge = self.folder / "munge"
        commands = {
            "munged": [
                "munged",
                "--foreground",
                "--force",
                f"--key-file={munge}/munge.key",
                f"--socket={munge}/munge.sock",
                f"--pid-file={munge}/munged.pid",
                f"--log-file={munge}/munged.log",
                f"--seed-file={munge}/munge.seed",
            ],
            "slurmctld": ["slurmctld", "-D"],
        }
        command = commands.get(name, ["slurmd", "-D", "-N", name])
        with (self.folder / f"{name}.out").open("a") as out:
            self.processes[name] = subprocess.Popen(
                [*WITH_PARENT, *command],
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=out,
                start_new_session=True,
                env=os.environ | dict([MARK.decode().split("=")]),
            )

    def stop(self, name: str, number: int = signal.SIGTERM) -> None:
        """End one of them, and wait until it is gone."""
        process = self.processes.pop(name)
        process.send_signal(number)
        with suppress(subprocess.TimeoutExpired):
            process.wait(10)
        process.kill()
        process.wait()

    def states(self) -> dict[str, str]:
        """Return the state of each node, in SLURM's words; nothing while the controller is away."""
        said = subprocess.run(
            ["sinfo", "--noheader", "--Node", "--format=%N %T"],
            check=False,
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
        )
        return dict(line.split() for line in said.stdout.splitlines())

    def jobs(self) -> list[dict[str, str]]:
        """Return id, state, node and comment (Snakemake's rule) of every job that is remembered."""
        said = subprocess.run(
            ["squeue", "--noheader", "--states=all", "--format=%i|%T|%N|%C|%m|%k"],
            check=True,
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
        )
        names = ("id", "state", "node", "cpus", "memory", "comment")
        return [dict(zip(names, line.split("|"), strict=True)) for line in said.stdout.splitlines()]

    def active(self) -> list[dict[str, str]]:
        """Return the jobs that wait, run or end."""
        return [job for job in self.jobs() if job["state"] not in ENDED]

    def control(self, *arguments: str) -> None:
        """Call `scontrol`."""
        subprocess.run(
            ["scontrol", *arguments], check=True, capture_output=True, timeout=PATIENCE_S
        )


def wait_until(true: Callable[[], object], what: str, patience_s: float = PATIENCE_S) -> None:
    """Return when a condition holds; raises TimeoutError, which says for what it waited."""
    end = time.monotonic() + patience_s
    while not true():
        if time.monotonic() > end:
            raise TimeoutError(f"{what}: not within {patience_s:g} s")
        time.sleep(0.2)


@contextmanager
def loopback_slurm(
    folder: Path, *, nodes: int = 2, cpus: int = 2, memory_mb: int = 4_000
) -> Iterator[Slurm]:
    """Run a SLURM of some nodes in a new folder; everything is taken down at the end."""
    names = [f"node{n + 1}" for n in range(nodes)]
    munge = folder / "munge"
    munge.mkdir(parents=True, mode=0o700)
    (munge / "munge.key").write_bytes(secrets.token_bytes(128))
    (munge / "munge.key").chmod(0o400)
    (folder / "state").mkdir()
    slurm = Slurm(folder, names)
    with _configured(folder, _configuration(folder, names, cpus, memory_mb)):
        try:
            slurm.start("munged")
            wait_until((munge / "munge.sock").exists, "munge")
            slurm.start("slurmctld")
            for name in names:
                slurm.start(name)
            wait_until(lambda: list(slurm.states().values()) == ["idle"] * nodes, "nodes of SLURM")
            yield slurm
        finally:
            _end(slurm)


def _configuration(folder: Path, names: Sequence[str], cpus: int, memory_mb: int) -> str:
    """Return the text of slurm.conf."""
    host = os.uname().nodename.split(".")[0]
    controller, *ports = free_ports(1 + len(names))
    text = HEADER + TEMPLATE.format(host=host, port=controller, folder=folder)
    for name, port in zip(names, ports, strict=True):
        text += NODE.format(name=name, host=host, port=port, cpus=cpus, mb=memory_mb)
    return text + PARTITION


@contextmanager
def _configured(folder: Path, text: str) -> Iterator[None]:
    """Let every program of SLURM use a configuration; remove what a killed owner left."""
    is_made = not CONFIGURATION.parent.exists()
    CONFIGURATION.parent.mkdir(exist_ok=True)
    if CONFIGURATION.is_symlink():
        CONFIGURATION.unlink()
        _kill_processes()
    with (folder / "slurm.conf").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        file.write(text)
        file.flush()
        CONFIGURATION.symlink_to(folder / "slurm.conf")
        try:
            yield
        finally:
            CONFIGURATION.unlink()
            if is_made:
                CONFIGURATION.parent.rmdir()


def _end(slurm: Slurm) -> None:
    """End all jobs and daemons."""
    with suppress(subprocess.SubprocessError, TimeoutError):
        subprocess.run(["scancel", "--user=root"], check=False, timeout=10, capture_output=True)
        wait_until(lambda: not slurm.active(), "end of jobs", 20)
    for name in reversed(list(slurm.processes)):
        slurm.stop(name)
    _kill_processes()
