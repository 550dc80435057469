"""`python -m tools.findings [--results DIR]`: write the figures of the last run into the docs."""

import argparse
import sys
from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.store.files import write_if_changed
from tools.screenshots import write_screenshots

from .blocks import block
from .documents import documents, rewritten
from .results import Results

ROOT = Path(__file__).resolve().parents[2]


def main() -> None:
    """Rewrite every block of README and docs; say what a run lacks, and leave that as it is."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--results", type=Path, default=Path("results"))
    folder = options.parse_args().results
    if not folder.is_dir():
        sys.exit(f"{folder}: there is no such folder; run `make reproduce`, or name another one")

    def content(name: str, before: str) -> str:
        try:
            return block(name, Results(folder))
        except FileNotFoundError as error:
            print(f"{name}: left as it was, the run has no {error.filename or error}")
            return before

    for path in documents(ROOT):
        text = path.read_bytes().decode("utf-8")
        if write_if_changed(path, rewritten(text, content).encode()):
            print(f"wrote {path.relative_to(ROOT)}")
    write_screenshots(folder / Paths().report.relative_to(Paths().results))


main()
