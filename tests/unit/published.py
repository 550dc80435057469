"""A published data set for tests, and ways to make it wrong."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
from worlds import Project, tone, write_tone

from ajgdata.paths import Paths, Tree
from ajgdata.pipeline.publish import Published, publish
from ajgdata.store.files import csv_bytes, read_csv, sha256_of, write_bytes
from ajgdata.store.publishing.archive import checksums_bytes
from ajgdata.types import Recording, Target

TARGETS = {
    "edge_mm": Target(kind="regression", unit="mm", description="length of the edge"),
    "object": Target(kind="classification", missing=("?",)),
}
TASKS = {"edge": {"target": "edge_mm", "folds": 3, "models": ["knn"]}}


def make_project(root: Path) -> Project:
    """Two sessions of tones: names that no file can have, missing labels, one recording that is
    cut short, one without sha256, and a played sound."""
    project = Project(Paths(root))
    declared = {name: target.model_dump(mode="json") for name, target in TARGETS.items()}
    project.declare(
        title="Tones | <b>",
        description="Sines.\n\n```python\nimport nothing\n```",
        licence="CC0-1.0",
        authors=["A. Nobody"],
        targets=declared,
        tasks=TASKS,
    )
    for session, pitch in (("s1", 500.0), ("s2", 520.0)):
        rows = []
        for number in range(7):
            hz = pitch + 100.25 * number
            name = f"take {number}/ä" if number < 2 else f"take {number % 3}/{number}"
            file = f"audio/{number}.wav"
            digest = write_tone(project.folder(session) / file, hz)
            rows.append(
                Recording(
                    recording_id=name,
                    file=file,
                    sha256="" if number == 3 else digest,
                    grasp_id=str(number // 2),
                    sample=number % 2,
                    object="?" if number == 4 else f"0{number % 2}",
                    labels={"edge_mm": "" if number == 5 else str(hz / 10), "day": "monday"},
                )
            )
        path = project.folder(session) / "audio/6.wav"
        path.write_bytes(path.read_bytes()[:-1000])  # left out
        rows[6] = rows[6].model_copy(update={"sha256": sha256_of(path.read_bytes())})
        played = project.excitation(session, tone(300))
        project.write(rows, session, excitation=played, gripper="latex <1>", medium="coffee")
    remake(project)
    return project


def remake(project: Project) -> None:
    """Features of both sessions."""
    project.build("s1", "s2", targets=TARGETS)


def published(project: Project, out: Path) -> Published:
    """Publish the project's data set."""
    return publish(project.paths, "d", out)


def reseal(tree: Tree) -> None:
    """Make the hashes right again, as somebody would who changes a file and hides it."""
    write_bytes(tree / tree.SUMS, checksums_bytes(tree.root))


def edit_rows(tree: Tree, change) -> None:
    """Change the list of rows of recordings.csv of session s1 in place."""
    path = tree / "sessions/s1/recordings.csv"
    header, rows = read_csv(path)
    change(rows)
    write_bytes(path, csv_bytes(header, rows))


def repack(tree: Tree, change) -> None:
    """Change the (name, content) pairs of audio.zip in place."""
    with zipfile.ZipFile(tree / tree.ARCHIVE) as old:
        pairs = [(name, old.read(name)) for name in old.namelist()]
    change(pairs)
    with zipfile.ZipFile(tree / tree.ARCHIVE, "w") as new:
        for name, content in pairs:
            new.writestr(name, content)


def flip(path: Path) -> None:
    """Change one bit in the middle of a file."""
    content = np.frombuffer(path.read_bytes(), np.uint8).copy()
    content[len(content) // 2] ^= 1
    path.write_bytes(content.tobytes())
