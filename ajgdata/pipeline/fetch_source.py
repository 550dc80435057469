"""`ajgdata fetch NAME`: the recordings of a public data set, from where its makers keep them."""

from __future__ import annotations

from ajgdata.paths import Paths
from ajgdata.pipeline.importing import import_folder
from ajgdata.pipeline.progress import Started
from ajgdata.store.importing import Imported
from ajgdata.store.scan import Scan
from ajgdata.store.sources import Each, bring, read_source


def fetch_source(
    paths: Paths,
    dataset: str,
    *,
    mirror: str = "",
    copy: bool = False,
    each: Each = iter,
    started: Started = lambda total: lambda: None,
) -> tuple[Scan, Imported]:
    """Bring the recordings of `dataset` and import them as its dataset.yaml says.

    They stay where they were brought to, outside the project, unless `copy`. `mirror` takes the
    place of the source's host. `each` goes through the files that are fetched, `started` is that of
    `import_folder`. Raises DataError, and imports nothing, unless every byte is the right one.
    """
    folder = bring(dataset, read_source(paths, dataset), mirror=mirror, each=each)
    _, found, result = import_folder(
        paths, dataset, folder, settings=None, copy=copy, started=started
    )
    return found, result
