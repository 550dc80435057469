"""A project folder, and runs of the workflow in it: on this machine, or through SLURM."""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from ajgdata.paths import Paths
from tools.loopback_slurm import WITH_PARENT

ROOT = Path(__file__).resolve().parents[2]
#: What runs are asked for: all, and the features of a data set.
TARGETS = ("results/report/index.html", "results/metrics.csv")
FEATURES = "results/features/tones.nc"
#: Seconds after which a run is given up: a busy machine takes ten times as long as an idle one.
PATIENCE_S = 1800


class Project:
    """A project folder, run on this machine or through SLURM."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.paths = Paths(root)

    def command(self, *arguments: str) -> list[str]:
        given = [sys.executable, "-m", "snakemake", "--snakefile", str(ROOT / "workflow/Snakefile")]
        return [*given, "--configfile", "settings.yaml", *arguments]

    def run_here(self, *arguments: str) -> None:
        profile = ("--workflow-profile", str(ROOT / "profiles/default"), "--cores", "2")
        done = subprocess.run(
            self.command(*profile, *arguments),
            check=False,
            cwd=self.root,
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
        )
        assert done.returncode == 0, done.stdout + done.stderr

    def submit(self, *targets: str, more: Sequence[str] = ()) -> "Submitted":
        """Start a run through SLURM: groups of two sessions, one CPU each."""
        profile = ("--workflow-profile", str(ROOT / "profiles/slurm"), "--cores", "1")
        quick = ("--slurm-init-seconds-before-status-checks", "1", "--latency-wait", "20")
        groups = ("--group-components", "acquire=2")
        return Submitted(self, self.command(*profile, *quick, *groups, *more, "--", *targets))


class Submitted:
    """A run of Snakemake whose jobs SLURM executes."""

    def __init__(self, project: Project, command: list[str]) -> None:
        self.log = project.root / "submitted.log"
        with self.log.open("w") as log:
            self.process = subprocess.Popen(
                [*WITH_PARENT, *command],
                cwd=project.root,
                stdout=log,
                stderr=log,
                stdin=subprocess.DEVNULL,
            )

    def finish(self) -> str:
        """Wait for its end, which must be a good one; returns what it said."""
        try:
            code = self.process.wait(PATIENCE_S)
        finally:
            self.process.kill()
        said = self.log.read_text()
        assert code == 0, said
        return said
