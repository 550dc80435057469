"""Completion of arguments by the tab key; `ajgdata --install-completion` adds it to a shell."""

from collections.abc import Callable

from ajgdata.paths import Paths, find_project
from ajgdata.store.sessions import list_datasets


def dataset_names(incomplete: str) -> list[str]:
    """Return the data sets of the project whose name begins with `incomplete`.

    Outside a project, the list is empty.
    """
    return _names(list_datasets, incomplete)


def source_names(incomplete: str) -> list[str]:
    """Return the public recordings that can be fetched, whose name begins with `incomplete`.

    Outside a project, the list is empty.
    """
    from ajgdata.store.sources import list_sources  # imports the packages for downloads

    return _names(list_sources, incomplete)


def _names(list_names: Callable[[Paths], list[str]], incomplete: str) -> list[str]:
    """Return the names in the project that begin with `incomplete`; none outside a project."""
    try:
        paths = find_project()
    except FileNotFoundError:
        return []
    return [name for name in list_names(paths) if name.startswith(incomplete)]
