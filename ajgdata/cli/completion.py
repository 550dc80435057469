"""Completion of arguments by the tab key; `ajgdata --install-completion` adds it to a shell."""

from ajgdata.paths import find_project
from ajgdata.store.sessions import list_datasets
from ajgdata.store.sources import list_sources


def dataset_names(incomplete: str) -> list[str]:
    """Return the data sets of the project whose name begins with `incomplete`.

    Outside a project, the list is empty.
    """
    try:
        paths = find_project()
    except FileNotFoundError:
        return []
    return [name for name in list_datasets(paths) if name.startswith(incomplete)]


def source_names(incomplete: str) -> list[str]:
    """Return the public recordings that can be fetched, whose name begins with `incomplete`.

    Outside a project, the list is empty.
    """
    try:
        paths = find_project()
    except FileNotFoundError:
        return []
    return [name for name in list_sources(paths) if name.startswith(incomplete)]
