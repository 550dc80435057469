"""A small project of synthetic tones, run once; each test changes a copy of it."""

import re
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import yaml

from ajgdata.paths import Paths
from ajgdata.store.audio import write_pcm24
from ajgdata.store.sessions import write_session
from ajgdata.types import Recording, Session

ROOT = Path(__file__).resolve().parents[2]
RATE_HZ = 44_100
SESSIONS = ("day1", "day2")
DECLARATION = {
    "name": "tones",
    "description": "Sines of two pitches, for tests.",
    "targets": {"pitch": {"kind": "classification"}},
    "tasks": {"pitch": {"target": "pitch", "folds": 3, "models": ["knn"]}},
}


def write_tone(path: Path, hz: float, seed: int) -> None:
    """A fifth of a second of a sine in noise."""
    time = np.arange(RATE_HZ // 5) / RATE_HZ
    noise = np.random.default_rng(seed).normal(0, 0.01, len(time))
    write_pcm24(path, 0.5 * np.sin(2 * np.pi * hz * time) + noise, RATE_HZ)


#: The studies of the virtual gripper take minutes; tests ask for what they look at.
SETTINGS = {"pages": [], "publish": [], "quick": True}


class Project:
    """A project folder and what Snakemake would do in it."""

    def __init__(self, root: Path) -> None:
        self.root, self.paths = root, Paths(root)
        if not (settings := root / "settings.yaml").exists():
            settings.write_text(yaml.safe_dump(SETTINGS))

    def snakemake(self, *arguments: str) -> str:
        command = [sys.executable, "-m", "snakemake", "--snakefile", str(ROOT / "Snakefile")]
        command += ["--configfile", str(self.root / "settings.yaml")]
        command += ["--directory", str(self.root), "--cores", "2", *arguments]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout + done.stderr

    def planned(self, *arguments: str) -> dict[str, int]:
        """Jobs that a dry run announces, by rule."""
        text = self.snakemake("--dry-run", *arguments)
        table = re.search(r"Job stats:\njob +count\n[- ]+\n(.*?)\ntotal", text, flags=re.S)
        rows = table[1].splitlines() if table else []
        return {rule: int(count) for rule, count in (row.split() for row in rows)}

    def shards(self) -> Counter:
        """Sessions whose features a dry run would compute."""
        text = self.snakemake("--dry-run")
        return Counter(re.findall(r"Spectra of session (\S+) of", text))

    def folder(self, session: str) -> Path:
        return self.paths.session("tones", session)


@pytest.fixture(scope="session")
def finished(tmp_path_factory) -> Project:
    """The project after one whole run, without the rule that runs tests."""
    project = Project(tmp_path_factory.mktemp("project"))
    declaration = project.paths.dataset("tones")
    declaration.parent.mkdir(parents=True)
    declaration.write_text(yaml.safe_dump(DECLARATION))
    for number, session in enumerate(SESSIONS):
        recordings = []
        for index in range(8):
            pitch = "high" if index % 2 else "low"
            file = f"audio/{index}.wav"
            hz = (3000 if index % 2 else 300) + 40 * index
            write_tone(project.folder(session) / file, hz, seed=100 * number + index)
            recordings.append(
                Recording(
                    recording_id=str(index), file=file, grasp_id=str(index), labels={"pitch": pitch}
                )
            )
        write_session(
            project.folder(session), Session(session_id=session, source="import"), recordings
        )
    project.snakemake("results/report/index.html")
    return project


@pytest.fixture
def project(finished, tmp_path) -> Project:
    """A copy that a test may change; copying keeps times."""
    target = tmp_path / "copy"
    shutil.copytree(finished.root, target, symlinks=True)
    return Project(target)
