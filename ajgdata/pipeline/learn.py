"""`ajgdata sort --learn`: what people said of a run becomes labels of its recordings."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ajgdata.live.events import read_events
from ajgdata.live.learning import Asked, Learnt, learn, truths
from ajgdata.paths import RECORDINGS_FILE, Paths
from ajgdata.store.sessions import read_dataset, read_session
from ajgdata.types import DataError


def learn_from(
    paths: Paths, run: str, ask: Asked, doubt: Callable[[str], object] = lambda _: None
) -> tuple[str, str, Learnt]:
    """Label the recordings of `run`: a log, a session's folder, or DATASET/SESSION.

    A class that has no bin is doubted, and asked for once more. Returns data set, session, and what
    was learnt. Raises DataError if there is no such run.
    """
    log, folder = _run_of(paths, run)
    dataset, session = folder.parent.parent.name, folder.name
    setup = getattr(read_session(folder).acquisition, "setup", {})
    if "sort" not in setup:
        fix = "name a session that `ajgdata sort` recorded"
        raise DataError(folder, "is no session of sorting", fix)
    spec = read_dataset(paths, dataset)
    known = truths(read_events(log)) if log.is_file() else {}
    target = str(setup["sort"]["target"])
    classes = sorted(setup["sort"].get("bins", {}))

    def asked(number: int, predicted: str) -> str:
        said, before = ask(number, predicted), predicted
        while said and said not in classes and said != before:
            doubt(f"{said!r} is none of the classes {', '.join(classes)}: again, to keep it")
            said, before = ask(number, said), said
        return said

    return dataset, session, learn(folder, spec, target, known, asked)


def _run_of(paths: Paths, run: str) -> tuple[Path, Path]:
    """Return log and session of a run, however it is named."""
    path = Path(run)
    if path.is_file() and path.parent.parent.name == "live":
        dataset, session = path.parent.parent.parent.name, path.parent.name
    elif (path / RECORDINGS_FILE).is_file():
        path = path.absolute()
        dataset, session = path.parent.parent.name, path.name
    else:
        dataset, _, session = run.partition("/")
    folder = paths.session(dataset, session) if session else Path(run)
    if not (folder / RECORDINGS_FILE).is_file():
        fix = "name a log, the folder of a session, or DATASET/SESSION"
        raise DataError(run, "there is no such run", fix)
    return paths.events(dataset, session), folder
