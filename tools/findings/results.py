"""A run's results as blocks read them, and the name of the run: what was read, and its commit."""

import csv
import hashlib
import io
import json
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from ajgdata.ablations import ABLATIONS
from ajgdata.ablations.base import with_verdicts
from ajgdata.paths import Paths
from ajgdata.store.benchmarks import Job, read_benchmarks
from ajgdata.store.tables import read_tables
from ajgdata.types.table import Table

#: The project whose docs these are, wherever its results may be.
PROJECT = Paths(Path(__file__).resolve().parents[2])


class Key(NamedTuple):
    """A row of metrics.csv but for its value."""

    dataset: str
    task: str
    model: str
    part: str
    metric: str
    statistic: str


class Results:
    """Results below a folder. Remembers what was read: a block is named after that."""

    def __init__(self, folder: Path) -> None:
        # `Paths` knows the names, relative to a project; the folder itself may be called otherwise
        self._paths, self._folder = Paths(), folder
        self._read: dict[str, bytes] = {}
        self._commits: set[str] = set()
        self._quick = False

    def study(self, name: str) -> dict[str, Table]:
        """Return the tables of a study of the virtual gripper, by name."""
        return self._tables(self._paths.study(name))

    def ablation(self, name: str) -> list[Table]:
        """Return the tables of an ablation; verdicts depend on the tests of all ablations."""
        there = [one for one in ABLATIONS if self._place(self._paths.ablation(one)).is_file()]
        read = {one: self._tables(self._paths.ablation(one)).values() for one in (*there, name)}
        judged = iter(with_verdicts([table for tables in read.values() for table in tables]))
        return {one: [next(judged) for _ in tables] for one, tables in read.items()}[name]

    def experiment(self, dataset: str, task: str, kind: str) -> dict[str, Table]:
        """Return the tables of an experiment on a task, by name."""
        path = self._paths.experiment(dataset, task, kind)
        self._bytes(path)
        about, tables = read_tables(self._place(path))
        self._commits.add(about["provenance"]["git_commit"])
        return {table.name: table for table in tables}

    def sort_live(self) -> tuple[dict[str, Any], dict[str, Table]]:
        """Return what sorting through a simulated card found, and its tables by name."""
        tables = self._tables(self._paths.sort_live)
        return read_tables(self._place(self._paths.sort_live))[0], tables

    def metric(self, *key: str) -> float | None:
        """Return a value of metrics.csv by the parts of a `Key`; None if the run has none."""
        rows = _metrics(self._bytes(self._paths.metrics_table))
        if (row := rows.get(Key(*key))) is None or not row["value"]:
            return None
        self._commits.add(row["commit"])
        return float(row["value"])

    def agreements(self) -> dict[str, int]:
        """Return how many rows of the comparison with the paper have each verdict."""
        counts: dict[str, int] = json.loads(_content(self._place(self._paths.runs)))["agreements"]
        self._read["agreements"] = repr(counts).encode()
        return counts

    def jobs(self) -> list[Job]:
        """Return what was measured of each job. Raises FileNotFoundError if there is none."""
        folder = self._place(self._paths.benchmarks)
        jobs = read_benchmarks(folder)
        if not jobs:
            raise FileNotFoundError(folder)
        self._read[str(self._paths.benchmarks)] = repr(jobs).encode()
        return jobs

    def size_gb(self) -> float:
        """Return the size of all results in 1e9 bytes, to two digits."""
        size = sum(p.lstat().st_size for p in self._folder.rglob("*") if p.is_file()) / 1e9
        self._read["size"] = f"{size:.2g}".encode()
        return float(f"{size:.2g}")

    def name(self) -> str:
        """Return the name of the run, from what was read of it so far."""
        digest = hashlib.sha256()
        for path, content in sorted(self._read.items()):
            digest.update(path.encode() + b"\0" + hashlib.sha256(content).digest())
        commits = ", ".join(sorted(one[:10] + ("+" if "+" in one else "") for one in self._commits))
        small = " (small, for testing)" if self._quick else ""
        return f"Run of commit {commits or 'unknown'}{small}, results {digest.hexdigest()[:10]}."

    def _tables(self, path: Path) -> dict[str, Table]:
        self._bytes(path)
        about, tables = read_tables(self._place(path))
        self._commits.add(about["git_commit"])
        self._quick |= about["quick"]
        return {table.name: table for table in tables}

    def _bytes(self, path: Path) -> bytes:
        self._read[str(path)] = content = _content(self._place(path))
        return content

    def _place(self, path: Path) -> Path:
        return self._folder / path.relative_to(self._paths.results)


@cache
def _content(path: Path) -> bytes:
    return path.read_bytes()


@cache
def _metrics(content: bytes) -> dict[Key, dict[str, str]]:
    rows = csv.DictReader(io.StringIO(content.decode("utf-8"), newline=""))
    return {Key(*(row[name] for name in Key._fields)): row for row in rows}
