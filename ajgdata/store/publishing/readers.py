"""Read a published data set with xarray, datasets, mlcroissant and frictionless, and compare what
they read with metadata.csv.

Runs in a process of its own, `python -m ajgdata.store.publishing.readers`, without network, because
caches must be set before these libraries are imported.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from ajgdata.paths import Tree
from ajgdata.store.publishing.checks import Defect
from ajgdata.store.publishing.documents import AUDIO, LABELS, RECORDINGS
from ajgdata.store.publishing.table import FILE_NAME, read_table
from ajgdata.types import DataError

#: Nothing is fetched, nothing is told to anybody.
OFFLINE = {
    "HF_HUB_OFFLINE": "1",
    "HF_DATASETS_OFFLINE": "1",
    "HF_HUB_DISABLE_TELEMETRY": "1",
    "HF_HUB_DISABLE_PROGRESS_BARS": "1",
    "HF_DATASETS_DISABLE_PROGRESS_BARS": "1",
    "DO_NOT_TRACK": "1",
}
LIBRARIES = ("datasets", "frictionless", "mlcroissant")
Rows = Sequence[Mapping[str, str]]


def reader_defects(trees: Sequence[Tree]) -> list[list[Defect]]:
    """Return what other readers find wrong with each of `trees`, in one process without network.

    Raises DataError when a reader is not installed.
    """
    if not trees:
        return []
    with tempfile.TemporaryDirectory() as scratch:
        caches = {"HF_HOME": f"{scratch}/hf", "CROISSANT_CACHE": f"{scratch}/croissant"}
        answer = Path(scratch, "told.json")
        command = [sys.executable, "-P", "-m", __name__, str(answer), *(str(t.root) for t in trees)]
        done = subprocess.run(
            command, env={**os.environ, **OFFLINE, **caches}, capture_output=True, text=True,
            check=False,
        )  # fmt: skip
        if not answer.is_file():
            lines = done.stderr.strip().splitlines() or ["it said nothing"]
            fix = "pip install 'ajgdata[publish]'"
            raise DataError("readers of published data sets", lines[-1], fix)
        return [[Defect(*cells) for cells in tree] for tree in json.loads(answer.read_bytes())]


def _main(answer: str, *roots: str) -> None:
    for library in LIBRARIES:
        import_module(library)
    sys.addaudithook(_no_network)
    of_trees = []
    for root in roots:
        of_trees.append([vars(defect) for defect in _views(Tree(Path(root).resolve()))])
        shutil.rmtree(os.environ["CROISSANT_CACHE"], ignore_errors=True)  # it knows them by name
    content = [[list(defect.values()) for defect in of_tree] for of_tree in of_trees]
    Path(answer).write_text(json.dumps(content), encoding="utf-8")


def _no_network(event: str, _: tuple[object, ...]) -> None:
    if event in ("socket.connect", "socket.getaddrinfo"):
        raise RuntimeError("a reader asked for the network")


def _views(tree: Tree) -> Iterator[Defect]:
    try:
        rows = [row for _, row in read_table(tree)[1]]
    except DataError as error:
        yield Defect(tree.METADATA, error.problem, error.fix)
        return
    checks: dict[str, Callable[[Tree, Rows], Iterable[Defect]]] = {
        f"{tree.FEATURES} by xarray": _xarray,
        f"{tree.METADATA} and audio by datasets": _datasets,
        f"{tree.CROISSANT} by mlcroissant": _croissant,
        f"{tree.DATAPACKAGE} by frictionless": _frictionless,
    }
    for name, check in checks.items():
        yield from _tried(name, check, tree, rows)


def _tried(
    name: str, check: Callable[[Tree, Rows], Iterable[Defect]], tree: Tree, rows: Rows
) -> list[Defect]:
    """Return the defects that a reader finds; what it raises, whatever that is, is one and not a
    crash."""
    silent = io.StringIO()
    try:
        with contextlib.redirect_stdout(silent), contextlib.redirect_stderr(silent):
            return list(check(tree, rows))
    except Exception as raised:
        error: BaseException = raised
    while error.__cause__ is not None:  # the first cause
        error = error.__cause__
    text = " ".join("".join(traceback.format_exception_only(error)).split())
    return [Defect(name, f"cannot be read ({text[:200]})")]


def same(text: str, seen: object) -> bool:
    """Return True if a reader saw what a cell says: readers make numbers and booleans of texts, and
    one value for missing of empty ones."""
    if isinstance(seen, bytes):
        seen = seen.decode()
    if seen is None or (isinstance(seen, float) and math.isnan(seen)):
        return text == ""
    if str(seen) == text or (isinstance(seen, bool) and str(seen).lower() == text.lower()):
        return True
    try:
        return float(text) == float(str(seen))
    except ValueError:
        return False


def _compared(name: str, rows: Rows, seen: Sequence[Mapping[str, Any]]) -> Iterator[Defect]:
    """Yield a defect for the first cell in which what a reader saw differs from metadata.csv."""
    if len(seen) != len(rows):
        yield Defect(name, f"reads {len(seen)} recordings, {Tree.METADATA} holds {len(rows)}")
        return
    for row, got in zip(rows, seen, strict=True):
        for column, text in row.items():
            if column in got and not same(text, got[column]):
                problem = f"reads {column} = {got[column]!r} of {row['recording']}, not {text!r}"
                yield Defect(name, problem)
                return
        if lacking := [column for column in row if column not in got]:
            yield Defect(name, f"does not see column {lacking[0]}")
            return


def _xarray(tree: Tree, rows: Rows) -> Iterator[Defect]:
    import xarray

    with xarray.open_dataset(tree / tree.FEATURES) as store:
        names = [str(n) for n in store.coords if store[n].dims == ("recording",)]
        columns = {str(name): store[name].values.tolist() for name in names}
        if store.sizes["recording"] != len(rows):
            yield Defect(
                tree.FEATURES, f"holds {store.sizes['recording']} spectra, not {len(rows)}"
            )
            return
        if store.feature.dims != ("recording", "frequency") or not store.frequency.attrs["units"]:
            yield Defect(tree.FEATURES, "has no `feature` (recording, frequency in Hz)")
        if not bool(store.feature.notnull().all()):
            yield Defect(tree.FEATURES, "holds features that are no numbers")
    seen = [
        dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)
    ]
    inside = [{k: v for k, v in row.items() if k != FILE_NAME} for row in rows]
    yield from _compared(f"{tree.FEATURES} by xarray", inside, seen)


def _datasets(tree: Tree, rows: Rows) -> Iterator[Defect]:
    """Read it as an audio folder. Paths instead of decoded audio: decoding needs torchcodec and
    ffmpeg."""
    import soundfile

    datasets = import_module("datasets")  # the project's folder has this name
    loaded = datasets.load_dataset(str(tree.root), split="train", streaming=True)
    seen = list(loaded.cast_column("audio", datasets.Value("string")))
    for one in seen:
        one[FILE_NAME] = Path(one["audio"]).relative_to(tree.root).as_posix()
    name = f"{tree.METADATA} by datasets"
    yield from _compared(name, rows, seen)
    for one in seen:
        samples, _ = soundfile.read(one["audio"], dtype="float32")
        if not len(samples):
            yield Defect(one[FILE_NAME], "holds no samples")


def _croissant(tree: Tree, rows: Rows) -> Iterator[Defect]:
    """Validation alone notices neither a wrong hash nor a wrong column: every record is read."""
    import mlcroissant

    dataset = mlcroissant.Dataset(str(tree / tree.CROISSANT))
    name = f"{tree.CROISSANT} by mlcroissant"
    seen = [
        {field.removeprefix(f"{RECORDINGS}/"): value for field, value in record.items()}
        for record in dataset.records(RECORDINGS)
    ]
    yield from _compared(name, rows, seen)
    digests = {row[FILE_NAME]: row["sha256"] for row in rows}
    heard = {
        record[f"{AUDIO}/{FILE_NAME}"].decode(): hashlib.sha256(
            record[f"{AUDIO}/content"]
        ).hexdigest()
        for record in dataset.records(AUDIO)
    }
    for file in sorted(set(heard) ^ set(digests)):
        yield Defect(name, f"its recordings are not those of {Tree.METADATA}: {file}")
    for file in sorted(set(heard) & set(digests)):
        if heard[file] != digests[file]:
            yield Defect(name, f"reads other bytes of {file}")


def _frictionless(tree: Tree, rows: Rows) -> Iterator[Defect]:
    name = f"{tree.DATAPACKAGE} by frictionless"
    frictionless = import_module("frictionless")
    report = frictionless.validate(str(tree / tree.DATAPACKAGE))
    for kind, message in report.flatten(["type", "message"])[:5]:
        yield Defect(name, f"{kind}: {' '.join(str(message).split())[:200]}")
    labels = frictionless.Package(str(tree / tree.DATAPACKAGE)).get_resource(LABELS)
    yield from _compared(name, rows, [row.to_dict() for row in labels.read_rows()])


if __name__ == "__main__":
    _main(*sys.argv[1:])
