"""Start a temporary SLURM on this computer for tests and timing: a controller and several nodes.

Needs root, Linux, and Debian's slurmctld, slurmd, slurm-client and munge. There is no accounting
database. The nodes share the computer, but each node has its own CPUs and memory in the
configuration, so jobs are distributed as on a cluster. Other users cannot submit jobs, because the
key of munge is new and temporary. If the process that started SLURM is killed, the daemons end too,
and the next start removes the remaining files.
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
#: Prefix of a command that ends when its parent process ends for any reason.
WITH_PARENT = ("setpriv", "--pdeathsig", "TERM")
#: Environment variable of all daemons and jobs of a loopback SLURM, except the watchers of jobs.
MARK = b"SLURM_CLUSTER_NAME=loopback"
#: Beginning of the command line of a job's watcher.
WATCHER = b"slurmstepd: ["
#: Default configuration of all programs of SLURM. SLURM_CONF cannot name another file, because the
#: executor does not pass it on to its jobs.
CONFIGURATION = Path("/etc/slurm/slurm.conf")
#: States of finished jobs.
ENDED = {"COMPLETED", "FAILED", "CANCELLED", "NODE_FAIL", "OUT_OF_MEMORY", "TIMEOUT"}
#: Time limit for an answer of a program.
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
# A node of a busy computer may answer late.
SlurmdTimeout=300
# Memory is not limited. It is measured every second, and a job with too much memory is killed.
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
    """Return unused ports of the loopback interface."""
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(number)]
        for item in sockets:
            item.bind(("127.0.0.1", 0))
        return [item.getsockname()[1] for item in sockets]


def missing() -> str:
    """Return the reason why SLURM cannot be started on this computer; "" if it can."""
    absent = [name for name in PROGRAMS if shutil.which(name) is None]
    if absent:
        return f"no {', '.join(absent)} here (Debian: slurmctld slurmd slurm-client munge)"
    if os.geteuid() != 0:
        return "only root can start slurmd"
    if CONFIGURATION.exists() and not _is_abandoned():
        return f"{CONFIGURATION} is there: this machine has a SLURM of its own"
    return ""


def _is_abandoned() -> bool:
    """Return whether the configuration is that of a loopback SLURM whose owner was killed."""
    with CONFIGURATION.open() as file:
        if file.readline() != HEADER:
            return False
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
    return True


def processes() -> list[int]:
    """Return the process ids of daemons, watchers and jobs of all loopback SLURMs."""
    marked = []
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):  # the process has ended
            is_marked = MARK in (folder / "environ").read_bytes().split(b"\0")
            if is_marked or (folder / "cmdline").read_bytes().startswith(WATCHER):
                marked.append(int(folder.name))
    return marked


def _kill_processes() -> None:
    """Kill the processes of all loopback SLURMs."""
    for pid in processes():
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


class Slurm:
    """A running controller and its nodes. All their files are in `folder`."""

    def __init__(self, folder: Path, nodes: Sequence[str]) -> None:
        self.folder = folder
        self.nodes = tuple(nodes)
        self.processes: dict[str, subprocess.Popen] = {}

    def start(self, name: str) -> None:
        """Start `munged`, `slurmctld` or a node as a child of this process, in the foreground."""
        munge = self.folder / "munge"
        if name == "munged":
            command = [
                "munged",
                "--foreground",
                "--force",
                f"--key-file={munge}/munge.key",
                f"--socket={munge}/munge.sock",
                f"--pid-file={munge}/munged.pid",
                f"--log-file={munge}/munged.log",
                f"--seed-file={munge}/munge.seed",
            ]
        elif name == "slurmctld":
            command = ["slurmctld", "-D"]
        else:
            command = ["slurmd", "-D", "-N", name]
        variable, value = MARK.decode().split("=")
        with (self.folder / f"{name}.out").open("a") as out:
            self.processes[name] = subprocess.Popen(
                [*WITH_PARENT, *command],
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=out,
                start_new_session=True,
                env={**os.environ, variable: value},
            )

    def stop(self, name: str, number: int = signal.SIGTERM) -> None:
        """End a daemon with a signal, and wait for its end."""
        process = self.processes.pop(name)
        process.send_signal(number)
        with suppress(subprocess.TimeoutExpired):
            process.wait(10)
        process.kill()
        process.wait()

    def states(self) -> dict[str, str]:
        """Return the state of each node by name; empty if the controller does not answer."""
        process = subprocess.run(
            ["sinfo", "--noheader", "--Node", "--format=%N %T"],
            check=False,
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
        )
        return dict(line.split() for line in process.stdout.splitlines())

    def jobs(self) -> list[dict[str, str]]:
        """Return the properties of each job. The comment is the rule of Snakemake."""
        process = subprocess.run(
            ["squeue", "--noheader", "--states=all", "--format=%i|%T|%N|%C|%m|%k"],
            check=True,
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
        )
        names = ("id", "state", "node", "cpus", "memory", "comment")
        lines = process.stdout.splitlines()
        return [dict(zip(names, line.split("|"), strict=True)) for line in lines]

    def active(self) -> list[dict[str, str]]:
        """Return the jobs that have not finished."""
        return [job for job in self.jobs() if job["state"] not in ENDED]

    def control(self, *arguments: str) -> None:
        """Run `scontrol`. Raises CalledProcessError if it fails."""
        subprocess.run(
            ["scontrol", *arguments], check=True, capture_output=True, timeout=PATIENCE_S
        )


def wait_until(condition: Callable[[], object], name: str, patience_s: float = PATIENCE_S) -> None:
    """Wait until `condition` returns a true value.

    Raises TimeoutError with the `name` of the condition.
    """
    end = time.monotonic() + patience_s
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(f"{name}: not within {patience_s:g} s")
        time.sleep(0.2)


@contextmanager
def loopback_slurm(
    folder: Path, *, nodes: int = 2, cpus: int = 2, memory_mb: int = 4_000
) -> Iterator[Slurm]:
    """Run a SLURM during the block, with its files in a new folder; all processes end with it.

    `cpus` and `memory_mb` are those of one node.
    """
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
    """Install a configuration for all programs of SLURM during the block."""
    is_new_folder = not CONFIGURATION.parent.exists()
    CONFIGURATION.parent.mkdir(exist_ok=True)
    if CONFIGURATION.is_symlink():  # from a process that was killed
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
            if is_new_folder:
                CONFIGURATION.parent.rmdir()


def _end(slurm: Slurm) -> None:
    """End all jobs and daemons."""
    with suppress(subprocess.SubprocessError, TimeoutError):
        subprocess.run(["scancel", "--user=root"], check=False, timeout=10, capture_output=True)
        wait_until(lambda: not slurm.active(), "end of jobs", 20)
    for name in reversed(list(slurm.processes)):
        slurm.stop(name)
    _kill_processes()
